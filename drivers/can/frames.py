"""What a bus is, what comes from it, where it waits, and how much of it there was."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple


@dataclass(frozen=True)
class CanBusConfig:
    """How to open a bus, in python-can's words.

    Parameters
    ----------
    interface : str
        ``socketcan``, ``udp_multicast``, ``virtual``, ``slcan`` or a vendor's adapter.
    channel : str, int or None
        ``can0``, a multicast group, a serial port ...; None takes the adapter's default.
    bitrate : int or None
        Bit/s; None leaves it to the interface (SocketCAN has it set by ``ip link``).
    options : mapping
        Passed on to the adapter as they are.
    fast_reader : bool
        Whether a process of its own may receive where that is possible (SocketCAN on Linux).
    """

    interface: str
    channel: str | int | None = None
    bitrate: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    fast_reader: bool = True

    def __post_init__(self) -> None:
        if not self.interface:
            raise ValueError("a CAN bus needs the name of its interface, got an empty one")
        if self.bitrate is not None and self.bitrate <= 0:
            raise ValueError(f"bitrate must be positive, got {self.bitrate} bit/s")


class Frame(NamedTuple):
    """One data frame as it came from the bus."""

    stamp_s: float  # when it came (kernel), or was taken from the bus; on the injected clock
    cob_id: int
    data: bytes
    bus_stamp_s: float  # the adapter's own stamp: wall clock or adapter time, a label only


class Inbox:
    """A bounded queue of frames for one reader; `frames` is read with `popleft`."""

    __slots__ = ("arrived", "cob_ids", "frames", "limit", "overflowed")

    def __init__(self, cob_ids: frozenset[int], limit: int) -> None:
        self.cob_ids = cob_ids
        self.limit = limit
        self.frames: deque[Frame] = deque()
        self.arrived = threading.Event()
        self.overflowed = 0


@dataclass
class BusCounts:
    """What became of the frames that were received."""

    routed: int = 0
    unrouted: int = 0  # nobody asked for this id
    own_echoes: int = 0  # ids that only we send, handed back by the interface
    extended: int = 0  # 29-bit ids: not CANopen
    error_frames: int = 0
    remote_frames: int = 0
    malformed: int = 0  # no classic CAN frame
    restamped: int = 0  # the kernel's stamp could not be true


@dataclass(frozen=True)
class Reception:
    """How frames are received, and what was lost before anybody could count it.

    Parameters
    ----------
    reader : str
        "process" (recvmmsg in a process of its own), "thread" (python-can), "stepped".
    dropped_by_kernel : int or None
        Frames that the kernel threw away because the socket's buffer was full; None where the
        interface cannot tell.
    receive_buffer_bytes : int or None
        What the kernel granted for that buffer; None where nobody asked.
    stamps : str
        "kernel" or "host": who stamps a frame.
    """

    reader: str
    dropped_by_kernel: int | None = None
    receive_buffer_bytes: int | None = None
    stamps: str = "host"
