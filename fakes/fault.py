"""What all scripted faults share: a kind by name, and when they begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True, kw_only=True)
class Fault:
    """What all faults share: when they begin.

    Parameters
    ----------
    at_s : float or None
        Seconds since the drive was switched on; 0 unless `at_sync` is given.
    at_sync : int or None
        The SYNC, counted from 1 while OPERATIONAL, with which it begins.
    """

    kind: ClassVar[str] = ""
    at_s: float | None = None
    at_sync: int | None = None

    def __post_init__(self) -> None:
        if self.at_s is not None and self.at_sync is not None:
            raise ValueError(f"{self.kind}: expected at_s or at_sync, got both")
        if self.at_s is not None and not self.at_s >= 0.0:
            raise ValueError(f"{self.kind}: at_s: expected 0 or more, got {self.at_s}")
        if self.at_sync is not None and self.at_sync < 1:
            raise ValueError(f"{self.kind}: at_sync: expected 1 or more, got {self.at_sync}")

    def has_begun(self, elapsed_s: float, syncs: int) -> bool:
        """Return whether its time has come."""
        if self.at_sync is not None:
            return syncs >= self.at_sync
        return elapsed_s >= (self.at_s or 0.0)
