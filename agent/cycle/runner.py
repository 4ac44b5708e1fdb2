"""Runs one cycle: opens the axis, steps the sequence on the clock, records, always cleans up.

The loop is one tick after the other: take what has arrived, let the sequence decide, send, record,
wait. Nothing else sends; if this loop hangs, the heartbeat stops with it and the drive stops the
joint by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from agent.cycle.ending import CycleResult, conclude
from agent.cycle.interlock import Event, Interlock
from agent.cycle.pace import ticks, unhurried_collector
from agent.cycle.plan import CyclePlan
from agent.cycle.preflight import at_standstill, insist, watchdog_proven
from agent.cycle.recorder import Recorder, Writer
from agent.cycle.sequence import Sequence as CycleSequence
from agent.cycle.stage import OFF, Stage
from agent.cycle.teardown import Aftermath, tear_down
from agent.errors import StoppedError
from drivers.clock import Clock
from drivers.ports import Axis, AxisEvidence, Sample, SetPoints, SyncAccount, WatchdogProof

OBSERVE_S = 0.2
OBSERVE_TIMEOUT_S = 2.0

Progress = Callable[[str, float], None]

ProveWatchdog = Callable[[float, float, Callable[[], None]], WatchdogProof]
"""Given the speed of a joint that moves, the patience for enabling, and whom to ask at each look.

It has torque on the joint for half a second, at standstill.
"""


class CycleRunner:
    """One cycle on one axis, from the closed bus back to the closed bus.

    Parameters
    ----------
    plan : CyclePlan
        What to do.
    axis : drivers.ports.Axis
        The axis; opened and closed here.
    clock : drivers.clock.Clock
        Paces the ticks.
    open_recording : callable
        Starts the recording once the drive is known.
    prove_watchdog : callable, optional
        Shows, once the joint is known to stand, that the drive stops when the agent falls silent.
    stop_requested : callable
        Asked every tick; returns a reason to stop, or None.
    progress : callable
        Told the stage and the share of the stair, about ten times a second.

    Attributes
    ----------
    aftermath : Aftermath or None
        How the clean-up went; None before `run` has ended.
    """

    def __init__(
        self,
        plan: CyclePlan,
        axis: Axis,
        clock: Clock,
        *,
        open_recording: Callable[[AxisEvidence], Writer],
        prove_watchdog: ProveWatchdog | None = None,
        stop_requested: Callable[[], str | None] = lambda: None,
        progress: Progress = lambda _stage, _share: None,
    ) -> None:
        self.plan = plan
        self._axis = axis
        self._clock = clock
        self._open_recording = open_recording
        self._prove_watchdog = prove_watchdog
        self._stop_requested = stop_requested
        self._progress = progress
        self._writer: Writer | None = None
        self._recorder: Recorder | None = None
        self._torque_asked = False
        self._stopped_because = ""
        self.aftermath: Aftermath | None = None

    def run(self) -> CycleResult:
        """Run the cycle.

        Raises
        ------
        agent.errors.RefusedError, agent.errors.StoppedError, drivers.errors.DriverError
            After the clean-up; the error's notes say whether the joint is at rest and where the
            recording is.
        """
        evidence: AxisEvidence | None = None
        failure: BaseException | None = None
        try:
            with unhurried_collector():
                evidence = self._axis.open()
                self._drive(evidence)
        except BaseException as error:  # noqa: BLE001 - re-raised below, after the clean-up
            failure = error
            self._stopped_because = str(error) or type(error).__name__
        self.aftermath = aftermath = tear_down(
            self._axis,
            self._clock,
            has_torque=self._torque_asked and failure is not None,
            keep=self._keep,
            finish=self._finish,
        )
        return conclude(
            failure, aftermath, evidence, what="cycle", moved=self._torque_asked or failure is None
        )

    # -- the loop ----------------------------------------------------------------------------

    def _drive(self, evidence: AxisEvidence) -> None:
        # First, because it is slow: from the first SYNC on, the drive watches our heartbeat.
        self._writer = self._open_recording(evidence)
        seen = self._observe()
        insist(at_standstill(self.plan, seen))
        if evidence.set_points is not SetPoints.MOVE:  # a drive's own moves end by themselves
            self._prove(self._writer)
        interlock = Interlock().after(Event.PREFLIGHT_PASSED)
        sequence = CycleSequence(self.plan, interlock, seen[-1], evidence.set_points)
        self._recorder = Recorder(
            self._writer,
            with_temperature=self.plan.limits.temperature_required,
            with_probe=self.plan.temperature_beside_drive,
        )
        report_every = max(1, round(0.1 / self.plan.tick_s))
        self._torque_asked = True
        for tick, now_s in enumerate(ticks(self._clock, self.plan.tick_s)):
            samples = self._axis.receive()
            self._recorder.keep(samples)
            reason = self._stop_requested()
            if reason is not None:
                raise sequence.trip_as_asked(reason)
            step = sequence.cycle(now_s, samples)
            if sequence.done:
                self._torque_asked = False
                self._progress(Stage.DONE.value, 1.0)
                return
            self._recorder.sent(now_s, step)
            held_up_s = self._clock.now() - now_s
            if held_up_s > self.plan.limits.sample_age_max_s:  # frozen, or asleep, since it looked
                raise sequence.trip(
                    f"the computer stood still for {held_up_s:.2f} s in the middle of a tick",
                    "See what else this computer does, and whether it went to sleep.",
                )
            self._axis.send(step.command)
            if tick % report_every == 0:
                self._progress(sequence.stage.value, sequence.progress)

    def _prove(self, writer: Writer) -> None:
        """Refuse a drive that does not stop by itself when nobody feeds its watchdog."""
        if self._prove_watchdog is None:
            return
        self._progress("prove", 0.0)
        self._torque_asked = True
        proof = self._prove_watchdog(
            self.plan.limits.velocity_error_max_rad_s,
            self.plan.transition_timeout_s,
            self._stop_if_asked,
        )
        self._torque_asked = False
        writer.note(proof)
        insist((watchdog_proven(proof),))

    def _stop_if_asked(self) -> None:
        reason = self._stop_requested()
        if reason is not None:
            raise StoppedError(f"Stopped before anything moved: {reason}.")

    def _observe(self) -> list[Sample]:
        """Return what the drive says during a fifth of a second without torque."""
        seen: list[Sample] = []
        start_s = self._clock.now()
        for now_s in ticks(self._clock, self.plan.tick_s):
            seen += self._axis.receive()
            span_s = seen[-1].time_s - seen[0].time_s if seen else 0.0
            self._stop_if_asked()
            if span_s >= OBSERVE_S or now_s - start_s > OBSERVE_TIMEOUT_S:
                return seen
            self._axis.send(OFF)
        return seen

    # -- what the clean-up calls -------------------------------------------------------------

    def _keep(self, samples: tuple[Sample, ...]) -> None:
        if self._recorder is not None and self._writer is not None:
            self._writer.wait_for_disk()
            self._recorder.keep(samples)

    def _finish(self, account: SyncAccount | None) -> Path | None:
        if self._writer is None:
            return None
        if account is not None and self._recorder is not None:
            account = self._recorder.located(account)
        return self._writer.finish(account=account, stopped_because=self._stopped_because)
