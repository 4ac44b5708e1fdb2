"""A drive's description for the drivers: the cell's own words first, then its profile's.

A part of the composition root.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from agent.cell.cell import REPLAY, Axis, Bus, Cell, Drive
from agent.cycle.plan import CyclePlan
from agent.errors import InputError
from drivers.can.owner import CanBusConfig
from drivers.cia402.config import Cia402Config, ExpectedIdentity
from drivers.cia402.scaling import Scaling, TemperatureSource, VelocityUnit
from drivers.cia402.watching import WatchedConfig
from drivers.profiles.drive_profile import DriveProfile, DriveProfileError, load_profile

REST_S = 0.2
"""How long a joint must stand before it is believed: two periods of a soft arm's ringing."""

WATCHED_MOTION_ARM_DEG = 0.2
"""How far an arm beside the one under test may move: it gives way a little, and its brake too."""

QUICK_STOP_ON_LOSS = 3
"""For 0x6007: what the drive shall do when it no longer hears us."""

CATCHING_UP = 1.05
"""Times the steepest ramp that is streamed: what the drive may ramp by, to make up for rounding."""

LONGEST_BRAKING_S = 0.5
"""From a cycle's fastest speed: a drive that ignores a quick stop brakes by 0x6084."""


@dataclass(frozen=True)
class _Abilities:
    """What a drive can, and lacks."""

    velocity_unit: VelocityUnit
    software_limits: bool
    heartbeat_consumer: bool
    abort_connection: bool
    quick_stop_option: int | None
    deceleration: bool
    quick_stop_deceleration: bool
    offered_modes: tuple[str, ...] | None


def _abilities(drive: Drive) -> _Abilities:
    """Return what the cell says, what its profile says else, and CiA 402's own where neither does.

    Raises
    ------
    agent.errors.InputError
        There is no such profile, or it has mistakes.
    """
    profile = _profile(drive)
    says = drive.model_fields_set
    unit = drive.velocity_unit
    if profile is None:
        return _Abilities(
            velocity_unit=unit,
            software_limits=drive.software_limits is not False,
            heartbeat_consumer=drive.heartbeat_consumer is not False,
            abort_connection=drive.abort_connection is not False,
            quick_stop_option=2,
            deceleration=True,
            quick_stop_deceleration=True,
            offered_modes=None,
        )
    if profile.velocity is not None and "velocity_unit" not in says:
        unit = profile.velocity.unit.value
    watchdog, ramps = profile.watchdog, profile.ramps
    option = watchdog.quick_stop_option.value
    return _Abilities(
        velocity_unit=unit,
        software_limits=_first(drive.software_limits, profile.position.software_limits.value),
        heartbeat_consumer=_first(drive.heartbeat_consumer, watchdog.heartbeat_consumer.value),
        abort_connection=_first(drive.abort_connection, watchdog.abort_connection.value),
        quick_stop_option=None if option == "absent" else option,
        deceleration=ramps is None or ramps.deceleration.value,
        quick_stop_deceleration=ramps is None or ramps.quick_stop_deceleration.value,
        offered_modes=tuple(profile.modes.offered.value),
    )


def _first(said: bool | None, otherwise: bool) -> bool:
    return otherwise if said is None else said


def _profile(drive: Drive) -> DriveProfile | None:
    """Return the profile that the cell names for a drive."""
    if drive.profile is None:
        return None
    try:
        return load_profile(drive.profile)
    except DriveProfileError as error:
        raise InputError(str(error)) from error


def watched_configs(cell: Cell, axis: Axis) -> tuple[WatchedConfig, ...]:
    """Return the drivers' description of the other axes' drives on the bus that are watched.

    A recording that is played has no others.
    """
    if cell.bus.interface == REPLAY:
        return ()
    return tuple(
        WatchedConfig(
            node_id=other.drive.node_id,
            name=f"axis {other.number}",
            motion_max_counts=WATCHED_MOTION_ARM_DEG
            / 360.0
            * other.gear_ratio
            * other.drive.encoder_counts_per_motor_rev,
        )
        for other in cell.axis
        if other.number != axis.number and other.drive_ is not None and other.drive.watched
    )


