"""One owner per CAN bus: it alone opens, sends, receives, stamps, routes, and lets go.

Frames come in one of three ways, and the control tick reads them from inboxes in each:

* a process of its own (`ReaderProcess`): SocketCAN on Linux, in real time. The kernel stamps, and
  counts what it drops; `poll` and `wait` take what the process has put into shared memory.
* a thread (python-can): any other adapter or platform, in real time. It receives, stamps with the
  injected clock and routes; it does nothing else.
* stepped (`SteppedClock`): after each send and on `poll` devices settle and the bus is drained.

Sending is python-can's, and for the control tick's thread alone. There is no cyclic sending here
and none may be added: a cyclic task of the kernel or the library goes on while the agent hangs,
and the drive's watchdog would be fed by nobody's decision.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterable

import can

from drivers.can.failures import WORKING_FAILURES, bus_name, working_failed
from drivers.can.frames import BusCounts, CanBusConfig, Frame, Inbox, Reception
from drivers.can.opening import may_read_fast, open_bus
from drivers.can.reader_process import ReaderProcess
from drivers.can.routing import Routing
from drivers.clock import Clock, SteppedClock
from drivers.errors import BusError, BusOverflowError, WorkerDiedError

__all__ = ["BusCounts", "CanBusConfig", "CanBusOwner", "Frame", "Inbox", "Reception"]

_RECEIVE_TIMEOUT_S = 0.01
"""How long the owner thread waits for a frame before it looks whether it should end."""

_WAIT_S = 0.0005
"""How far time moves between two looks while somebody waits for a frame and no thread receives."""

_WAITED_S = 0.0002
"""A `recv` that took so long has waited, so before it nothing was left to be taken."""

_LISTENING_LAG_S = 0.25
"""The most by which "heard until" may trail: a receiver that is further behind has failed."""


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
    reader : ReaderProcess, optional
        Receives in place of a thread.
    """

    def __init__(
        self, bus: can.BusABC, clock: Clock, name: str, reader: ReaderProcess | None = None
    ) -> None:
        self.name = name
        self._bus = bus
        self._clock = clock
        self._stepped = isinstance(clock, SteppedClock)
        self._reader = reader
        threaded = not self._stepped and reader is None
        self._routing = Routing(name, wakes=threaded)
        self.counts = self._routing.counts
        self.claims = self._routing.claims
        self._reception = Reception("stepped" if self._stepped else "thread")
        self._heard_s = clock.now()
        self._closing = threading.Event()
        self._death: BusError | None = None
        self._thread: threading.Thread | None = None
        if threaded:
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
        bus = open_bus(config)
        name = bus_name(config.interface, config.channel)
        receiver = getattr(bus, "socket", None)
        if not may_read_fast(config, clock) or not isinstance(receiver, socket.socket):
            return cls(bus, clock, name)
        try:
            return cls(bus, clock, name, ReaderProcess.start(receiver, clock, name))
        except BaseException:
            bus.shutdown()
            raise

    def subscribe(self, cob_ids: Iterable[int], limit: int = 4096) -> Inbox:
        """Return an inbox that gets every frame with one of `cob_ids` from now on.

        Raises
        ------
        BusError
            When another reader already has one of these ids.
        """
        return self._routing.subscribe(cob_ids, limit)

    def unsubscribe(self, inbox: Inbox) -> None:
        """Let go of an inbox; nothing happens when it was let go before."""
        self._routing.unsubscribe(inbox)

    def post(self, cob_id: int, data: bytes) -> None:
        """Put one frame on the bus; devices on a stepped clock do not yet see it.

        Raises
        ------
        BusError
            When the bus is closed, down, or does not take the frame.
        """
        if self._closing.is_set():
            raise BusError(f"The CAN bus {self.name} is closed.")
        self._routing.claims.sent(cob_id, data)
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
        """Take in what waits, after the devices have settled; a thread does that by itself."""
        if self._closing.is_set():
            return
        if self._stepped:
            self._clock.settle()
            self._drain()
        elif self._reader is not None:
            self._take(self._reader)
        elif self._thread is None:
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
            When the receiver has ended or an inbox has overflowed.
        """
        if self._thread is None and not self._stepped:
            self.poll()
        while not inbox.frames:
            now_s = self._clock.now()
            if now_s >= deadline_s:
                return False
            if self._thread is None:
                self._clock.sleep_until(min(deadline_s, now_s + _WAIT_S))
                if self._reader is not None:
                    self.check()
                    self._take(self._reader)
                else:
                    self._drain()
            else:
                self.check()
                inbox.arrived.clear()
                if not inbox.frames:
                    inbox.arrived.wait(min(deadline_s - now_s, _RECEIVE_TIMEOUT_S))
        return True

    @property
    def heard_until_s(self) -> float:
        """Return until when everything that came is in the inboxes after the next `poll`.

        What is asked for later than this may have been answered already: on a busy computer the
        answer may wait for a receiver that does not get the processor. Silence is only silence
        before this time.
        """
        if self._stepped or (self._reader is None and self._thread is None):
            return self._clock.now()  # `poll` itself listens
        heard_s = self._heard_s if self._reader is None else self._reader.heard_until_s
        return max(heard_s, self._clock.now() - _LISTENING_LAG_S)

    def reception(self) -> Reception:
        """Return how frames are received, and how many the kernel has dropped so far."""
        if self._reader is not None:
            return Reception("process", self._reader.dropped, self._reader.buffer_bytes, "kernel")
        return self._reception

    def check(self) -> None:
        """Raise what has gone wrong with this bus since it was opened, if anything has.

        Raises
        ------
        WorkerDiedError
            The owner thread, or the reader process, has ended or hangs.
        BusOverflowError
            An inbox, or the ring, was full when a frame came; it says so until the bus is closed.
        """
        if self._reader is not None:
            self._reader.check()
        if self._thread is not None and not self._thread.is_alive() and not self._closing.is_set():
            if self._death is not None:
                raise WorkerDiedError(self._death.what, self._death.do) from self._death
            raise WorkerDiedError(
                f"The thread that owns the CAN bus {self.name} has ended.",
                "Check the adapter, then start again.",
            )
        self._routing.check()

    def receive_without_help(self, *, suspected: bool = False) -> bool:
        """Let `poll` and `wait` receive by themselves from now on if the helper has died.

        For bringing a joint to rest after the reader process or the owner thread is lost: what is
        left of the bus may still show the standstill. Frames are stamped when they are taken; what
        the dead reader had not handed over is gone.

        Parameters
        ----------
        suspected : bool
            Whether to do without a reader process that lives, too: nothing comes from it, and there
            is no time to wait until it is known to hang.

        Returns
        -------
        bool
            Whether the helper was given up.
        """
        died = self._reader is not None and self._reader.has_ended
        try:
            self.check()
        except WorkerDiedError:
            died = True
        except BusOverflowError:
            pass  # whoever overflows, lives
        if not died and not (suspected and self._reader is not None):
            return False
        self._reception = self.reception()
        reader, self._reader, self._thread = self._reader, None, None
        if reader is not None:
            reader.close(at_once=True)  # a joint is to be stopped
        return True

    def close(self) -> None:
        """End the thread and shut the bus; may be repeated."""
        if self._closing.is_set():
            return
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        try:
            if self._reader is not None:
                self._reader.close()
        finally:
            self._bus.shutdown()

    def _own(self) -> None:
        """Receive, stamp and route until told to end: the owner thread's whole life."""
        try:
            while not self._closing.is_set():
                before_s = self._clock.now()
                message = self._bus.recv(_RECEIVE_TIMEOUT_S)
                now_s = self._clock.now()
                if message is not None:
                    self._routing.message(message, now_s)
                if message is None or now_s - before_s > _WAITED_S:
                    self._heard_s = before_s
        except WORKING_FAILURES as error:
            self._death = working_failed(error, self.name, "receiving")

    def _drain(self) -> None:
        """Take every frame that waits on the bus, stamped with the present time."""
        now_s = self._clock.now()
        try:
            while (message := self._bus.recv(0.0)) is not None:
                self._routing.message(message, now_s)
        except WORKING_FAILURES as error:
            raise working_failed(error, self.name, "receiving") from error

    def _take(self, reader: ReaderProcess) -> None:
        """Route what the reader process has put into the ring."""
        reader.hand_over(self._routing.slots)
