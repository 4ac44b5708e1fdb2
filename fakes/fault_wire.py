"""A bad piece of cable between a device and its bus: real frames, scripted misfortune."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import can
import numpy as np

from fakes import wire_faults as script
from fakes.faults import FaultPlayer

FARTHEST_BEHIND_FRAMES = 2000
"""So many injected frames at most in one step of time: more do not fit on any bus."""


@dataclass
class _Active:
    """A fault that lasts, with what it has to remember."""

    fault: script.WireFault
    began_s: float
    injected: int = 0
    kept: dict[str, can.Message] = field(default_factory=dict)  # swapped: waiting, by direction
    held: dict[int, bytes] = field(default_factory=dict)  # falsified: the first bytes, by id

    @property
    def ends_s(self) -> float:
        return self.began_s + self.fault.lasts_s


class Wire(can.BusABC):
    """A bus as a device sees it through bad cable; give it to the device in the bus's place.

    Parameters
    ----------
    bus : can.BusABC
        The sound one; it belongs to the caller.
    faults : iterable of faults.WireFault
        What goes wrong, in seconds since the first `step_to`; at the wire there is no `at_sync`.
    seed : int
        Of shares, bits and random data: the same seed and frames give the same misfortune.
    """

    def __init__(
        self, bus: can.BusABC, faults: Iterable[script.WireFault] = (), seed: int = 0
    ) -> None:
        super().__init__(channel=getattr(bus, "channel", ""))
        faults = tuple(faults)
        if any(fault.at_sync is not None for fault in faults):
            raise ValueError("a wire counts no SYNC: expected at_s, got at_sync")
        self._bus = bus
        self._player = FaultPlayer(faults)
        self._random = np.random.default_rng(seed)
        self._active: list[_Active] = []
        self._late: deque[tuple[float, str, can.Message]] = deque()
        self._arrived: deque[can.Message] = deque()
        self._origin_s: float | None = None
        self._now_s = 0.0

    def step_to(self, now_s: float) -> None:
        """Move time: faults begin and end, late frames arrive, others' frames come."""
        if self._origin_s is None:
            self._origin_s = now_s
        self._now_s = now_s - self._origin_s
        for fault in self._player.begin(self._now_s, 0):
            if isinstance(fault, script.WireFault):
                self._active.append(_Active(fault, self._now_s))
        if not self._active and not self._late:
            return
        while self._late and self._late[0][0] <= self._now_s:
            _, towards, message = self._late.popleft()
            self._emit(message, towards)
        for active in self._active:
            if isinstance(active.fault, script.Injected):
                self._inject(active, active.fault)
        over = [a for a in self._active if self._now_s >= a.ends_s]
        for active in over:
            self._active.remove(active)
            for towards, message in active.kept.items():
                self._emit(message, towards)

    def heal(self) -> None:
        """Be sound from now on; what had not arrived is lost."""
        self._player = FaultPlayer()
        self._active.clear()
        self._late.clear()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame of the device, as far as the wire lets it."""
        if not self._active:
            self._bus.send(msg, timeout)
            return
        for frame in self._suffered(msg, "agent"):
            self._bus.send(frame, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame that has come through to the device."""
        if self._arrived:
            return self._arrived.popleft()
        while (message := self._bus.recv(timeout)) is not None:
            if not self._active:
                return message
            self._arrived.extend(self._suffered(message, "drive"))
            if self._arrived:
                return self._arrived.popleft()
            timeout = 0.0
        return None

    def shutdown(self) -> None:
        """Let go; the bus stays open."""
        self._is_shutdown = True

    # ---- what becomes of one frame ----------------------------------------------------------

    def _suffered(self, message: can.Message, towards: str) -> list[can.Message]:
        """Return what arrives now of one frame, after every fault in turn."""
        frames = [message]
        for active in self._active:
            frames = [out for frame in frames for out in self._suffer(active, frame, towards)]
        return frames

    def _suffer(self, active: _Active, message: can.Message, towards: str) -> list[can.Message]:
        fault = active.fault
        if fault.towards not in (towards, "both"):
            return [message]
        if fault.identifiers and message.arbitration_id not in fault.identifiers:
            return [message]
        if fault.share < 1.0 and self._random.random() >= fault.share:
            return [message]
        match fault:
            case script.Lost():
                return []
            case script.Doubled():
                return [message, message]
            case script.Swapped():
                before = active.kept.pop(towards, None)
                if before is not None:
                    return [message, before]
                active.kept[towards] = message
                return []
            case script.Late():
                self._late.append((self._now_s + fault.delay_s, towards, message))
                return []
            case script.Stalled():
                self._late.append((active.ends_s, towards, message))
                return []
            case script.Flipped() | script.Short() | script.Falsified():
                return [_with_data(message, self._changed(active, message))]
            case _:
                return [message]

    def _changed(self, active: _Active, message: can.Message) -> bytes:
        fault, data = active.fault, bytearray(message.data)
        match fault:
            case script.Flipped() if data:
                bit = int(self._random.integers(8 * len(data)))
                data[bit >> 3] ^= 1 << (bit & 7)
            case script.Short():
                return bytes(data[: fault.keep])
            case script.Falsified() if len(data) >= fault.offset + fault.size:
                part = slice(fault.offset, fault.offset + fault.size)
                data[part] = _falsified(fault, active, message.arbitration_id, bytes(data[part]))
            case _:
                pass
        return bytes(data)

    # ---- what others send --------------------------------------------------------------------

    def _inject(self, active: _Active, fault: script.Injected) -> None:
        passed_s = min(self._now_s, active.ends_s) - active.began_s
        due = 1 + math.floor(passed_s * fault.frames_per_s)
        count = min(due - active.injected, FARTHEST_BEHIND_FRAMES)
        active.injected = due
        for _ in range(count):
            message = self._foreign(fault)
            for towards in ("agent", "drive"):
                if fault.towards in (towards, "both"):
                    self._emit(message, towards)

    def _foreign(self, fault: script.Injected) -> can.Message:
        random, extended = self._random, fault.flavour == "extended"
        if fault.identifiers:
            identifier = fault.identifiers[int(random.integers(len(fault.identifiers)))]
        else:
            identifier = int(random.integers(1 << 29 if extended else 1 << 11))
        data = bytes.fromhex(fault.data) or random.bytes(int(random.integers(9)))
        remote = fault.flavour == "remote"
        return can.Message(
            arbitration_id=identifier,
            is_extended_id=extended,
            is_remote_frame=remote,
            is_error_frame=fault.flavour == "error",
            data=None if remote else data,
        )

    def _emit(self, message: can.Message, towards: str) -> None:
        if towards == "agent":
            self._bus.send(message)
        else:
            self._arrived.append(message)


def _falsified(fault: script.Falsified, active: _Active, identifier: int, part: bytes) -> bytes:
    """Return the bytes that are reported in place of `part`."""
    if fault.change == "hold":
        return active.held.setdefault(identifier, part)
    number, true = fault.value, int.from_bytes(part, "little", signed=True)
    if fault.change == "add":
        number += true
    elif fault.change == "multiply":
        number *= true
    modulus = 1 << (8 * fault.size)
    return (number % modulus).to_bytes(fault.size, "little")


def _with_data(message: can.Message, data: bytes) -> can.Message:
    return can.Message(
        arbitration_id=message.arbitration_id,
        is_extended_id=message.is_extended_id,
        is_remote_frame=message.is_remote_frame,
        is_error_frame=message.is_error_frame,
        data=data,
    )
