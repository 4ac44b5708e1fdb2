"""The CiA 402 state machine of the fake: controlword in, state, motion and statusword out."""

from __future__ import annotations

import enum
from collections.abc import Callable

QUICK_STOP_OPTION, SHUTDOWN_OPTION, DISABLE_OPTION = 0x605A, 0x605B, 0x605C
HALT_OPTION, FAULT_OPTION = 0x605D, 0x605E

FAULT_RESET_BIT, HALT_BIT = 0x0080, 0x0100
FIRST_STAYING_QUICK_STOP = 5  # options 5 to 8 stay in QUICK STOP ACTIVE after the stop


class State(enum.IntEnum):
    """States with their statusword bits 0-3, 5 and 6."""

    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


class Motion(enum.Enum):
    """What the drive loop has to do."""

    NO_TORQUE = "no torque"
    FOLLOW = "follow the target"
    PROFILE_RAMP = "brake on 0x6084"
    QUICK_RAMP = "brake on 0x6085"
    CURRENT_LIMIT = "brake with all the torque there is"


_RAMPS = {
    1: Motion.PROFILE_RAMP,
    2: Motion.QUICK_RAMP,
    3: Motion.CURRENT_LIMIT,
    4: Motion.CURRENT_LIMIT,
    5: Motion.PROFILE_RAMP,
    6: Motion.QUICK_RAMP,
    7: Motion.CURRENT_LIMIT,
}


class StateMachine:
    """States and transitions of CiA 402-2; time and torque are someone else's business.

    Commands are levels, acted on at each write, as in a drive that gets them in a cyclic PDO.
    Two are edges: fault reset (bit 7 rising), and leaving QUICK STOP ACTIVE, which takes a
    changed controlword, so that a stream of old commands does not undo the stop.

    Parameters
    ----------
    option : callable
        Returns the value of an option code object (0x605A to 0x605E).
    may_reset : callable
        Whether the cause of a fault is gone, so that a reset is accepted.
    on_reset : callable
        Told when a fault has been reset.

    Attributes
    ----------
    deaf_to_quick_stop : bool
        Whether orders of a quick stop are passed over: a broken drive.
    taken_over : bool
        Whether no controlword is obeyed: somebody drives it locally.
    """

    def __init__(
        self,
        option: Callable[[int], int],
        may_reset: Callable[[], bool],
        on_reset: Callable[[], None],
    ) -> None:
        self._option = option
        self._may_reset = may_reset
        self._on_reset = on_reset
        self.state = State.SWITCH_ON_DISABLED
        self.controlword = 0
        self.deaf_to_quick_stop = False
        self.taken_over = False
        self._ramp = Motion.QUICK_RAMP
        self._after_stop: State | None = None

    @property
    def motion(self) -> Motion:
        """Return what the drive loop has to do in this state."""
        if self.state in (State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE):
            return self._ramp
        if self.state is not State.OPERATION_ENABLED:
            return Motion.NO_TORQUE
        if self._after_stop is not None:
            return self._ramp
        if self.controlword & HALT_BIT:
            return _RAMPS.get(self._option(HALT_OPTION), Motion.PROFILE_RAMP)
        return Motion.FOLLOW

    def command(self, controlword: int) -> None:
        """Act on a controlword from the bus."""
        if self.taken_over:
            return
        before, self.controlword = self.controlword, controlword
        if self.state is State.FAULT:
            if controlword & ~before & FAULT_RESET_BIT and self._may_reset():
                self._enter(State.SWITCH_ON_DISABLED)
                self._on_reset()
            return
        if self.state is State.FAULT_REACTION_ACTIVE or controlword & FAULT_RESET_BIT:
            return
        if not controlword & 0x02:
            self.disable_voltage()
        elif not controlword & 0x04:
            if not self.deaf_to_quick_stop:
                self.quick_stop()
        elif not controlword & 0x01:
            self._shutdown()
        elif not controlword & 0x08:
            self._switch_on()
        else:
            self._enable(changed=controlword != before)

    def disable_voltage(self) -> None:
        """Take the torque away (transitions 7, 9, 10, 12); a fault stays a fault."""
        if self.state not in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            self._enter(State.SWITCH_ON_DISABLED)

    def quick_stop(self) -> None:
        """Stop fast (transition 11), or leave the lower states (7, 10)."""
        if self.state is State.OPERATION_ENABLED:
            option = self._option(QUICK_STOP_OPTION)
            if option == 0:
                self._enter(State.SWITCH_ON_DISABLED)
                return
            stays = option >= FIRST_STAYING_QUICK_STOP
            self._enter(State.QUICK_STOP_ACTIVE)
            self._ramp = _RAMPS[option]
            self._after_stop = None if stays else State.SWITCH_ON_DISABLED
        elif self.state in (State.READY_TO_SWITCH_ON, State.SWITCHED_ON):
            self._enter(State.SWITCH_ON_DISABLED)

    def fault(self) -> None:
        """React to a fault (transitions 13 and 14): latched until it is reset."""
        if self.state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            return
        option = self._option(FAULT_OPTION)
        if option == 0 or self.motion is Motion.NO_TORQUE:
            self._enter(State.FAULT)
            return
        self._enter(State.FAULT_REACTION_ACTIVE)
        self._ramp = _RAMPS[option]
        self._after_stop = State.FAULT

    def at_rest(self) -> None:
        """Take the transition that waited for standstill, if one did."""
        if self._after_stop is not None:
            self._enter(self._after_stop)

    def reset(self) -> None:
        """Start anew, as after switching on: no torque, no fault, no controlword."""
        self.controlword = 0
        self._enter(State.SWITCH_ON_DISABLED)

    def _shutdown(self) -> None:
        if self.state in (State.SWITCH_ON_DISABLED, State.SWITCHED_ON):
            self._enter(State.READY_TO_SWITCH_ON)
        elif self.state is State.OPERATION_ENABLED:
            self._leave_operation(State.READY_TO_SWITCH_ON, SHUTDOWN_OPTION)

    def _switch_on(self) -> None:
        if self.state is State.READY_TO_SWITCH_ON:
            self._enter(State.SWITCHED_ON)
        elif self.state is State.OPERATION_ENABLED:
            self._leave_operation(State.SWITCHED_ON, DISABLE_OPTION)

    def _enable(self, *, changed: bool) -> None:
        if self.state in (State.READY_TO_SWITCH_ON, State.SWITCHED_ON) or (
            self.state is State.QUICK_STOP_ACTIVE and self._after_stop is None and changed
        ):
            self._enter(State.OPERATION_ENABLED)
        elif self.state is State.OPERATION_ENABLED and changed:
            self._after_stop = None  # enabled again while it was ramping down

    def _leave_operation(self, state: State, option_index: int) -> None:
        if self._option(option_index) == 0:
            self._enter(state)
        else:
            self._ramp, self._after_stop = Motion.PROFILE_RAMP, state

    def _enter(self, state: State) -> None:
        self.state, self._after_stop = state, None