def bus_config(bus: Bus) -> CanBusConfig:
    """Return the drivers' description of the cell's bus."""
    return CanBusConfig(
        bus.interface, bus.channel, bus.bitrate, bus.options, fast_reader=bus.fast_reader
    )


def drive_config(cell: Cell, axis: Axis) -> Cia402Config:
    """Return the drivers' description of an axis: everything explicit, nothing guessed."""
    drive, limits, supervision = axis.drive, axis.limits, axis.supervision
    able = _abilities(drive)
    motor = axis.motor_limits
    temperature = drive.gearbox_temperature
    return Cia402Config(
        node_id=drive.node_id,
        scaling=Scaling(
            encoder_counts_per_motor_rev=drive.encoder_counts_per_motor_rev,
            rated_torque_nm=drive.rated_torque_nm,
            velocity_unit=able.velocity_unit,
            direction=drive.direction,
            zero_position_counts=drive.zero_position_counts,
        ),
        acceleration_rad_s2=limits.motor_acceleration_max_rad_s2,
        deceleration_rad_s2=limits.motor_acceleration_max_rad_s2,
        quick_stop_deceleration_rad_s2=limits.stopping_deceleration_rad_s2,
        software_limits_rad=(motor.position_min_rad, motor.position_max_rad)
        if able.software_limits
        else None,
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
        abort_connection_option=QUICK_STOP_ON_LOSS if able.abort_connection else None,
        quick_stop_option=able.quick_stop_option,
        heartbeat_consumer_subindex=1 if able.heartbeat_consumer else None,
        offered_modes=able.offered_modes,
        agent_node_id=supervision.agent_node_id,
        agent_heartbeat_period_s=supervision.heartbeat_period_s,
        agent_heartbeat_timeout_s=supervision.heartbeat_timeout_s,
        drive_heartbeat_period_s=supervision.drive_heartbeat_period_s,
        drive_heartbeat_timeout_s=3.5 * supervision.drive_heartbeat_period_s,
        # Lost must be said before the gate finds the newest sample too old.
        sync_timeout_s=0.5 * supervision.sample_age_max_s,
        consecutive_lost_limit=supervision.samples_lost_in_a_row_max,
        rest_samples=max(5, round(REST_S * cell.recording.sample_rate_hz)),
        stop_period_s=1.0 / cell.recording.sample_rate_hz,
        mode=drive.mode,
        move_acceleration_rad_s2=axis.stair.motor_acceleration_rad_s2,
        velocity_max_rad_s=limits.motor_velocity_max_rad_s,
        has_deceleration=able.deceleration,
        has_quick_stop_deceleration=able.quick_stop_deceleration,
        says_encoder_resolution=drive.encoder_resolution,
    )


def ramping_with(plan: CyclePlan, config: Cia402Config) -> Cia402Config:
    """Return the drive's description with ramps as steep as what is streamed to it, no steeper.

    Between two set-points the drive ramps by itself. With the axis's limit it is at each in half of
    the time and waits: its velocity goes up in steps, and a torque that is read at the same moment
    of each step is none of the motion's (the inertia of `stribeck demo` came out 0.3 % too large).

    It brakes to rest in half a second all the same, or as fast as the axis may: one that
    ignores a quick stop, and is told a velocity of zero with it, has no other ramp.
    """
    segments = plan.trajectory.segments
    steepest = max(abs(segment.peak_acceleration_rad_s2) for segment in segments)
    fastest = max(abs(segment.velocity_end_rad_s) for segment in segments)
    ramp = CATCHING_UP * max(steepest, plan.approach.acceleration_rad_s2)
    brake = max(ramp, max(fastest, plan.approach.velocity_rad_s) / LONGEST_BRAKING_S)
    limit = config.acceleration_rad_s2
    ramp, brake = min(ramp, limit), min(brake, config.deceleration_rad_s2)
    return replace(
        config,
        acceleration_rad_s2=ramp if config.has_deceleration else brake,
        deceleration_rad_s2=brake,
    )
