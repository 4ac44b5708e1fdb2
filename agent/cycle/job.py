"""Runs one job: a robot controller drives the stair by itself, the agent watches and records.

The safety shell is the cycle's: preconditions, interlock, gate, one clean-up path. The gate cannot
refuse a set-point that it never sees, so it judges what is measured, at every tick: speed, window
with stopping distance, torque, temperature, freshness. A position and a velocity that contradict
each other show nothing, so they are refused as well. Whatever is refused aborts the job.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from agent.cycle.continuity import Course
from agent.cycle.ending import CycleResult, conclude
from agent.cycle.gate import Asked, SetPoint, refusals
from agent.cycle.interlock import Event, Interlock
from agent.cycle.pace import ticks
from agent.cycle.plan import CyclePlan
from agent.cycle.preflight import at_standstill, insist
from agent.cycle.recorder import Writer
from agent.cycle.runner import OBSERVE_S, OBSERVE_TIMEOUT_S, Progress
from agent.cycle.teardown import Aftermath, tear_down
from agent.errors import StoppedError
from drivers.clock import Clock
from drivers.ports import (
    AxisEvidence,
    DriveState,
    JobController,
    JobState,
    JobStatus,
    Sample,
    SyncAccount,
)
from trajectories import lasting

COLUMNS = ("time_s", "position_rad", "velocity_rad_s", "torque_nm", "phase")
TEMPERATURE_COLUMN = "gearbox_temperature_degc"
SLACK = 1.5
"""How much longer than planned a job may take, before it is taken for hanging."""

APPROACH_S = 30.0
"""What a controller may take to go to the start and back, in its own way."""

_STEADY = "steady"  # the phase in which a controller holds one of the stair's speeds

LOOK = (
    "Find the cause at the joint, the controller, its network or the cell, then start a new cycle."
)


def job_columns(*, with_temperature: bool) -> tuple[str, ...]:
    """Return the columns of a job's recording; there are no set-points in it, only motion."""
    return (*COLUMNS, TEMPERATURE_COLUMN) if with_temperature else COLUMNS


