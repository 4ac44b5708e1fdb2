"""Drives beside the one under test: looked at, and never commanded, mapped or written.

Each is asked for its statusword and its position in turn, a few times a second, by SDO; its
emergencies and heartbeats are listened to. Nothing here waits: a request goes out in one tick, and
its answer is found in a later one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from drivers.can.owner import CanBusOwner
from drivers.cia402 import objects
from drivers.cia402.objects import TYPES, DriveObject
from drivers.cia402.words import State, error_words, state_of
from drivers.clock import Clock
from drivers.errors import (
    ConfigurationError,
    DriveFaultError,
    DriverError,
    DriveStateError,
    NodeMissingError,
)
from drivers.ports import Axis, AxisEvidence, Command, Sample, StopReport, SyncAccount

_ASKED = (objects.STATUSWORD, objects.POSITION)
_BOOT_UP = 0x00
_UPLOAD, _ABORT = 0x40, 0x80
_IN_FAULT = (State.FAULT, State.FAULT_REACTION)
_OPEN_POLL_S = 0.002


@dataclass(frozen=True)
class WatchedConfig:
    """One drive to be watched.

    Parameters
    ----------
    node_id : int
        Its CANopen node.
    name : str
        What messages call it, as "axis 2".
    motion_max_counts : float
        How far its position may go from where it was found.
    period_s : float
        Between two requests.
    answer_timeout_s : float
        For each request.
    unanswered_max : int
        More requests in a row than this, and it has vanished.
    """

    node_id: int
    name: str
    motion_max_counts: float
    period_s: float = 0.05
    answer_timeout_s: float = 0.1
    unanswered_max: int = 2

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= 127:
            raise ValueError(f"node_id must be 1 to 127, got {self.node_id}")
        for what in ("motion_max_counts", "period_s", "answer_timeout_s"):
            value = getattr(self, what)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{what} must be positive and finite, got {value}")

    @property
    def silence_s(self) -> float:
        """Return how long it may have been gone before that is told."""
        return (self.unanswered_max + 1) * (self.answer_timeout_s + self.period_s)


class WatchedDrive:
    """One drive that is watched.

    Attributes
    ----------
    failure : DriverError or None
        The first reason to stop; it stays.
    """

    def __init__(self, owner: CanBusOwner, clock: Clock, config: WatchedConfig) -> None:
        node = config.node_id
        self.config = config
        self.failure: DriverError | None = None
        self._owner = owner
        self._clock = clock
        self._inbox = owner.subscribe((0x080 + node, 0x580 + node, 0x700 + node))
        self._next = 0  # of _ASKED
        self._asked: DriveObject | None = None
        self._asked_s = -math.inf
        self._unanswered = 0
        self._seen: dict[DriveObject, int] = {}
        self._found_counts: int | None = None

    @property
    def is_known(self) -> bool:
        """Return whether it has said both its state and its position."""
        return len(self._seen) == len(_ASKED)

    def look(self) -> DriverError | None:
        """Take in what has come, ask anew when it is time; return the reason to stop, if any.

        The owner must have been polled in this tick.
        """
        frames = self._inbox.frames
        while frames:
            frame = frames.popleft()
            self._hear(frame.cob_id - self.config.node_id, frame.data)
        now_s = self._clock.now()
        if self._asked is not None and now_s - self._asked_s > self.config.answer_timeout_s:
            self._asked = None
            self._unanswered += 1
            if self._unanswered > self.config.unanswered_max:
                self._fail(
                    NodeMissingError(
                        f"The watched {self._who} has left {self._unanswered} requests in a row "
                        "unanswered.",
                        "Check its power and the cable.",
                    )
                )
        if self._asked is None and now_s - self._asked_s >= self.config.period_s:
            self._ask(now_s)
        return self.failure

    def release(self) -> None:
        """Stop listening; may be repeated."""
        self._owner.unsubscribe(self._inbox)

    @property
    def _who(self) -> str:
        return f"{self.config.name} (node {self.config.node_id})"

    def _fail(self, error: DriverError) -> None:
        if self.failure is None:
            self.failure = error

    def _ask(self, now_s: float) -> None:
        item = _ASKED[self._next]
        self._next = (self._next + 1) % len(_ASKED)
        request = bytes([_UPLOAD]) + item.index.to_bytes(2, "little") + bytes([item.subindex])
        self._asked, self._asked_s = item, now_s
        self._owner.post(0x600 + self.config.node_id, request.ljust(8, b"\0"))

    def _hear(self, service: int, data: bytes) -> None:
        if service == 0x080:
            code = int.from_bytes(data[:2], "little")
            if code & 0xFF00:
                self._fail(
                    DriveFaultError(
                        f"The watched {self._who} sent the emergency {error_words(code)}.",
                        "A person must find the cause at that drive.",
                        error_code=code,
                    )
                )
        elif service == 0x700:
            if data[:1] == bytes([_BOOT_UP]) and self._seen:  # before that it merely came late
                self._fail(
                    DriveStateError(
                        f"The watched {self._who} has restarted.", "Look for a power cut."
                    )
                )
        elif len(data) == 8:
            self._answered(data)

    def _answered(self, data: bytes) -> None:
        """Take an expedited answer to what was asked; anybody else's is left alone."""
        item = self._asked
        if item is None or data[1:4] != item.index.to_bytes(2, "little") + bytes([item.subindex]):
            return
        self._asked, self._unanswered = None, 0
        if data[0] == _ABORT:
            self._fail(
                ConfigurationError(
                    f"The watched {self._who} has no {item}.", "Check that it is a CiA 402 drive."
                )
            )
        elif data[0] & 0xE0 == _UPLOAD:
            self._judge(item, int(TYPES[item.kind].unpack_from(data, 4)[0]))

    def _judge(self, item: DriveObject, value: int) -> None:
        self._seen[item] = value
        if item is objects.STATUSWORD:
            if state_of(value) in _IN_FAULT:
                self._fail(
                    DriveFaultError(
                        f"The watched {self._who} is in fault (statusword 0x{value:04X}).",
                        "A person must find the cause at that drive.",
                    )
                )
            return
        if self._found_counts is None:
            self._found_counts = value
        # The counts wrap around at 32 bits; a way is the shorter one.
        way = (value - self._found_counts + 2**31) % 2**32 - 2**31
        if abs(way) > self.config.motion_max_counts:
            self._fail(
                DriveStateError(
                    f"The watched {self._who} has moved by {way} counts; "
                    f"{self.config.motion_max_counts:.0f} are allowed.",
                    "Only the axis under test may move: see what drives this one.",
                )
            )


