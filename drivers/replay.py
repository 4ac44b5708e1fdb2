"""A recording played as an axis: each of its samples once, at its own time, unaltered.

A set-point has no effect here, because the recording answers the set-points that it was driven
with. So every set-point is compared with those, and `comparison` says how often and how far they
differ; whoever plays another trajectory than the recorded one is stopped by the gate, not by us.

Until playing starts, and after its end, the axis stands where the recording begins, or ends.
"""

from __future__ import annotations

import math

import numpy as np

from drivers.clock import Clock
from drivers.errors import DriverError, DriveStateError, RecordingEndedError
from drivers.ports import (
    AxisEvidence,
    Command,
    DriveState,
    Goal,
    Sample,
    StopReport,
    SyncAccount,
)
from drivers.recorded import Comparison, Recorded

_ROUNDING_S = 1e-6


class ReplayAxis:
    """The port `Axis` over a recording; one object serves one session, from `open` to `close`.

    Parameters
    ----------
    recorded : Recorded
        What is played.
    clock : Clock
        Stepped or real time: a sample is there once its own time has come and a command was sent
        after it, like a drive's answer to SYNC.
    rest_velocity_rad_s, rest_samples : float, int
        Standstill: that many samples in a row no faster than that.

    Attributes
    ----------
    comparison : Comparison
        Of the set-points so far.
    held : int
        Samples handed out beside the recording's own: those of standing before and after it.
    """

    def __init__(
        self,
        recorded: Recorded,
        clock: Clock,
        *,
        rest_velocity_rad_s: float = 0.5,
        rest_samples: int = 5,
    ) -> None:
        self.comparison = Comparison()
        self.held = 0
        self._recorded = recorded
        self._elapsed_s = recorded.time_s - recorded.time_s[0]
        self._clock = clock
        self._rest_velocity_rad_s = rest_velocity_rad_s
        self._rest_samples = rest_samples
        self._ready: list[Sample] = []
        self._started_s: float | None = None
        self._next = 0
        self._goal = Goal.OFF
        self._opened = False
        self._closed = False
        self._failure: DriverError | None = None

    def open(self) -> AxisEvidence:
        """Say what is played; nothing is set, so nothing has to be restored.

        Raises
        ------
        DriveStateError
            It has been opened before.
        """
        if self._opened or self._closed:
            raise DriveStateError("This axis object has been opened before.", "Make a new one.")
        self._opened = True
        return AxisEvidence(identity=dict(self._recorded.identity))

    def send(self, command: Command) -> None:
        """Take note of the set-point, and let the recording go on to the present time.

        Raises
        ------
        ValueError
            A velocity that is not finite, with the goal ON.
        DriveStateError
            The axis is not open.
        RecordingEndedError
            With the goal ON after the recording's end was told: that again.
        """
        if command.goal is Goal.ON and not math.isfinite(command.velocity_rad_s):
            raise ValueError(f"velocity must be finite, got {command.velocity_rad_s} rad/s")
        self._insist_on_open()
        if command.goal is Goal.ON and self._failure is not None:
            raise self._failure
        now_s = self._clock.now()
        moving = command.goal is Goal.ON and command.velocity_rad_s != 0.0
        asked = command.goal is Goal.ON if self._recorded.begins_with_enabling else moving
        if self._started_s is None and asked:
            self._started_s = now_s
        self._goal = command.goal
        if command.goal is Goal.ON and self._started_s is not None:
            self._compare(command.velocity_rad_s, now_s - self._started_s)
        self._play(now_s)
        if moving and self._next == len(self._elapsed_s) and now_s > self._end_s():
            self._failure = RecordingEndedError(
                f"The recording ends after {self._elapsed_s[-1]:.2f} s, and the joint is still to "
                f"move at {command.velocity_rad_s:.2f} rad/s.",
                "Play it with the trajectory, the sample rate and the cell that it was made with.",
            )

    def receive(self) -> tuple[Sample, ...]:
        """Return what has been played since the last call, oldest first; never waits.

        Raises
        ------
        DriveStateError
            The axis is not open.
        RecordingEndedError
            Motion was asked for after the recording's end; every later call says so again.
        """
        self._insist_on_open()
        if self._failure is not None:
            raise self._failure
        return self._taken()

    def stop(self, deadline_s: float) -> StopReport:
        """Play on, up to the clock's `deadline_s`, until the recording itself comes to rest.

        A recording cannot be braked; one that was stopped where it is stopped now shows how.
        """
        if not self._opened or self._closed:
            return StopReport(at_rest=False, samples=(), reason="the axis is not open")
        samples = list(self._taken())
        self._goal = Goal.QUICK_STOP
        still = 0
        while still < self._rest_samples and self._clock.now() < deadline_s:
            now_s = self._clock.now()
            self._clock.sleep_until(min(deadline_s, now_s + self._recorded.period_s))
            self._play(self._clock.now())
            for sample in self._taken():
                samples.append(sample)
                slow = abs(sample.velocity_rad_s) <= self._rest_velocity_rad_s
                still = still + 1 if slow else 0
        at_rest = still >= self._rest_samples
        return StopReport(
            at_rest=at_rest,
            samples=tuple(samples),
            reason="the recording comes to rest"
            if at_rest
            else "the recording goes on moving: it was not stopped here (a replay moves no joint)",
        )

    def close(self) -> SyncAccount:
        """Let go of the recording, and say what was played of it. May be repeated."""
        self._closed = True
        gaps_s = np.diff(self._elapsed_s[: self._next])
        missing = 0
        if self._next > 1:
            missing = int(np.sum(np.maximum(np.round(gaps_s / self._recorded.period_s) - 1, 0)))
        received = self.held + self._next
        lost = self._recorded.samples_lost if self._next else 0
        if not received:
            return SyncAccount()
        played = self._recorded if self._next else None
        return SyncAccount(
            expected=received + lost,
            received=received,
            lost=lost,
            not_asked=max(missing - lost, 0),
            longest_gap_s=float(gaps_s.max()) if self._next > 1 else 0.0,
            dropped_by_kernel=self._recorded.dropped_by_kernel,
            reader="replay",
            stamps="recording",
            undecided=played.undecided if played else 0,
            doubtful=min(played.doubtful, self._next) if played else 0,
            doubtful_s=self._recorded.doubts(self._next, self._started_s or 0.0),
            changed=played.changed if played else (),
        )

    def _play(self, now_s: float) -> None:
        """Make ready every sample whose time has come, or one that stands still."""
        recorded, started_s = self._recorded, self._started_s
        if started_s is None:
            self._hold(0, now_s)
            return
        due = np.searchsorted(self._elapsed_s, now_s - started_s + _ROUNDING_S, side="right")
        for row in range(self._next, int(due)):
            time_s = started_s + float(self._elapsed_s[row])
            if abs(time_s - now_s) <= _ROUNDING_S:
                time_s = now_s  # it answers this very command, whatever the sum has rounded to
            self._ready.append(recorded.sample(row, time_s, self._state(row)))
        self._next = max(self._next, int(due))
        if now_s > self._end_s():
            self._hold(len(self._elapsed_s) - 1, now_s)

    def _hold(self, row: int, now_s: float) -> None:
        self.held += 1
        self._ready.append(self._recorded.sample(row, now_s, self._state(row)))

    def _state(self, row: int) -> DriveState:
        """Return what a drive would say: what it is told to, once the recorded one was enabled."""
        if self._goal is Goal.ON and row >= self._recorded.enabled_from:
            return DriveState.ON
        return DriveState.QUICK_STOP if self._goal is Goal.QUICK_STOP else DriveState.OFF

    def _end_s(self) -> float:
        """Return when, on the clock, the last sample is played, and a period more."""
        if self._started_s is None:
            return math.inf
        return self._started_s + float(self._elapsed_s[-1]) + self._recorded.period_s + _ROUNDING_S

    def _compare(self, velocity_rad_s: float, elapsed_s: float) -> None:
        """Count the set-point, and whether it lies among those recorded about its time."""
        near = self._recorded.set_points_near(elapsed_s)
        if near is not None:
            self.comparison = self.comparison.after(velocity_rad_s, near, elapsed_s)

    def _taken(self) -> tuple[Sample, ...]:
        now_s = self._clock.now()
        ready, self._ready = self._ready, []
        return tuple(sample._replace(received_s=now_s) for sample in ready)

    def _insist_on_open(self) -> None:
        if not self._opened or self._closed:
            raise DriveStateError("The axis is not open.", "Open it first.")
