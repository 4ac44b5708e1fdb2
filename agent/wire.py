"""The composition root: a cell's description becomes buses, axes and recordings.

Alone in importing the drivers' classes. Nothing is built before `drive_cycle` is called.
"""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from agent.acquisition import KEY as ACQUISITION
from agent.acquisition import Acquisition
from agent.cell import Axis, Bus, Cell
from agent.cycle.axis_lock import leave_word, owned
from agent.cycle.ending import CycleResult
from agent.cycle.job import JobRunner, job_columns
from agent.cycle.permission import permitted
from agent.cycle.plan import CyclePlan, plan_cycle
from agent.cycle.preflight import before_the_bus, insist
from agent.cycle.recorder import columns
from agent.cycle.runner import CycleRunner, Progress
from agent.errors import AgentError, InputError
from agent.record.atomic import publish, storage_error
from agent.record.recording import Metadata
from agent.record.rows import Kind
from agent.record.stream import StreamWriter
from agent.replayed import KEY as REPLAY
from agent.wire_devices import cell_release, job_controller, permit_wait_s, with_probe
from agent.wire_drive import drive_config, watched_configs
from agent.wire_replay import Replay, open_replay
from drivers.can.owner import CanBusConfig, CanBusOwner
from drivers.cia402.axis import Cia402Axis
from drivers.cia402.handing_back import restore
from drivers.cia402.watching import WatchedAxes
from drivers.clock import Clock, SteppedClock, wall_time_utc
from drivers.errors import DriverError
from drivers.ports import AxisEvidence, SyncAccount, WatchdogProof
from trajectories import Trajectory

PROBE_KINDS: Mapping[str, Kind] = {"gearbox_temperature_quality": "text"}


