"""The fake drive as a process of its own: real time on a real bus."""

from __future__ import annotations

import gc
import math
import os
import socket
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

import can

from fakes.can_drive import FakeDrive
from fakes.fault import Fault
from fakes.specification import FakeSpecification

POLL_S = 0.001
LONGEST_CATCH_UP_S = 0.5


class StopFlag(Protocol):
    """What ends the process: a `threading.Event`, or anything like it."""

    def is_set(self) -> bool:
        """Return whether to end now."""
        ...


class LateClock:
    """Real time for a simulation that may be held up: what is too much to catch up is skipped.

    A process that was stopped for an hour must not integrate that hour before it answers
    again; it loses the time instead, as if the joint had been frozen with it.

    Parameters
    ----------
    longest_s : float
        The most that one step makes up for.
    """

    def __init__(self, longest_s: float = LONGEST_CATCH_UP_S) -> None:
        self._longest_s = longest_s
        self._last_s: float | None = None
        self._now_s = 0.0
        self.skipped_s = 0.0

    def now(self, real_s: float) -> float:
        """Return simulated seconds for a reading of the real monotonic clock."""
        if self._last_s is not None:
            passed = real_s - self._last_s
            made_up = min(passed, self._longest_s)
            self.skipped_s += passed - made_up
            self._now_s += made_up
        self._last_s = real_s
        return self._now_s


class Arrivals:
    """When frames came: a drive latches its sensors by the SYNC on the wire, not by its software.

    The bus stamps a frame as it comes, by the wall clock; the process may take it later, beside
    other programs. What it does then, the drive does at the moment of the stamp.

    Parameters
    ----------
    clock : LateClock
        Simulated time.
    """

    def __init__(self, clock: LateClock) -> None:
        self._clock = clock
        self._last_s = -math.inf

    def moment_of(self, message: can.Message | None, looked_s: float) -> float:
        """Return simulated seconds for a frame, or for having found none since `looked_s`.

        A stamp that is no time of the last half second is no stamp: then a frame comes when it is
        taken. Time never goes back.
        """
        at_s = looked_s
        if message is not None:
            at_s = time.perf_counter()
            age_s = 1e-9 * time.time_ns() - message.timestamp  # both by the wall clock
            if 0.0 <= age_s <= LONGEST_CATCH_UP_S:
                at_s -= age_s
        self._last_s = max(self._last_s, at_s)
        return self._clock.now(self._last_s)


def open_bus(
    interface: str,
    channel: str,
    *,
    bitrate: int | None = None,
    options: Mapping[str, Any] | None = None,
) -> can.BusABC:
    """Open a bus by its description alone, whatever configuration files the machine has.

    Parameters
    ----------
    interface, channel : str
        As python-can names them: ``udp_multicast``, ``socketcan``, ``virtual``.
    bitrate : int, optional
        Bit/s, for interfaces that set it.
    options : mapping, optional
        Further keywords of the interface, such as ``hop_limit`` and ``port``. Multicast stays
        on this machine (``hop_limit`` 0) unless they say otherwise.
    """
    settings: dict[str, Any] = {"hop_limit": 0} if interface == "udp_multicast" else {}
    if bitrate is not None:
        settings["bitrate"] = bitrate
    settings |= dict(options or {})
    bus = can.Bus(interface=interface, channel=channel, ignore_config=True, **settings)
    if interface == "udp_multicast" and sys.platform == "linux":
        with socket.socket(fileno=os.dup(bus.fileno())) as shared:
            is_ip4 = shared.family == socket.AF_INET
            # not the groups of other programs of this machine: IP_MULTICAST_ALL, IPV6_MULTICAST_ALL
            level, all_groups = (socket.IPPROTO_IP, 49) if is_ip4 else (socket.IPPROTO_IPV6, 29)
            shared.setsockopt(level, all_groups, 0)
        while bus.recv(0.0) is not None:
            pass  # from before that
    return bus


def run_process(
    interface: str,
    channel: str,
    *,
    stop: StopFlag,
    bitrate: int | None = None,
    node_id: int = 1,
    seed: int = 0,
    specification: FakeSpecification | None = None,
    faults: Iterable[Fault] = (),
    options: Mapping[str, Any] | None = None,
    ready: Callable[[], None] = lambda: None,
) -> None:
    """Be a drive in real time until `stop` is set.

    Frames are waited for, at most a millisecond at a time, and the joint is where it was when a
    frame came, however late the process takes it. Where the bus echoes a node's own frames
    (udp_multicast does), they go nowhere: the drive listens only to identifiers that it never
    sends.

    Parameters
    ----------
    interface, channel, bitrate, options
        See `open_bus`.
    stop : StopFlag
        Looked at a thousand times a second.
    node_id, seed, specification, faults
        See `FakeDrive`.
    ready
        Called once the bus is open and the drive listens.

    Raises
    ------
    can.CanError, OSError
        When the bus cannot be opened or stops working.
    """
    bus = open_bus(interface, channel, bitrate=bitrate, options=options)
    try:
        drive = FakeDrive(
            bus, node_id=node_id, specification=specification, faults=faults, seed=seed
        )
        arrivals = Arrivals(LateClock())
        # What has been built stays: a collector that walks it again would hold up answers.
        gc.collect()
        gc.freeze()
        drive.step_to(arrivals.moment_of(None, time.perf_counter()))
        ready()
        while not stop.is_set():
            looked_s = time.perf_counter()
            message = bus.recv(POLL_S)
            drive.step_to(arrivals.moment_of(message, looked_s), message)
    finally:
        gc.unfreeze()
        bus.shutdown()
