"""The words of the job handshake: what the numbers in a controller's registers mean.

They are those of the map ``robot-job`` and of docs/modbus.md.
"""

from __future__ import annotations

from collections.abc import Mapping

from drivers.errors import DriveFaultError, DriveStateError
from drivers.modbus.device import Value
from drivers.ports import DriveState, JobState

LET_GO, SELECT, START, ABORT = 0, 1, 2, 3
AUTOMATIC_MODES = (3, 4)
MODES = {
    1: "MANUAL_REDUCED_SPEED",
    2: "MANUAL_HIGH_SPEED",
    3: "AUTOMATIC",
    4: "AUTOMATIC_EXTERNAL",
}
STOPS = {1: "EmergencyStop", 2: "ProtectiveStop"}
STATES = {
    0: JobState.IDLE,
    1: JobState.READY,
    2: JobState.RUNNING,
    3: JobState.DONE,
    4: JobState.ABORTED,
    5: JobState.FAULT,
}
PHASES = ("", "approach", "ramp", "steady", "rest", "return")
ERRORS = {
    1: "it missed the agent's alive count",
    2: "the agent asked for it",
    3: "it does not accept the parameters",
    4: "for a reason of its own",
}
STATUS = (
    "controller_alive",
    "job_state",
    "job_error",
    "operating_mode",
    "stops",
    "selected_axis",
    "progress",
    "phase",
    "sample_number",
    "sample_period",
    "sample_time",
    "position",
    "velocity",
    "torque",
    "gearbox_temperature",
)
DRIVE_STATES: Mapping[JobState | None, DriveState] = {
    JobState.RUNNING: DriveState.ON,
    JobState.FAULT: DriveState.FAULT,
}


def state_of(read: Mapping[str, Value]) -> JobState | None:
    """Return what the job program says of itself; None for a number that means nothing."""
    return STATES.get(read["job_state"].whole)


def why(read: Mapping[str, Value]) -> str:
    """Return why the job was aborted, or is in fault, in words."""
    code = read["job_error"].whole
    return ERRORS.get(code, "it gives no reason" if code == 0 else f"error {code}")


def refuse_stopped(read: Mapping[str, Value]) -> None:
    """Refuse a controller that is stopped, or not in an automatic mode.

    Raises
    ------
    DriveStateError
        With the reason.
    """
    mode, stops = read["operating_mode"].whole, read["stops"].whole
    active = [name for bit, name in STOPS.items() if stops & bit]
    if active:
        raise DriveStateError(
            f"The controller reports {' and '.join(active)}.",
            "Find out why, and clear it at the controller.",
        )
    if mode not in AUTOMATIC_MODES:
        raise DriveStateError(
            f"The controller is in {MODES.get(mode, f'unknown mode {mode}')}; the stair is a "
            "job for automatic mode.",
            "Switch it to automatic, with the guards closed.",
        )


def refuse_unready(read: Mapping[str, Value]) -> None:
    """Refuse a controller that cannot begin a job now.

    Raises
    ------
    DriveFaultError, DriveStateError
        With the reason.
    """
    refuse_stopped(read)
    state = state_of(read)
    if state is JobState.FAULT:
        raise DriveFaultError(
            f"The controller's job program is in fault: {why(read)}.",
            "A person must find the cause and clear it at the controller.",
        )
    # Aborted or done is what an agent leaves that was killed: nobody drives, so it is let go.
    if state not in (JobState.IDLE, JobState.ABORTED, JobState.DONE):
        raise DriveStateError(
            "The controller already has an axis selected for a job.",
            "Another program may be driving it: end that first.",
        )
