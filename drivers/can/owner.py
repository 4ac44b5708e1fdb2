"""One owner per CAN bus: it alone opens, sends, receives, stamps, routes, and lets go.

Real time: one thread receives, stamps with the injected clock and puts each frame into the inbox
that asked for its id; it does nothing else. Stepped (`SteppedClock`): no thread; after each send
and on `poll` the devices settle and the bus is drained. Either way the control tick reads inboxes.

Sending is for the control tick's thread alone. There is no cyclic sending here and none may be
added: a cyclic task of the kernel or the library goes on while the agent hangs, and the drive's
watchdog would be fed by nobody's decision.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import can

from drivers.can.failures import (
    OPENING_FAILURES,
    WORKING_FAILURES,
    bus_name,
    opening_failed,
    working_failed,
)
from drivers.clock import Clock, SteppedClock
from drivers.errors import BusError, BusOverflowError, WorkerDiedError

_RECEIVE_TIMEOUT_S = 0.05
"""How long the owner thread waits for a frame before it looks whether it should end."""

_STEPPED_WAIT_S = 0.0005
"""How far simulated time moves while somebody waits for a frame."""


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
    """

    interface: str
    channel: str | int | None = None
    bitrate: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.interface:
            raise ValueError("a CAN bus needs the name of its interface, got an empty one")
        if self.bitrate is not None and self.bitrate <= 0:
            raise ValueError(f"bitrate must be positive, got {self.bitrate} bit/s")


class Frame(NamedTuple):
    """One data frame as it came from the bus."""

    stamp_s: float  # when it was taken from the bus, on the injected clock
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