class WatchedAxes:
    """The port `Axis`, with other drives on its bus watched: any of them ends the cycle.

    Parameters
    ----------
    axis : Axis
        The one under test; it alone is opened.
    owner : CanBusOwner
        The bus of all of them.
    clock : Clock
        The one that the owner stamps with.
    watched : sequence of WatchedConfig
        The others.
    """

    def __init__(
        self, axis: Axis, owner: CanBusOwner, clock: Clock, watched: Sequence[WatchedConfig]
    ) -> None:
        self._axis = axis
        self._owner = owner
        self._clock = clock
        self._kept: tuple[Sample, ...] = ()
        self._drives = tuple(WatchedDrive(owner, clock, config) for config in watched)

    def open(self) -> AxisEvidence:
        """Hear from every watched drive, then open the axis.

        Raises
        ------
        DriverError
            A watched drive does not answer, or is in fault; the axis is left alone then.
        """
        longest_s = max((drive.config.silence_s for drive in self._drives), default=0.0)
        deadline_s = self._clock.now() + 2.0 * longest_s
        while True:
            self._owner.poll()
            self._look()
            if all(drive.is_known for drive in self._drives):
                return self._axis.open()
            now_s = self._clock.now()
            if now_s >= deadline_s:
                missing = [d.config.name for d in self._drives if not d.is_known]
                raise NodeMissingError(
                    f"The watched {', '.join(missing)} cannot be read.", "Check power and cable."
                )
            self._clock.sleep_until(now_s + _OPEN_POLL_S)

    def send(self, command: Command) -> None:
        """As the axis does."""
        self._axis.send(command)

    def receive(self) -> tuple[Sample, ...]:
        """Return what the axis received.

        Raises
        ------
        DriverError
            As the axis does; and where a watched drive moves, faults, restarts or vanishes.
        """
        samples = self._axis.receive()
        try:
            self._look()  # the axis has just polled the bus
        except DriverError:
            self._kept = (*self._kept, *samples)
            raise
        return samples

    def stop(self, deadline_s: float) -> StopReport:
        """As the axis does; the others have no say in it. What they kept back comes first."""
        report = self._axis.stop(deadline_s)
        kept, self._kept = self._kept, ()
        return replace(report, samples=(*kept, *report.samples))

    def close(self) -> SyncAccount:
        """Close the axis, and stop listening to the others whatever becomes of it."""
        try:
            return self._axis.close()
        finally:
            for drive in self._drives:
                drive.release()

    def _look(self) -> None:
        failures = [drive.look() for drive in self._drives]
        for failure in failures:
            if failure is not None:
                raise failure