class JobRunner:
    """One job on one axis, from the closed connection back to the closed connection.

    Parameters
    ----------
    plan : CyclePlan
        The stair that the controller was told to drive, and the limits that it is watched by.
    controller : drivers.ports.JobController
        Opened and closed here.
    clock : drivers.clock.Clock
        Paces the exchanges.
    open_recording : callable
        Starts the recording once the controller is known.
    stop_requested, progress : callable
        As for `agent.cycle.runner.CycleRunner`.

    Attributes
    ----------
    aftermath : Aftermath or None
        How the clean-up went; None before `run` has ended.
    """

    def __init__(
        self,
        plan: CyclePlan,
        controller: JobController,
        clock: Clock,
        *,
        open_recording: Callable[[AxisEvidence], Writer],
        stop_requested: Callable[[], str | None] = lambda: None,
        progress: Progress = lambda _stage, _share: None,
    ) -> None:
        self.plan = plan
        self.interlock = Interlock()
        self.aftermath: Aftermath | None = None
        self._controller = controller
        self._clock = clock
        self._open_recording = open_recording
        self._stop_requested = stop_requested
        self._progress = progress
        self._writer: Writer | None = None
        self._origin_s: float | None = None
        self._phase = ""
        self._may_move = False
        self._stopped_because = ""
        self._course = Course(plan.limits)
        self._fastest_rad_s = 0.0

    def run(self) -> CycleResult:
        """Run the job.

        Raises
        ------
        agent.errors.RefusedError, agent.errors.StoppedError, drivers.errors.DriverError
            After the clean-up; the notes say whether the joint is at rest and where the
            recording is.
        """
        evidence: AxisEvidence | None = None
        failure: BaseException | None = None
        try:
            evidence = self._controller.open()
            self._watch(evidence)
        except BaseException as error:  # noqa: BLE001 - re-raised below, after the clean-up
            failure = error
            self._stopped_because = str(error) or type(error).__name__
        self.aftermath = aftermath = tear_down(
            self._controller,
            self._clock,
            has_torque=self._may_move and failure is not None,
            keep=self._keep_last,
            finish=self._finish,
        )
        return conclude(failure, aftermath, evidence, what="job", moved=self._may_move)

    # -- the loop ----------------------------------------------------------------------------

    def _watch(self, evidence: AxisEvidence) -> None:
        self._writer = self._open_recording(evidence)
        newest = self._observe()
        self.interlock = self.interlock.after(Event.PREFLIGHT_PASSED).after(Event.ENABLE_ASKED)
        self._may_move = True
        self._controller.start()
        started_s = self._clock.now()
        for now_s in ticks(self._clock, self.plan.tick_s):
            reason = self._stop_requested()
            if reason is not None:
                raise self._trip(reason, "Start a new cycle when it may run again.")
            status = self._controller.exchange()
            if status.sample is not None:
                newest = status.sample
                self._course.take(newest)
                self._phase = status.phase
                if self._phase == _STEADY:
                    self._fastest_rad_s = max(self._fastest_rad_s, abs(newest.velocity_rad_s))
                self._keep((newest,))
            if self._has_ended(status, newest, now_s - started_s):
                self._may_move = False
                self._insist_on_the_stair()
                self._progress("done", 1.0)
                return
            self._progress("stair", status.progress)

    def _observe(self) -> Sample:
        """See the joint at rest, without a job, for a fifth of a second; return the last sample.

        Raises
        ------
        agent.errors.RefusedError
            With every precondition that does not hold.
        agent.errors.StoppedError
            Asked to stop, or the controller has taken back that it is ready.
        """
        seen: list[Sample] = []
        start_s = self._clock.now()
        for now_s in ticks(self._clock, self.plan.tick_s):
            reason = self._stop_requested()
            if reason is not None:
                raise StoppedError(f"Stopped before anything moved: {reason}.")
            status = self._controller.exchange()
            if status.state not in (JobState.READY, None):
                raise StoppedError(
                    f"Stopped before anything moved: the job was ready and is now "
                    f"'{status.state.value}'. A controller lets an axis go again that nobody "
                    "starts: is this machine very busy?"
                )
            if status.sample is not None:
                seen.append(status.sample)
            span_s = seen[-1].time_s - seen[0].time_s if seen else 0.0
            if span_s >= OBSERVE_S or now_s - start_s > OBSERVE_TIMEOUT_S:
                break
        insist(at_standstill(self.plan, seen))
        return seen[-1]

    def _has_ended(self, status: JobStatus, newest: Sample, elapsed_s: float) -> bool:
        """Return whether the job is done; trip on everything else that is not its running."""
        state = "not heard" if status.state is None else status.state.value
        if status.state is JobState.ABORTED:
            raise self._trip(f"the controller has aborted the job: {status.reason}")
        if self.interlock.may_move:
            if status.state is JobState.DONE:
                self.interlock = self.interlock.after(Event.MOTION_DONE).after(Event.DRIVE_OFF)
                return True
            if status.state not in (JobState.RUNNING, None):
                raise self._trip(f"the job was running and is now '{state}'")
            self._insist(newest, unheard=status.reason)
        elif status.state is JobState.RUNNING and newest.state is DriveState.ON:
            self.interlock = self.interlock.after(Event.DRIVE_ON)
        elif elapsed_s > self.plan.transition_timeout_s:
            limit_s = self.plan.transition_timeout_s
            raise self._trip(f"the job did not begin within {limit_s:.1f} s: it is '{state}'")
        longest_s = SLACK * self.plan.trajectory.duration_s + APPROACH_S
        if elapsed_s > longest_s:
            raise self._trip(f"the job has not ended within {lasting(longest_s)}")
        return False

    def _insist(self, sample: Sample, unheard: str) -> None:
        """Trip unless what is measured is inside every limit; say why nothing newer is known."""
        fastest = self.plan.limits.velocity_max_rad_s
        asked = Asked(sample.velocity_rad_s, sample.position_rad)
        # What positions show may be what a wrong velocity hides; how fast, they show roughly.
        shown = min(max(self._course.speed_rad_s, -fastest), fastest)
        reasons = [self._course.contradiction()]
        for speed in (sample.velocity_rad_s, shown):
            at = SetPoint(speed, sample.position_rad, speed, self.plan.tick_s, answered=asked)
            reasons += refusals(self.plan.limits, at, sample, self._clock.now())
        against = tuple(dict.fromkeys(reason for reason in reasons if reason))
        if against and unheard:
            what = unheard.rstrip(".")
            against += (f"the controller was not heard: {what}",)
        if against:
            raise self._trip("; ".join(against))

    def _insist_on_the_stair(self) -> None:
        """Refuse a job as fast or slow as no such stair is: other units, or another program."""
        speeds = (abs(window.velocity_rad_s) for window in self.plan.trajectory.steady_windows())
        wanted, measured = max(speeds, default=0.0), self._fastest_rad_s
        if measured and abs(measured - wanted) > self.plan.limits.velocity_error_max_rad_s:
            raise StoppedError(
                f"The job ran to its end, but the fastest steady speed that was measured is "
                f"{measured:.1f} rad/s where the stair has {wanted:.1f} rad/s.",
                "Compare units and parameters of the controller's program with docs/modbus.md.",
            )

    def _trip(self, reason: str, do: str = LOOK) -> StoppedError:
        stage = self._phase or self.interlock.state.value
        self.interlock = self.interlock.after(Event.TRIP, reason)
        return StoppedError(f"Stopped during '{stage}': {self.interlock.reason}.", do)

    # -- what the clean-up calls -------------------------------------------------------------

    def _keep(self, samples: tuple[Sample, ...]) -> None:
        for sample in samples:
            if self._writer is None:
                return
            if self._origin_s is None:
                self._origin_s = sample.time_s
            row: list[float | str] = [
                sample.time_s - self._origin_s,
                sample.position_rad,
                sample.velocity_rad_s,
                sample.torque_nm,
                self._phase,
            ]
            if self.plan.limits.temperature_required:
                row.append(sample.gearbox_temperature_degc)
            self._writer.append(row)

    def _keep_last(self, samples: tuple[Sample, ...]) -> None:
        if self._writer is not None:
            self._writer.wait_for_disk()
            self._keep(samples)

    def _finish(self, account: SyncAccount | None) -> Path | None:
        if self._writer is None:
            return None
        return self._writer.finish(account=account, stopped_because=self._stopped_because)