class CanBusOwner:
    """The one object that touches a `can.BusABC`; make it with `open`.

    Parameters
    ----------
    bus : can.BusABC
        Opened; from now on nobody else may use it.
    clock : Clock
        Stamps frames. A `SteppedClock` selects the mode without a thread.
    name : str
        What messages call this bus.
    """

    def __init__(self, bus: can.BusABC, clock: Clock, name: str) -> None:
        self.name = name
        self.counts = BusCounts()
        self._bus = bus
        self._clock = clock
        self._stepped = isinstance(clock, SteppedClock)
        self._routes: dict[int, Inbox] = {}
        self._inboxes: list[Inbox] = []
        self._sent_ids: set[int] = set()
        self._closing = threading.Event()
        self._death: Exception | None = None
        self._thread: threading.Thread | None = None
        if not self._stepped:
            self._thread = threading.Thread(target=self._own, name=f"can-owner {name}", daemon=True)
            self._thread.start()

    @classmethod
    def open(cls, config: CanBusConfig, clock: Clock) -> CanBusOwner:
        """Open the bus and begin to receive.

        Raises
        ------
        BusError
            In one sentence why it does not open, and what to do.
        """
        arguments: dict[str, Any] = dict(config.options)
        if config.interface == "udp_multicast":
            # What moves a machine does not leave this computer unless the cell says so.
            arguments.setdefault("hop_limit", 0)
        if config.bitrate is not None:
            arguments["bitrate"] = config.bitrate
        try:
            bus = can.Bus(
                interface=config.interface,
                channel=config.channel,
                ignore_config=True,
                **arguments,
            )
        except OPENING_FAILURES as error:
            raise opening_failed(error, config.interface, config.channel, config.bitrate) from error
        return cls(bus, clock, bus_name(config.interface, config.channel))

    def subscribe(self, cob_ids: Iterable[int], limit: int = 4096) -> Inbox:
        """Return an inbox that gets every frame with one of `cob_ids` from now on.

        Raises
        ------
        BusError
            When another reader already has one of these ids.
        """
        inbox = Inbox(frozenset(cob_ids), limit)
        taken = inbox.cob_ids & self._routes.keys()
        if taken:
            listed = ", ".join(f"0x{cob_id:03X}" for cob_id in sorted(taken))
            raise BusError(
                f"On {self.name} the identifiers {listed} already have a reader.",
                "Two axes must not share a node id.",
            )
        # A new table each time: the owner thread reads it without a lock.
        self._routes = {**self._routes, **dict.fromkeys(inbox.cob_ids, inbox)}
        self._inboxes.append(inbox)
        return inbox

    def unsubscribe(self, inbox: Inbox) -> None:
        """Let go of an inbox; nothing happens when it was let go before."""
        if inbox in self._inboxes:
            self._inboxes.remove(inbox)
            self._routes = {k: v for k, v in self._routes.items() if v is not inbox}

    def post(self, cob_id: int, data: bytes) -> None:
        """Put one frame on the bus; devices on a stepped clock do not yet see it.

        Raises
        ------
        BusError
            When the bus is closed, down, or does not take the frame.
        """
        if self._closing.is_set():
            raise BusError(f"The CAN bus {self.name} is closed.")
        self._sent_ids.add(cob_id)
        message = can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)
        try:
            self._bus.send(message)
        except WORKING_FAILURES as error:
            raise working_failed(error, self.name, f"sending 0x{cob_id:03X}") from error

    def send(self, cob_id: int, data: bytes) -> None:
        """Put one frame on the bus and, when stepped, take in what it brought about."""
        self.post(cob_id, data)
        self.poll()

    def poll(self) -> None:
        """Take in what waits, after the devices have settled; in real time the thread does that."""
        if self._stepped and not self._closing.is_set():
            self._clock.settle()
            self._drain()

    def wait(self, inbox: Inbox, deadline_s: float) -> bool:
        """Wait until `inbox` holds a frame or the clock's `deadline_s` has passed.

        Returns
        -------
        bool
            Whether a frame is there.

        Raises
        ------
        BusError
            When the owner thread has ended or an inbox has overflowed.
        """
        while not inbox.frames:
            now_s = self._clock.now()
            if now_s >= deadline_s:
                return False
            if self._stepped:
                self._clock.sleep_until(min(deadline_s, now_s + _STEPPED_WAIT_S))
                self._drain()
            else:
                self.check()
                inbox.arrived.clear()
                if not inbox.frames:
                    inbox.arrived.wait(min(deadline_s - now_s, _RECEIVE_TIMEOUT_S))
        return True

    def check(self) -> None:
        """Raise what has gone wrong with this bus since it was opened, if anything has.

        Raises
        ------
        WorkerDiedError
            The owner thread has ended.
        BusOverflowError
            An inbox was full when a frame came; it says so until the bus is closed.
        """
        if self._thread is not None and not self._thread.is_alive() and not self._closing.is_set():
            why = f" ({self._death})" if self._death is not None else ""
            raise WorkerDiedError(
                f"The thread that owns the CAN bus {self.name} has ended{why}.",
                "Check the adapter, then start again.",
            ) from self._death
        for inbox in self._inboxes:
            if inbox.overflowed:
                raise BusOverflowError(
                    f"On {self.name} frames came faster than they were taken away: "
                    f"{inbox.overflowed} are lost beyond {inbox.limit} waiting ones.",
                    "Lower the sample rate or relieve the computer, then start again.",
                )

    def close(self) -> None:
        """End the thread and shut the bus; may be repeated."""
        if self._closing.is_set():
            return
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        self._bus.shutdown()

    def _own(self) -> None:
        """Receive, stamp and route until told to end: the owner thread's whole life."""
        try:
            while not self._closing.is_set():
                message = self._bus.recv(_RECEIVE_TIMEOUT_S)
                if message is not None:
                    self._route(message, self._clock.now())
        except WORKING_FAILURES as error:
            self._death = working_failed(error, self.name, "receiving")

    def _drain(self) -> None:
        """Take every frame that waits on the bus, stamped with the present simulated time."""
        now_s = self._clock.now()
        try:
            while (message := self._bus.recv(0.0)) is not None:
                self._route(message, now_s)
        except WORKING_FAILURES as error:
            raise working_failed(error, self.name, "receiving") from error

    def _route(self, message: can.Message, stamp_s: float) -> None:
        """Put one frame into its inbox, or count why it has none."""
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            self._count_odd(message)
            return
        cob_id = message.arbitration_id
        inbox = self._routes.get(cob_id)
        if inbox is None:
            if cob_id in self._sent_ids:
                self.counts.own_echoes += 1
            else:
                self.counts.unrouted += 1
            return
        if len(inbox.frames) >= inbox.limit:
            inbox.overflowed += 1
            return
        self.counts.routed += 1
        inbox.frames.append(Frame(stamp_s, cob_id, bytes(message.data), message.timestamp))
        if self._thread is not None:
            inbox.arrived.set()

    def _count_odd(self, message: can.Message) -> None:
        """Count a frame that is no CANopen data frame."""
        if message.is_error_frame:
            self.counts.error_frames += 1
        elif message.is_remote_frame:
            self.counts.remote_frames += 1
        else:
            self.counts.extended += 1
