"""The one table from errors to exit codes (contract section 5)."""

from __future__ import annotations

import errno
import re

from agent.errors import (
    AgentError,
    InputError,
    RefusedError,
    StoppedError,
    StorageError,
    UsageError,
)
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
        errno.EIO,
    }
)
"""Of a file: rights, kind, name, links, room, medium. Who named it can do something about it."""
NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""Never the program's fault; standard output, which has no name, meets it, too."""

EXIT_CODES: tuple[tuple[type[BaseException], int], ...] = (
    (RefusedError, SAFETY),
    (StoppedError, SAFETY),
    (UsageError, USAGE),
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
    theirs = refused_by_the_system(error) or _is_no_text(error)
    return BAD_INPUT if theirs else OUR_FAULT


def sentence(error: BaseException) -> str:
    """Return what an error says to a user; the system's own refusals without their number."""
    if isinstance(error, OSError) and refused_by_the_system(error):
        where = error.filename if error.filename is not None else "The output cannot be written"
        return f"{where}: {error.strerror}."
    if isinstance(error, UnicodeEncodeError) and _is_no_text(error):
        return f"{error.object!r} is no text in this system's encoding. Give the file another name."
    said = str(error)
    if isinstance(error, TrajectoryError) and said:  # written as part of one, and without a file
        return f"{said[0].upper()}{said[1:].removesuffix('.')}."
    return said


def refused_by_the_system(error: BaseException) -> bool:
    """Tell whether the operating system refuses a file that somebody named, or has no room."""
    if not isinstance(error, OSError):
        return False
    return error.errno in (NO_ROOM if error.filename is None else THE_SYSTEM_REFUSES)


def _is_no_text(error: BaseException) -> bool:
    """Tell whether a name that came from outside holds bytes that are no text."""
    surrogate = r"[\udc80-\udcff]"  # Python's stand-in for a byte that it cannot decode
    return isinstance(error, UnicodeEncodeError) and bool(re.search(surrogate, error.object))
