"""The cell's PLC over Modbus, as the port `Release`: request, permit, alive, done.

A thread of its own talks to the PLC, but what it says is the control tick's: the alive count goes
up only when `permit` is called, so that an agent that hangs stands still before the PLC's eyes
even though the thread lives on. The other way, a permit counts only while the PLC's own count
moves and its word is fresh, and only as an answer to our request. One that was taken back, however
shortly and whatever else the control thread was doing, is gone for this cycle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from drivers.clock import Clock
from drivers.modbus.device import MappedDevice
from drivers.polling import Poller
from drivers.ports import Permit

SAYS = ("permit", "plc_alive", "refusal")
REFUSALS = {
    0: "it gives no reason",
    1: "a guard is open",
    2: "the cell is not in automatic",
    3: "the cell is stopped",
    4: "the cell is busy",
    5: "it misses the agent's alive count",
}
ENDED_WELL, ENDED_BADLY = 1, 2


class _Word(NamedTuple):
    """What the PLC said in one exchange."""

    permit: bool
    refusal: int
    alive: int
    heard_s: float
    moved_s: float  # when its count was last seen to move
    asked: bool  # whether our request stood there when it was said
    denials: int  # how often it has said no so far


class ModbusRelease:
    """A PLC behind the map ``cell-release``; one object serves one cycle.

    Parameters
    ----------
    device : MappedDevice
        The PLC; it belongs to the release from now on.
    clock : Clock
        Times exchanges.
    period_s, timeout_s : float
        How often they talk, and how long one exchange may take.
    age_max_s : float
        How old the PLC's word, and the last move of its count, may be.
    """

    def __init__(
        self,
        device: MappedDevice,
        clock: Clock,
        *,
        period_s: float,
        timeout_s: float,
        age_max_s: float,
    ) -> None:
        self.where = device.connection.where
        self._device = device
        self._clock = clock
        self._timeout_s = timeout_s
        self._age_max_s = age_max_s
        self._requested = 0
        self._ticks = 0
        self._last: _Word | None = None
        self._denials: int | None = None  # when it first permitted, None before
        self._poller = Poller(
            self._exchange, clock, period_s=period_s, timeout_s=timeout_s, name=self.where
        )

    def open(self) -> None:
        """Reach the PLC.

        Raises
        ------
        drivers.errors.DriverError
            It does not answer.
        """
        try:
            self._poller.start()
        except BaseException as error:
            error.add_note("It is the cell's PLC, whose release is asked for before anything else.")
            self.close()
            raise

    def request(self) -> None:
        """Ask for the permit with the next exchange."""
        self._requested = 1

    def permit(self) -> Permit:
        """Return whether the PLC permits motion now; also feeds our alive count. Never waits.

        Raises
        ------
        drivers.errors.WorkerDiedError
            Nobody talks to the PLC any more.
        """
        self._ticks += 1
        word = self._poller.latest()
        now_s = self._clock.now()
        silent_s, still_s = now_s - word.heard_s, now_s - word.moved_s
        if silent_s > self._age_max_s:
            trouble = f": {self._poller.trouble}" if self._poller.trouble else ""
            return Permit(False, f"the cell's PLC has not been heard for {silent_s:.2f} s{trouble}")
        if still_s > self._age_max_s:
            return Permit(
                False, f"the alive count of the cell's PLC stands still ({still_s:.2f} s)"
            )
        if not word.permit:
            why = REFUSALS.get(word.refusal, f"refusal {word.refusal}")
            return Permit(False, f"the cell's PLC gives no permit: {why}")
        if not word.asked:
            return Permit(False, "the cell's PLC has not been asked yet")
        if self._denials is None:
            self._denials = word.denials
        if word.denials > self._denials:
            return Permit(False, "the cell's PLC has taken its permit back for a moment")
        return Permit(True, "")

    def done(self, *, well: bool) -> None:
        """Take the request back and say how it ended.

        Raises
        ------
        drivers.errors.DriverError
            The PLC cannot be told; it sees the alive count stand still.
        """
        self._poller.stop()
        self._requested = 0
        ended = ENDED_WELL if well else ENDED_BADLY
        deadline_s = self._clock.now() + 2.0 * self._timeout_s
        self._device.write({"done": ended, "request": 0}, deadline_s)

    def close(self) -> None:
        """Let the connection go. May be repeated."""
        self._poller.stop()
        self._device.connection.close()

    def _exchange(self, deadline_s: float) -> _Word:
        asked_s = self._clock.now()
        says = {"agent_alive": self._ticks & 0xFFFF, "request": self._requested}
        if self._last is None:
            says["done"] = 0
        self._device.write(says, deadline_s)
        read = self._device.read(SAYS, deadline_s)
        alive = read["plc_alive"].whole
        last = self._last
        # One look at a count does not show that it moves: until then it has never moved.
        moved_s = -math.inf if last is None else last.moved_s
        if last is not None and alive != last.alive:
            moved_s = asked_s
        permits = read["permit"].whole == 1
        self._last = _Word(
            permits,
            read["refusal"].whole,
            alive,
            asked_s,
            moved_s,
            asked=says["request"] == 1,
            denials=(0 if last is None else last.denials) + (not permits),
        )
        return self._last
