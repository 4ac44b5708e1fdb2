"""Runs one cycle: opens the axis, steps the sequence on the clock, records, always cleans up.

The loop is one tick after the other: take what has arrived, let the sequence decide, send, record,
wait. Nothing else sends; if this loop hangs, the heartbeat stops with it and the drive stops the
joint by itself.
"""

from __future__ import annotations

import contextlib
import gc
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from agent.cycle.interlock import Event, Interlock
from agent.cycle.plan import CyclePlan
from agent.cycle.preflight import at_standstill, insist, watchdog_proven
from agent.cycle.sequence import OFF, Stage, Step
from agent.cycle.sequence import Sequence as CycleSequence
from agent.cycle.teardown import Aftermath, tear_down
from agent.errors import StoppedError
from drivers.clock import Clock
from drivers.ports import Axis, AxisEvidence, Sample, SetPoints, SyncAccount, WatchdogProof

OBSERVE_S = 0.2
OBSERVE_TIMEOUT_S = 2.0

PROBE_COLUMNS = ("gearbox_temperature_age_s", "gearbox_temperature_quality")
"""What a recording has besides where another device than the drive measures a temperature."""

Progress = Callable[[str, float], None]

ProveWatchdog = Callable[[float, float, Callable[[], None]], WatchdogProof]
"""Given the speed of a joint that moves, the patience for enabling, and whom to ask at each look.

It has torque on the joint for half a second, at standstill.
"""


class Writer(Protocol):
    """What the runner needs of a recording that is being written."""

    def append(self, row: Sequence[float | str]) -> None:
        """Keep one row, in the order of the columns that it was opened with."""
        ...

    def note(self, proof: WatchdogProof) -> None:
        """Keep the proof of the drive's watchdog with the recording."""
        ...

    def finish(self, *, account: SyncAccount | None, stopped_because: str) -> Path | None:
        """Close the recording and return its file; None where nothing was recorded.

        `account` says what became of every sample; None where that could not be learnt.
        """
        ...


@dataclass(frozen=True)
class CycleResult:
    """A cycle that ran to its end."""

    recording: Path
    evidence: AxisEvidence
    account: SyncAccount


@dataclass(frozen=True)
class _Sent:
    """What was sent in one tick, to label the sample that answers it."""

    time_s: float
    step: Step


class _Recorder:
    """Joins each sample with the set-points of its own tick and hands the row to the writer."""

    def __init__(self, writer: Writer, *, with_temperature: bool, with_probe: bool) -> None:
        self._writer = writer
        self._with_temperature = with_temperature
        self._with_probe = with_probe
        self._sent: deque[_Sent] = deque()
        self._origin_s: float | None = None

    def sent(self, time_s: float, step: Step) -> None:
        self._sent.append(_Sent(time_s, step))

    def keep(self, samples: Sequence[Sample]) -> None:
        """Record samples; one from before the first set-point was sent is not part of the run."""
        for sample in samples:
            while len(self._sent) > 1 and self._sent[1].time_s <= sample.time_s:
                self._sent.popleft()
            if not self._sent or sample.time_s < self._sent[0].time_s:
                continue
            if self._origin_s is None:
                self._origin_s = sample.time_s
            step = self._sent[0].step
            row: list[float | str] = [
                sample.time_s - self._origin_s,
                sample.position_rad,
                sample.velocity_rad_s,
                sample.torque_nm,
                step.command.velocity_rad_s,
                step.position_command_rad,
                step.phase,
            ]
            if self._with_temperature:
                row.append(sample.gearbox_temperature_degc)
            if self._with_probe:
                row.append(sample.gearbox_temperature_age_s)
                row.append(sample.gearbox_temperature_quality.value)
            self._writer.append(row)


def columns(*, with_temperature: bool, with_probe: bool = False) -> tuple[str, ...]:
    """Return the columns of a recording in the order in which the runner writes them.

    Parameters
    ----------
    with_temperature : bool
        Whether the gearbox temperature is measured.
    with_probe : bool
        Whether a device beside the drive measures it: its readings have an age and a quality.
    """
    names: tuple[str, ...] = (
        "time_s",
        "position_rad",
        "velocity_rad_s",
        "torque_nm",
        "velocity_command_rad_s",
        "position_command_rad",
        "phase",
    )
    if with_temperature:
        names = (*names, "gearbox_temperature_degc")
    return (*names, *PROBE_COLUMNS) if with_probe else names


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
        self._recorder: _Recorder | None = None
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
            with _unhurried_collector():
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
        if failure is not None:
            annotate(failure, aftermath, moved=self._torque_asked)
            raise failure
        if aftermath.problems:
            problem = StoppedError(
                f"The cycle ran to its end, but: {'; '.join(aftermath.problems)}."
            )
            annotate(problem, aftermath, moved=True)
            raise problem
        if aftermath.recording is None or aftermath.account is None or evidence is None:
            raise AssertionError("a cycle that ran to its end has a recording and an account")
        return CycleResult(aftermath.recording, evidence, aftermath.account)

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
        self._recorder = _Recorder(
            self._writer,
            with_temperature=self.plan.limits.temperature_required,
            with_probe=self.plan.temperature_beside_drive,
        )
        report_every = max(1, round(0.1 / self.plan.tick_s))
        self._torque_asked = True
        for tick, now_s in enumerate(self._ticks()):
            samples = self._axis.receive()
            self._recorder.keep(samples)
            reason = self._stop_requested()
            if reason is not None:
                raise sequence.trip(reason)
            step = sequence.cycle(now_s, samples)
            if sequence.done:
                self._torque_asked = False
                self._progress(Stage.DONE.value, 1.0)
                return
            self._recorder.sent(now_s, step)
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
        for now_s in self._ticks():
            seen += self._axis.receive()
            span_s = seen[-1].time_s - seen[0].time_s if seen else 0.0
            self._stop_if_asked()
            if span_s >= OBSERVE_S or now_s - start_s > OBSERVE_TIMEOUT_S:
                return seen
            self._axis.send(OFF)
        return seen

    def _ticks(self) -> Iterator[float]:
        """Yield the present time once per tick; ticks that were missed are not caught up."""
        due_s = self._clock.now()
        while True:
            now_s = self._clock.now()
            yield now_s
            due_s += self.plan.tick_s
            if due_s < self._clock.now():
                due_s = self._clock.now()
            self._clock.sleep_until(due_s)

    # -- what the clean-up calls -------------------------------------------------------------

    def _keep(self, samples: tuple[Sample, ...]) -> None:
        if self._recorder is not None:
            self._recorder.keep(samples)

    def _finish(self, account: SyncAccount | None) -> Path | None:
        if self._writer is None:
            return None
        return self._writer.finish(account=account, stopped_because=self._stopped_because)


@contextlib.contextmanager
def _unhurried_collector() -> Iterator[None]:
    """Keep the garbage collector out of the control loop: one full pass can take 0.2 s."""
    enabled = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if enabled:
            gc.enable()


def annotate(error: BaseException, aftermath: Aftermath, *, moved: bool) -> None:
    """Add to `error` what a technician must know after a cycle that did not end well."""
    if moved:
        error.add_note(
            "The joint is at rest (measured)."
            if aftermath.at_rest
            else "The joint was NOT seen to come to rest: use the E-stop before you go near it."
        )
    for problem in aftermath.problems:
        error.add_note(problem if problem.endswith(".") else f"{problem}.")
    if not aftermath.restored:
        error.add_note(
            "The drive's settings were not all restored; the next run will restore them."
        )
    if aftermath.recording is not None:
        error.add_note(f"What had been recorded is kept in {aftermath.recording}.")
