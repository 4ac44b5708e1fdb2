"""The interlock: whether this axis may move, as a literal table over an immutable state.

Default deny: what the table does not list trips the interlock. A trip latches: nothing in here
leads out of TRIPPED, and a new cycle starts with a new interlock, after a new preflight.

::

    LOCKED --preflight passed--> READY --enable asked--> ENABLING --drive is on--> MOVING
    MOVING --motion done--> DISABLING --drive is off--> DONE
    any --trip, or anything not drawn here--> TRIPPED
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from types import MappingProxyType


class State(enum.Enum):
    """Where the cycle stands, as far as motion is concerned."""

    LOCKED = "locked"  # nothing is known yet, so nothing may move
    READY = "ready"  # preflight has passed; the drive has no torque
    ENABLING = "enabling"  # torque is on its way; only standstill is allowed
    MOVING = "moving"  # set-points may pass the gate
    DISABLING = "disabling"  # torque is being taken away
    DONE = "done"
    TRIPPED = "tripped"  # latched


class Event(enum.Enum):
    """What can happen to an interlock."""

    PREFLIGHT_PASSED = "preflight passed"
    ENABLE_ASKED = "enable asked"
    DRIVE_ON = "drive is on"
    MOTION_DONE = "motion done, joint at rest"
    DRIVE_OFF = "drive is off"
    TRIP = "trip"


TRANSITIONS: MappingProxyType[tuple[State, Event], State] = MappingProxyType(
    {
        (State.LOCKED, Event.PREFLIGHT_PASSED): State.READY,
        (State.READY, Event.ENABLE_ASKED): State.ENABLING,
        (State.ENABLING, Event.DRIVE_ON): State.MOVING,
        (State.MOVING, Event.MOTION_DONE): State.DISABLING,
        (State.DISABLING, Event.DRIVE_OFF): State.DONE,
    }
)


@dataclass(frozen=True)
class Interlock:
    """An immutable state with the reason for a trip.

    Parameters
    ----------
    state : State
        Where it stands.
    reason : str
        Why it tripped; empty otherwise. The first reason stays: later trips do not hide it.
    """

    state: State = State.LOCKED
    reason: str = ""

    @property
    def may_move(self) -> bool:
        """Return whether a set-point other than standstill may be sent."""
        return self.state is State.MOVING

    def after(self, event: Event, reason: str = "") -> Interlock:
        """Return the interlock after `event`.

        What the table does not list is a trip, with its own reason: an event at the wrong time
        means that the agent no longer knows where it stands.
        """
        if self.state is State.TRIPPED:
            return self
        if event is Event.TRIP:
            return Interlock(State.TRIPPED, reason or "tripped without a reason")
        target = TRANSITIONS.get((self.state, event))
        if target is None:
            return Interlock(
                State.TRIPPED, f"'{event.value}' is not expected while {self.state.value}"
            )
        return Interlock(target)
