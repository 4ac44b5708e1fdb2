"""CiA 402's state machine as a literal table: where the drive is, where we want it, what to say.

One row a goal, one column a state; every pair is written out. Nothing here resets a fault and
nothing climbs out of a quick stop but through taking the voltage away.
"""

from __future__ import annotations

from drivers.cia402.words import Controlword, State
from drivers.ports import Goal

_OFF = Controlword.DISABLE_VOLTAGE
_STOP = Controlword.QUICK_STOP

NEXT_CONTROLWORD: dict[tuple[Goal, State], Controlword] = {
    (Goal.ON, State.NOT_READY): _OFF,
    (Goal.ON, State.SWITCH_ON_DISABLED): Controlword.SHUTDOWN,
    (Goal.ON, State.READY): Controlword.SWITCH_ON,
    (Goal.ON, State.SWITCHED_ON): Controlword.ENABLE_OPERATION,
    (Goal.ON, State.ENABLED): Controlword.ENABLE_OPERATION,
    (Goal.ON, State.QUICK_STOP): _OFF,
    (Goal.ON, State.FAULT_REACTION): _OFF,
    (Goal.ON, State.FAULT): _OFF,
    (Goal.OFF, State.NOT_READY): _OFF,
    (Goal.OFF, State.SWITCH_ON_DISABLED): _OFF,
    (Goal.OFF, State.READY): _OFF,
    (Goal.OFF, State.SWITCHED_ON): _OFF,
    # Disable operation: the drive ramps down under control before it lets go.
    (Goal.OFF, State.ENABLED): Controlword.SWITCH_ON,
    (Goal.OFF, State.QUICK_STOP): _OFF,
    (Goal.OFF, State.FAULT_REACTION): _OFF,
    (Goal.OFF, State.FAULT): _OFF,
    (Goal.QUICK_STOP, State.NOT_READY): _STOP,
    (Goal.QUICK_STOP, State.SWITCH_ON_DISABLED): _STOP,
    (Goal.QUICK_STOP, State.READY): _STOP,
    (Goal.QUICK_STOP, State.SWITCHED_ON): _STOP,
    (Goal.QUICK_STOP, State.ENABLED): _STOP,
    (Goal.QUICK_STOP, State.QUICK_STOP): _STOP,
    # Told to stop, never to let go: a drive in fault heeds neither, and one wrong bit in an answer
    # makes a fault reaction of a quick stop. Without torque the joint would coast.
    (Goal.QUICK_STOP, State.FAULT_REACTION): _STOP,
    (Goal.QUICK_STOP, State.FAULT): _STOP,
}


def next_controlword(goal: Goal, state: State | None) -> Controlword:
    """Return the controlword that takes the drive one step towards `goal`.

    Parameters
    ----------
    goal : Goal
        Where the agent wants the drive.
    state : State or None
        What the last statusword spelled; None when there is none or it spells nothing: then the
        drive is told to stop or to stay off, never to go on.
    """
    if state is None:
        return _STOP if goal is Goal.QUICK_STOP else _OFF
    return NEXT_CONTROLWORD[goal, state]
