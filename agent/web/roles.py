"""What a role may do; a higher one may do everything that a lower one may."""

from __future__ import annotations

from enum import IntEnum


class Role(IntEnum):
    """Who somebody is to the page."""

    VIEWER = 1
    """Sees cells, runs, results, histories and alarms."""
    TECHNICIAN = 2
    """Starts cycles, acknowledges alarms, notes events."""
    ENGINEER = 3
    """Chooses baselines, invites people, reads the audit trail."""

    @property
    def word(self) -> str:
        """Return the name in lower case, as it is kept and typed."""
        return self.name.lower()

    @classmethod
    def of(cls, word: str) -> Role:
        """Return the role of that name; ValueError where there is none."""
        try:
            return cls[word.upper()]
        except KeyError:
            raise ValueError(f"expected one of {', '.join(r.word for r in cls)}") from None
