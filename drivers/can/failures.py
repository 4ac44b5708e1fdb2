"""python-can's ways to fail, mapped once to ours, each with what a technician should do now.

::

    NotImplementedError (also as CanError), ImportError  this adapter's software is not there
    NameError                                      the same of Kvaser's, whose functions are missing
    OSError ENODEV / ENETDOWN / EAFNOSUPPORT ...   the operating system's side of SocketCAN
    CanInitializationError, ValueError, TypeError  the adapter refuses what the cell asks for
    CanOperationError, CanTimeoutError, OSError    the bus has stopped working
    AdapterError (ours, see drivers.can.slcan)     the adapter refuses, hangs, lies or is gone
"""

from __future__ import annotations

import errno

import can

from drivers.errors import BusError, words_of

OPENING_FAILURES: tuple[type[Exception], ...] = (
    can.CanError,
    OSError,
    ImportError,
    NameError,
    RuntimeError,
    ValueError,
    TypeError,
)
"""What `can.Bus(...)` may raise.

`RuntimeError` covers the bare `NotImplementedError` for an interface that does not exist; the two
last stand for options that an adapter does not take.
"""

WORKING_FAILURES: tuple[type[Exception], ...] = (can.CanError, OSError, ValueError)
"""What `send` and `recv` may raise on a bus that was opened."""


class AdapterError(can.CanOperationError):
    """An adapter that python-can would let fail in silence, in our words: what, and what to do."""

    def __init__(self, what: str, do: str) -> None:
        super().__init__(what)
        self.what = what
        self.do = do


def opening_failed(
    error: Exception, interface: str, channel: str | int | None, bitrate: int | None
) -> BusError:
    """Return the one sentence for a bus that does not open.

    Parameters
    ----------
    error : Exception
        One of `OPENING_FAILURES`.
    interface, channel, bitrate
        As the cell describes the bus.
    """
    name = bus_name(interface, channel)
    if isinstance(error, AdapterError):
        return BusError(f"The CAN adapter {name} {error.what} while it is opened.", error.do)
    if isinstance(error, (NotImplementedError, ImportError, NameError)):
        return BusError(
            f"The CAN interface {interface!r} is not available here: {words_of(error)}.",
            "Check its name, and install the adapter's driver and Python package.",
        )
    code = _errno_of(error)
    if interface == "socketcan" and code is not None:
        told = _socketcan_advice(code, channel, bitrate)
        if told is not None:
            return BusError(*told)
    return BusError(
        f"The CAN bus {name} cannot be opened: {words_of(error)}.",
        "Check interface, channel, bitrate and options of the bus in the cell description, "
        "and that no other program holds the adapter.",
    )


def working_failed(error: Exception, name: str, doing: str) -> BusError:
    """Return the one sentence for a bus that stopped working while `doing` something."""
    if isinstance(error, AdapterError):
        return BusError(f"The CAN adapter {name} {error.what} while {doing}.", error.do)
    code = _errno_of(error)
    if code == errno.ENETDOWN or code == errno.ENODEV:
        return BusError(
            f"The CAN interface {name} went down while {doing}.",
            "Bring it up again and look at the adapter and its cable.",
        )
    if code == errno.ENOBUFS:
        return BusError(
            f"The transmit buffer of {name} is full while {doing}: nobody acknowledges our frames.",
            "Check bitrate, wiring, termination and that the drive has power.",
        )
    return BusError(
        f"The CAN bus {name} failed while {doing}: {words_of(error)}.",
        "Check the adapter, wiring and termination, then start again.",
    )


def bus_name(interface: str, channel: str | int | None) -> str:
    """Return how messages call a bus, for example ``socketcan:can0``."""
    return interface if channel is None else f"{interface}:{channel}"


def _socketcan_advice(
    code: int, channel: str | int | None, bitrate: int | None
) -> tuple[str, str] | None:
    """Return (what, do) for the operating system's usual refusals of SocketCAN."""
    up = f"ip link set {channel} up type can bitrate {bitrate or 1_000_000}"
    if str(channel).startswith("vcan"):
        up = f"ip link add dev {channel} type vcan && ip link set {channel} up"
    if code == errno.ENODEV:
        return f"There is no CAN interface {channel}.", f"Is it plugged in and up? `{up}`"
    if code == errno.ENETDOWN:
        return f"The CAN interface {channel} is down.", f"Bring it up: `{up}`"
    if code == errno.EAFNOSUPPORT:
        return (
            "This kernel has no SocketCAN.",
            "Load it (`modprobe can_raw vcan`) or use another interface.",
        )
    if code in (errno.EPERM, errno.EACCES):
        return (
            f"No permission to open the CAN interface {channel}.",
            "Give this user the right to open raw CAN sockets (CAP_NET_RAW).",
        )
    return None


def _errno_of(error: BaseException | None) -> int | None:
    """Return the operating system's error number, also from an error's cause."""
    while error is not None:
        number = getattr(error, "errno", None) or getattr(error, "error_code", None)
        if isinstance(number, int):
            return number
        error = error.__cause__
    return None
