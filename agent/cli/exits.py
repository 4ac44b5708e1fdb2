"""The one table from errors to exit codes (contract section 5)."""

from __future__ import annotations

from agent.errors import AgentError, InputError, RefusedError, StoppedError, StorageError
from drivers.errors import DriverError
from trajectories import TrajectoryError

DONE = 0
BAD_NEWS = 1
USAGE = 2
BAD_INPUT = 3
DEVICE = 4
SAFETY = 5
OUR_FAULT = 70

EXIT_CODES: tuple[tuple[type[BaseException], int], ...] = (
    (RefusedError, SAFETY),
    (StoppedError, SAFETY),
    (InputError, BAD_INPUT),
    (StorageError, BAD_INPUT),
    (TrajectoryError, BAD_INPUT),
    (AgentError, OUR_FAULT),
    (DriverError, DEVICE),
)


def exit_code(error: BaseException) -> int:
    """Return the exit code for an error; what the table does not know is our own fault."""
    for kind, code in EXIT_CODES:
        if isinstance(error, kind):
            return code
    return OUR_FAULT
