"""Scripted faults of the way between a device and its bus; `fakes.fault_wire` plays them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from fakes.fault import Fault


@dataclass(frozen=True, kw_only=True)
class WireFault(Fault):
    """What `fakes.fault_wire.Wire` does to frames between a drive and the bus.

    Parameters
    ----------
    lasts_s : float
        Seconds until the wire is sound again.
    identifiers : sequence of int
        Which frames; none means all of them.
    towards : str
        ``agent``, ``drive`` or ``both``.
    share : float
        Of these frames, 0 to 1.
    """

    kind: ClassVar[str] = "wire"
    lasts_s: float = math.inf
    identifiers: tuple[int, ...] = ()
    towards: str = "both"
    share: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "identifiers", tuple(self.identifiers))
        if self.towards not in ("agent", "drive", "both"):
            raise ValueError(f"{self.kind}: towards: expected agent, drive or both")
        if not (0.0 <= self.share <= 1.0 and self.lasts_s >= 0.0):
            raise ValueError(f"{self.kind}: expected 0 <= share <= 1 and lasts_s >= 0")


@dataclass(frozen=True, kw_only=True)
class Lost(WireFault):
    """Frames do not arrive."""

    kind: ClassVar[str] = "lost"


@dataclass(frozen=True, kw_only=True)
class Doubled(WireFault):
    """Frames arrive twice."""

    kind: ClassVar[str] = "doubled"


@dataclass(frozen=True, kw_only=True)
class Swapped(WireFault):
    """A frame arrives after the one behind it."""

    kind: ClassVar[str] = "swapped"


@dataclass(frozen=True, kw_only=True)
class Late(WireFault):
    """Frames arrive `delay_s` later, in their order."""

    kind: ClassVar[str] = "late"
    delay_s: float = 0.02


@dataclass(frozen=True, kw_only=True)
class Stalled(WireFault):
    """Frames wait until the wire is sound again and then arrive all at once, in their order."""

    kind: ClassVar[str] = "stalled"


@dataclass(frozen=True, kw_only=True)
class Flipped(WireFault):
    """One bit of the data is wrong, as behind a gateway that makes a CRC of its own."""

    kind: ClassVar[str] = "flipped"


@dataclass(frozen=True, kw_only=True)
class Short(WireFault):
    """Only the first `keep` bytes arrive."""

    kind: ClassVar[str] = "short"
    keep: int = 3


@dataclass(frozen=True, kw_only=True)
class Falsified(WireFault):
    """The drive reports a wrong number: `size` bytes from `offset`, signed, low byte first.

    Parameters
    ----------
    change : str
        ``add`` the value, ``set`` it, ``multiply`` by it, or ``hold`` what was there first.
    """

    kind: ClassVar[str] = "falsified"
    offset: int = 0
    size: int = 2
    change: str = "set"
    value: int = 0


@dataclass(frozen=True, kw_only=True)
class Injected(WireFault):
    """Somebody else sends frames.

    Parameters
    ----------
    data : str
        Bytes in hexadecimal; "" for random ones, eight at most.
    frames_per_s : float
        How many; 0 for a single one.
    flavour : str
        ``data``, ``extended`` (29-bit identifier), ``remote`` or ``error``.
    """

    kind: ClassVar[str] = "injected"
    data: str = ""
    frames_per_s: float = 0.0
    flavour: str = "data"
