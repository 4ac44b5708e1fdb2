"""The composition root: a cell's description becomes buses, axes and recordings.

Alone in importing the drivers' classes. Nothing is built before `drive_cycle` is called.
"""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from agent.cell import Axis, Bus, Cell
from agent.cycle.plan import CyclePlan, plan_cycle
from agent.cycle.preflight import before_the_bus, insist
from agent.cycle.runner import CycleResult, CycleRunner, Progress, columns
from agent.record.recording import Metadata
from agent.record.stream import StreamWriter
from drivers.can.owner import CanBusConfig, CanBusOwner
from drivers.cia402.axis import Cia402Axis
from drivers.cia402.config import Cia402Config, ExpectedIdentity
from drivers.cia402.scaling import Scaling, TemperatureSource
from drivers.clock import Clock, wall_time_utc
from drivers.ports import AxisEvidence


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
    """

    cell: Cell
    axis: Axis
    folder: Path
    reverse: bool = False


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
    plan = plan_cycle(cell, axis, reverse=request.reverse)
    insist(before_the_bus(cell, axis, plan, request.folder))
    owner = CanBusOwner.open(bus_config(cell.bus), clock)
    try:
        return CycleRunner(
            plan,
            Cia402Axis(owner, drive_config(cell, axis), clock),
            clock,
            open_recording=lambda evidence: _RunWriter(request, plan, evidence),
            stop_requested=stop_requested,
            progress=progress,
        ).run()
    finally:
        owner.close()


def bus_config(bus: Bus) -> CanBusConfig:
    """Return the drivers' description of the cell's bus."""
    return CanBusConfig(bus.interface, bus.channel, bus.bitrate, bus.options)


def drive_config(cell: Cell, axis: Axis) -> Cia402Config:
    """Return the drivers' description of an axis: everything explicit, nothing guessed."""
    drive, limits, supervision = axis.drive, axis.limits, axis.supervision
    motor = axis.motor_limits
    temperature = drive.gearbox_temperature
    return Cia402Config(
        node_id=drive.node_id,
        scaling=Scaling(
            encoder_counts_per_motor_rev=drive.encoder_counts_per_motor_rev,
            rated_torque_nm=drive.rated_torque_nm,
            velocity_unit=drive.velocity_unit,
            direction=drive.direction,
            zero_position_counts=drive.zero_position_counts,
        ),
        acceleration_rad_s2=limits.motor_acceleration_max_rad_s2,
        deceleration_rad_s2=limits.motor_acceleration_max_rad_s2,
        quick_stop_deceleration_rad_s2=limits.stopping_deceleration_rad_s2,
        software_limits_rad=(motor.position_min_rad, motor.position_max_rad),
        expected=ExpectedIdentity(drive.vendor_id, drive.product_code, drive.serial),
        temperature=None
        if temperature is None
        else TemperatureSource(
            index=temperature.index,
            subindex=temperature.subindex,
            scale_degc=temperature.degc_per_count,
            offset_degc=temperature.offset_degc,
            sentinels=temperature.no_sensor_counts,
        ),
        agent_node_id=supervision.agent_node_id,
        agent_heartbeat_period_s=supervision.heartbeat_period_s,
        agent_heartbeat_timeout_s=supervision.heartbeat_timeout_s,
        drive_heartbeat_period_s=supervision.drive_heartbeat_period_s,
        drive_heartbeat_timeout_s=3.5 * supervision.drive_heartbeat_period_s,
        sync_timeout_s=supervision.sample_age_max_s,
        consecutive_lost_limit=supervision.samples_lost_in_a_row_max,
        stop_period_s=1.0 / cell.recording.sample_rate_hz,
    )


def software() -> str:
    """Return name and version of this product, as recordings carry it."""
    return f"stribeck {importlib.metadata.version('stribeck')}"


class _RunWriter:
    """The runner's writer: a stream that becomes one recording with its metadata."""

    def __init__(self, request: CycleRequest, plan: CyclePlan, evidence: AxisEvidence) -> None:
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
                "rated_torque_nm": axis.drive.rated_torque_nm,
                "torque_source": "0x6077, per mille of rated torque",
                "settings": dict(evidence.settings),
            },
            software=software(),
            extra={"gearbox_serial": axis.gearbox_serial} if axis.gearbox_serial else {},
        )
        self._stream = StreamWriter(
            request.folder,
            f"{cell.robot}-axis{axis.number}-{stamp}-{plan.trajectory.name}",
            metadata,
            columns(with_temperature=plan.limits.temperature_required),
        )
        self.append = self._stream.append

    def finish(self, *, samples_lost: int, stopped_because: str) -> Path | None:
        """Finish the stream; where nothing was recorded, leave no file."""
        if self._stream.samples == 0:
            self._stream.abandon()
            return None
        changes = {"stopped_because": stopped_because} if stopped_because else {}
        return self._stream.finish(samples_lost, changes)