@dataclass(frozen=True)
class CycleRequest:
    """One cycle that somebody has asked for.

    Parameters
    ----------
    cell, axis : Cell, Axis
        Whose joint.
    folder : pathlib.Path
        Where the recording goes.
    reverse : bool
        Whether to drive the reversed stair (validation run).
    trajectory : Trajectory, optional
        What to drive in place of the cell's stair; it passes the same checks and the same gate.
    journal_folder : pathlib.Path, optional
        Where a killed run leaves how it had found the drive. The same for every run of a cell,
        wherever its recordings go, or the next run would not find it; `folder` unless given.
    """

    cell: Cell
    axis: Axis
    folder: Path
    reverse: bool = False
    trajectory: Trajectory | None = None
    journal_folder: Path | None = None


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
    if axis.job is not None:
        return _run_job(request, plan, clock, stop_requested, progress)
    if cell.bus.replays:
        return _run_replay(request, plan, clock, stop_requested, progress)
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
    config = drive_config(cell, axis)
    journal = _Journal(
        (request.journal_folder or request.folder) / f".{cell.robot}-axis{axis.number}.found.json"
    )
    left_behind = journal.read()
    if left_behind:
        restore(owner, config, clock, left_behind)
        journal.clear()
    release, wait_s = cell_release(cell, owner, clock), permit_wait_s(cell)
    with permitted(release, clock, stop_requested, wait_s=wait_s) as reason_to_stop:
        drive = Cia402Axis(owner, config, clock, journal.write)
        beside = watched_configs(cell, axis)
        watching = WatchedAxes(drive, owner, clock, beside) if beside else drive
        probed = with_probe(watching, axis, owner, clock)
        runner = CycleRunner(
            plan,
            probed.axis,
            clock,
            open_recording=lambda evidence: _RunWriter(
                request,
                plan,
                evidence,
                probed.source(),
                in_real_time=not isinstance(clock, SteppedClock),
            ),
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
            open_recording=lambda evidence: _RunWriter(
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
        open_recording=lambda evidence: _RunWriter(
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


def bus_config(bus: Bus) -> CanBusConfig:
    """Return the drivers' description of the cell's bus."""
    return CanBusConfig(
        bus.interface, bus.channel, bus.bitrate, bus.options, fast_reader=bus.fast_reader
    )


def software() -> str:
    """Return name and version of this product, as recordings carry it."""
    return f"stribeck {importlib.metadata.version('stribeck')}"


def _columns(axis: Axis, plan: CyclePlan) -> tuple[str, ...]:
    """Return the columns of this axis's recordings, as its runner writes them."""
    with_temperature = plan.limits.temperature_required
    if axis.job is not None:
        return job_columns(with_temperature=with_temperature)
    return columns(with_temperature=with_temperature, with_probe=plan.temperature_beside_drive)


def _torque_source(axis: Axis) -> dict[str, object]:
    """Return where the torque comes from and what scales it."""
    if axis.job is not None:
        return {"torque_source": "the controller's own, motor side, N m"}
    return {
        "rated_torque_nm": axis.drive.rated_torque_nm,
        **_known(profile=axis.drive.profile),
        "torque_source": "0x6077, per mille of rated torque",
    }


def _known(**values: object) -> dict[str, object]:
    """Return what is known of `values`, to go into a recording's metadata."""
    return {name: value for name, value in values.items() if value}


class _Journal:
    """What a drive was set to before it was overwritten, kept until it has been given back.

    A run that is killed leaves this file; the next one on the axis restores the drive from it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def write(self, found: Mapping[str, int]) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        publish({self._path: json.dumps(dict(found), indent=1).encode()}, overwrite=True)

    def read(self) -> dict[str, int]:
        try:
            found = json.loads(self._path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            raise InputError(
                f"{self._path} should say how a killed run had found the drive, and cannot be "
                f"read: {error}.",
                "Compare the drive with its parameter file, then remove this file.",
            ) from error
        return {str(key): int(value) for key, value in found.items()}

    def clear(self) -> None:
        self._path.unlink(missing_ok=True)


class _RunWriter:
    """The runner's writer: a stream that becomes one recording with its metadata."""

    def __init__(
        self,
        request: CycleRequest,
        plan: CyclePlan,
        evidence: AxisEvidence,
        temperature_source: Mapping[str, str | int | float],
        *,
        in_real_time: bool,
        replay: Replay | None = None,
    ) -> None:
        self._replay = replay
        cell, axis = request.cell, request.axis
        started_at = wall_time_utc()
        stamp = started_at.replace("-", "").replace(":", "").replace(".", "")
        metadata = Metadata(
            robot=cell.robot,
            axis=axis.number,
            gear_ratio=axis.gear_ratio,
            started_at=started_at,
            trajectory={
                "name": plan.trajectory.name,
                "parameters": plan.trajectory.to_json()["parameters"],
            },
            payload_kg=axis.payload_kg,
            drive={
                **evidence.identity,
                **(_torque_source(axis) if replay is None else replay.torque_source),
                "settings": dict(evidence.settings),
                **_known(mode=evidence.mode, mode_reason=evidence.mode_reason),
            },
            software=software(),
            extra=_known(
                watched=[config.name for config in watched_configs(cell, axis)]
                if axis.drive_ is not None
                else [],
                gearbox_serial=axis.gearbox_serial,
                temperature_source=dict(temperature_source),
            ),
        )
        self._stream = StreamWriter(
            request.folder,
            f"{cell.robot}-axis{axis.number}-{stamp}-{plan.trajectory.name}"
            + ("-reversed" if request.reverse else ""),
            metadata,
            _columns(axis, plan),
            kinds=PROBE_KINDS if plan.temperature_beside_drive else None,
            background=in_real_time,
        )
        self.append = self._stream.append
        self._proof: WatchdogProof | None = None

    def note(self, proof: WatchdogProof) -> None:
        self._proof = proof

    def finish(self, *, account: SyncAccount | None, stopped_because: str) -> Path | None:
        """Finish the stream; where nothing was recorded, leave no file."""
        if self._stream.samples == 0:
            self._stream.abandon()
            return None
        changes: dict[str, object] = {}
        if stopped_because:
            changes["stopped_because"] = stopped_because
        if self._proof is not None:
            changes["watchdog"] = {
                "proven": self._proof.reacted,
                **{k: v for k, v in asdict(self._proof).items() if k != "reacted"},
            }
        if self._replay is not None:
            changes[REPLAY] = self._replay.played().to_json()
        if account is None:
            return self._stream.finish(None, changes)
        changes[ACQUISITION] = Acquisition(**asdict(account)).to_json()
        return self._stream.finish(account.lost, changes)
