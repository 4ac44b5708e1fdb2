"""The agent's own CAN adapter, failing: unplugged, interface down, nobody acknowledges."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable

import can

from fakes.faults import AdapterFails

_WORDS = {
    "ENETDOWN": "Network is down",
    "ENODEV": "No such device",
    "ENOBUFS": "No buffer space available",
}


class FaultyAdapter(can.BusABC):
    """A bus that works until its time has come; then it raises what SocketCAN raises.

    ENOBUFS is an error of sending alone: the queue is full because nobody acknowledges.

    Parameters
    ----------
    bus : can.BusABC
        The sound one; shut down with this one.
    now : callable
        Seconds since the drive was switched on.
    faults : iterable of AdapterFails
        What goes wrong, and when.
    """

    def __init__(
        self, bus: can.BusABC, now: Callable[[], float], faults: Iterable[AdapterFails]
    ) -> None:
        super().__init__(channel=getattr(bus, "channel", ""))
        self._bus = bus
        self._now = now
        self._faults = tuple(faults)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send, raise, or lose the frame."""
        fault = self._failing()
        if fault is None:
            self._bus.send(msg, timeout)
        elif fault.code:
            raise can.CanOperationError(
                f"Failed to transmit: {_WORDS.get(fault.code, fault.code)}",
                getattr(errno, fault.code),
            )

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Receive, raise, or hear nothing."""
        fault = self._failing()
        if fault is None or fault.code == "ENOBUFS":
            return self._bus.recv(timeout)
        while self._bus.recv(0.0) is not None:
            pass  # what comes meanwhile is lost
        if fault.code:
            raise can.CanOperationError(
                f"Error receiving: {_WORDS.get(fault.code, fault.code)}",
                getattr(errno, fault.code),
            )
        return None

    def shutdown(self) -> None:
        """Shut the adapter."""
        self._is_shutdown = True
        self._bus.shutdown()

    def _failing(self) -> AdapterFails | None:
        now_s = self._now()
        for fault in self._faults:
            if 0.0 <= now_s - (fault.at_s or 0.0) < fault.lasts_s:
                return fault
        return None
