"""One attempt: what is asked for, and what became of it."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from agent.night.windows import Window

ENDED = ("run", "alarm", "skip", "stopped", "failed", "missed")
"""Kinds of events after which an axis is not tried again in that night."""


@dataclass(frozen=True)
class Outcome:
    """What became of an attempt.

    Parameters
    ----------
    kind : str
        ``run`` (done, no bad news), ``alarm`` (done, bad news), ``skip`` (nothing has moved),
        ``stopped`` (the joint was stopped; what was recorded is kept) or ``failed`` (our own
        fault, or a file's).
    sentence : str
        For a person.
    recording : str
        Content hash of what was recorded; empty where nothing was.
    details : mapping
        Whatever else belongs to it, as JSON.
    """

    kind: str
    sentence: str
    recording: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)


class Attempts(Protocol):
    """What the night needs of the cell; nothing of it raises for what a device or a disk does."""

    def blocked(self, axis: int) -> str:
        """Return why the axis must not run unattended now; empty where it may."""
        ...

    def needs(self, axis: int) -> datetime.timedelta:
        """Return how long a cycle takes at most, from the handshake to the verdict."""
        ...

    def temperature(self, axis: int) -> float | None:
        """Return the gearbox temperature in degC, read without the drive; None: not readable."""
        ...

    def attempt(self, window: Window) -> Outcome:
        """Drive one cycle, ended by force (the one clean-up path) when the window ends."""
        ...
