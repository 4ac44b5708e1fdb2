"""What can go wrong with a device or a bus: one tree, each leaf saying what to do now.

::

    DriverError                     exit code 4
    |-- BusError                    the bus cannot be opened, or has stopped working
    |   |-- BusOverflowError        frames came faster than they were taken away
    |   `-- WorkerDiedError         the bus's owner thread has ended
    |-- NodeMissingError            nobody answers under this node id
    |-- AnswerError                 an answer came, and cannot be used (refused, garbled, checksum)
    |-- SdoError                    an object could not be read or written (abort code, time-out)
    |-- IdentityError               another device than the one that the cell describes
    |-- ConfigurationError          something that was set does not read back as set
    |-- DriveFaultError             the drive reports a fault or sent an EMCY
    |-- DriveStateError             the drive did not reach a state in time, or left it unasked
    |-- HeartbeatLostError          the node's heartbeat has stopped
    |-- SyncUnansweredError         the node no longer answers SYNC
    |-- IntruderError               somebody else sends what only the agent may
    |-- JointSinksError             the joint moves since its torque was taken away
    `-- RecordingEndedError         a recording that is played has no more samples
"""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from drivers.evidence import SyncAccount


_NUMBER = re.compile(r"\[Errno -?\d+\] ")
_PRINTED = re.compile(r"\w+Error\(-?\d+, (['\"])(.+?)\.?\1[^)]*\)")
"""An error as Python prints one: ``FileNotFoundError(2, 'The ... specified.', None, 2)``."""


def why_unreadable(error: OSError | UnicodeDecodeError) -> str:
    """Return why a file that somebody named cannot be read, without name, number or codec."""
    if isinstance(error, UnicodeDecodeError):
        return "it is not text in UTF-8"
    return error.strerror or str(error)


def words_of(error: BaseException) -> str:
    """Return a library's own words for its error, without a full stop and never empty.

    The system's numbers are left out, and what pyserial prints of the error behind its own.
    """
    words = _PRINTED.sub(r"\2", _NUMBER.sub("", str(error))).strip().rstrip(".")
    return words or type(error).__name__


def terminal_errors() -> tuple[type[Exception], ...]:
    """Return the error of a terminal's settings; it is no OSError, and pyserial lets it through."""
    if sys.platform == "win32":
        return ()
    import termios

    return (termios.error,)


class DriverError(Exception):
    """Root of all device and bus errors.

    Parameters
    ----------
    what : str
        What happened, where, in one sentence.
    do : str, optional
        What a technician should do now, in one sentence.
    """

    retryable = False

    def __init__(self, what: str, do: str = "") -> None:
        super().__init__(f"{what} {do}".strip())
        self.what = what
        self.do = do


class BusError(DriverError):
    """The bus cannot be opened, or has stopped working."""

    retryable = True


class BusOverflowError(BusError):
    """Frames came faster than they were taken away; some are lost."""


class WorkerDiedError(BusError):
    """The thread that owns the bus has ended."""


class NodeMissingError(DriverError):
    """Nobody answers under this node id."""

    retryable = True


class AnswerError(DriverError):
    """A device answered, and the answer cannot be used: refused, garbled, of the wrong length.

    `exception_code` is the Modbus exception, or None where the answer itself is broken.
    """

    def __init__(self, what: str, do: str = "", exception_code: int | None = None) -> None:
        super().__init__(what, do)
        self.exception_code = exception_code


class SdoError(DriverError):
    """An object could not be read or written.

    `abort_code` is CiA 301's code, or None for a time-out.
    """

    def __init__(self, what: str, do: str = "", abort_code: int | None = None) -> None:
        super().__init__(what, do)
        self.abort_code = abort_code


class IdentityError(DriverError):
    """The device on the bus is not the one that the cell describes."""


class ConfigurationError(DriverError):
    """Something that was set does not read back as it was set."""


class DriveFaultError(DriverError):
    """The drive reports a fault or sent an emergency message.

    `error_code` is the EMCY or 0x603F code.
    """

    def __init__(self, what: str, do: str = "", error_code: int = 0) -> None:
        super().__init__(what, do)
        self.error_code = error_code


class DriveStateError(DriverError):
    """The drive did not reach a state in time, or left it unasked."""


class HeartbeatLostError(DriverError):
    """The node's heartbeat has stopped."""


class SyncUnansweredError(DriverError):
    """The node no longer answers SYNC."""


class IntruderError(DriverError):
    """Somebody else on the bus sends what only the agent may: heartbeat, order, SYNC, setting."""


class JointSinksError(DriverError):
    """The joint moves since its torque was taken away: nothing holds it, least of all the agent.

    Everything else that belongs to the end has been done, and `account` is what it would have
    returned. Whatever could not be restored is the cause of this error.
    """

    def __init__(self, node_id: int, velocity_rad_s: float, account: SyncAccount) -> None:
        super().__init__(
            f"The joint of node {node_id} moves at {velocity_rad_s:.1f} rad/s since its torque was "
            "taken away.",
            "Keep clear of it, support the arm, and have its brake looked after.",
        )
        self.account = account


class RecordingEndedError(DriverError):
    """A recording that is played as an axis has no more samples, and motion is still asked for."""
