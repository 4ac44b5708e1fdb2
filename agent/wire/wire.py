"""The composition root: a cell's description becomes buses, axes and recordings.

Alone in importing the drivers' classes. Nothing is built before `drive_cycle` is called.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace

from agent import given_back
from agent.cycle.axis_lock import leave_word, owned
from agent.cycle.ending import CycleResult
from agent.cycle.job import JobRunner
from agent.cycle.permission import permitted
from agent.cycle.plan import CyclePlan, plan_cycle
from agent.cycle.precedence import before_others
from agent.cycle.preflight import before_the_bus, insist
from agent.cycle.runner import CycleRunner, Progress
from agent.errors import AgentError, InputError
from agent.record.atomic import storage_error
from agent.wire.devices import cell_release, job_controller, permit_wait_s, with_probe
from agent.wire.drive import bus_config, drive_config, ramping_with, watched_configs
from agent.wire.replay import open_replay
from agent.wire.request import CycleRequest
from agent.wire.writing import Journal, LastUnits, RunWriter
from drivers.can.owner import CanBusOwner
from drivers.cia402.axis import Cia402Axis
from drivers.cia402.handing_back import restore
from drivers.cia402.watching import WatchedAxes
from drivers.clock import Clock, SteppedClock
from drivers.errors import DriverError
from drivers.ports import AxisEvidence

__all__ = ["CycleRequest", "drive_cycle"]


def drive_cycle(
    request: CycleRequest,
    clock: Clock,
    *,
    stop_requested: Callable[[], str | None] = lambda: None,
    progress: Progress = lambda _stage, _share: None,
) -> CycleResult:
    """Drive one cycle: preflight, bus, cycle, recording; the bus is closed again on every way out.

    Raises
    ------
    agent.errors.RefusedError, agent.errors.StoppedError, drivers.errors.DriverError
        With notes on what became of the joint and of the recording.
    """
    cell, axis = request.cell, request.axis
    plan = plan_cycle(cell, axis, reverse=request.reverse, trajectory=request.trajectory)
    with owned(cell, axis) as no_other_owner:
        insist((*before_the_bus(cell, axis, plan, request.folder), no_other_owner))
        try:
            request.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise storage_error(error, f"The folder {request.folder} cannot be made") from error
        progress("connect", 0.0)  # whatever is slow about showing it, is slow before a joint moves
        try:
            return _run(request, plan, clock, stop_requested, progress)
        except (AgentError, DriverError) as error:
            leave_word(cell, axis, " ".join([str(error), *getattr(error, "__notes__", ())]))
            raise


def _run(
    request: CycleRequest,
    plan: CyclePlan,
    clock: Clock,
    stop_requested: Callable[[], str | None],
    progress: Progress,
) -> CycleResult:
    """Let the axis be driven by whoever the cell says drives it."""
    cell, axis = request.cell, request.axis
    if axis.job is None and cell.bus.replays:
        return _run_replay(request, plan, clock, stop_requested, progress)
    # stepped time takes all the processor that it gets, and nothing in it can be late
    in_turn = contextlib.nullcontext() if isinstance(clock, SteppedClock) else before_others()
    with in_turn:
        if axis.job is not None:
            return _run_job(request, plan, clock, stop_requested, progress)
        owner = CanBusOwner.open(bus_config(cell.bus), clock)
        try:
            return _run_drive(request, plan, owner, clock, stop_requested, progress)
        finally:
            owner.close()


def _run_drive(
    request: CycleRequest,
    plan: CyclePlan,
    owner: CanBusOwner,
    clock: Clock,
    stop_requested: Callable[[], str | None],
    progress: Progress,
) -> CycleResult:
    """Drive the axis by its drive on the bus, after giving back what a killed run has left."""
    cell, axis = request.cell, request.axis
    config = ramping_with(plan, drive_config(cell, axis))
    kept = (request.journal_folder or request.folder) / f".{cell.robot}-axis{axis.number}"
    journal = Journal(kept.with_name(kept.name + given_back.JOURNAL_SUFFIX))
    last_units = LastUnits(kept.with_name(f"{kept.name}.units.json"), config.scaling)
    left_behind = journal.read()
    if left_behind:
        restore(owner, config, clock, left_behind)
        journal.clear()
    config = replace(config, expected_units=last_units.read())
    release, wait_s = cell_release(cell, owner, clock), permit_wait_s(cell)
    with (
        given_back.noted(left_behind),
        permitted(release, clock, stop_requested, wait_s=wait_s) as reason_to_stop,
    ):
        drive = Cia402Axis(owner, config, clock, journal.write)
        beside = watched_configs(cell, axis)
        watching = WatchedAxes(drive, owner, clock, beside) if beside else drive
        probed = with_probe(watching, axis, owner, clock)

        def open_recording(evidence: AxisEvidence) -> RunWriter:
            last_units.write(evidence.units)
            in_real_time = not isinstance(clock, SteppedClock)
            return RunWriter(
                request,
                plan,
                evidence,
                probed.source(),
                in_real_time=in_real_time,
                left_behind=left_behind,
            )

        runner = CycleRunner(
            plan,
            probed.axis,
            clock,
            open_recording=open_recording,
            prove_watchdog=lambda still_rad_s, patience_s, watch: drive.prove_watchdog(
                still_rad_s=still_rad_s, patience_s=patience_s, watch=watch
            ),
            stop_requested=reason_to_stop,
            progress=progress,
        )
        try:
            return runner.run()
        finally:
            if runner.aftermath is not None and runner.aftermath.restored:
                journal.clear()


def _run_job(
    request: CycleRequest,
    plan: CyclePlan,
    clock: Clock,
    stop_requested: Callable[[], str | None],
    progress: Progress,
) -> CycleResult:
    """Let a controller that drives the axis by itself run the stair."""
    if request.trajectory is not None:
        raise InputError(
            "A controller that runs the stair itself drives the cell's own stair only.",
            "Leave --trajectory out, or put its numbers into [axis.stair].",
        )
    release, wait_s = cell_release(request.cell, None, clock), permit_wait_s(request.cell)
    with permitted(release, clock, stop_requested, wait_s=wait_s) as reason_to_stop:
        return JobRunner(
            plan,
            job_controller(request.axis, clock, reverse=request.reverse),
            clock,
            open_recording=lambda evidence: RunWriter(
                request, plan, evidence, {}, in_real_time=not isinstance(clock, SteppedClock)
            ),
            stop_requested=reason_to_stop,
            progress=progress,
        ).run()


def _run_replay(
    request: CycleRequest,
    plan: CyclePlan,
    clock: Clock,
    stop_requested: Callable[[], str | None],
    progress: Progress,
) -> CycleResult:
    """Play a recording as the axis; no device is reached: no probe, and no release is asked for."""
    replay = open_replay(request.cell, request.axis, clock)
    return CycleRunner(
        plan,
        replay.axis,
        clock,
        open_recording=lambda evidence: RunWriter(
            request,
            plan,
            evidence,
            {},
            in_real_time=not isinstance(clock, SteppedClock),
            replay=replay,
        ),
        stop_requested=stop_requested,
        progress=progress,
    ).run()
