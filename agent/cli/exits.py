"""The one table from errors to exit codes (contract section 5)."""

from __future__ import annotations

import errno

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

THE_SYSTEM_REFUSES = frozenset(
    {
        errno.EACCES,
        errno.EPERM,
        errno.EROFS,
        errno.ENOTDIR,
        errno.EISDIR,
        errno.EEXIST,
        errno.ENAMETOOLONG,
        errno.ELOOP,
        errno.ENOSPC,
        errno.EDQUOT,
        errno.EFBIG,
    }
)
"""Of a file: rights, kind, name, links, room. Whoever named the file can do something about it."""

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
    """Return the exit code for an error; what the table does not know is our own fault.

    All but one thing: a file that the operating system refuses, wherever it was opened.
    """
    for kind, code in EXIT_CODES:
        if isinstance(error, kind):
            return code
    return BAD_INPUT if refused_by_the_system(error) else OUR_FAULT


def sentence(error: BaseException) -> str:
    """Return what an error says to a user; the system's own refusals without their number."""
    if isinstance(error, OSError) and refused_by_the_system(error):
        return f"{error.filename}: {error.strerror}."
    return str(error)


def refused_by_the_system(error: BaseException) -> bool:
    """Tell whether the operating system refuses a file that somebody named."""
    return (
        isinstance(error, OSError)
        and error.filename is not None
        and error.errno in THE_SYSTEM_REFUSES
    )
