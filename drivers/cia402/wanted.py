"""What a drive is to be set to for a run, by its configuration and mode.

PDOs, ramps, limits and watchdog, as values alone: `drivers.cia402.settings` reads and writes them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.modes import Rung
from drivers.cia402.objects import DriveObject
from drivers.cia402.pdo import AT_ONCE, EVERY_SYNC, PdoMap
from drivers.cia402.words import Mode
from drivers.errors import ConfigurationError
from drivers.ports import SetPoints


@dataclass(frozen=True)
class ProcessData:
    """The PDOs of one axis: orders in (the first with the controlword), answers to every SYNC."""

    orders: tuple[PdoMap, ...]
    answers: tuple[PdoMap, ...]

    @property
    def all(self) -> tuple[PdoMap, ...]:
        """Return every PDO in the order in which they are mapped."""
        return (*self.orders, *self.answers)

    @classmethod
    def of(cls, config: Cia402Config, rung: Rung) -> ProcessData:
        """Return the PDOs for a configuration in a mode.

        RPDO1: controlword and, in velocity modes, the velocity, at once. RPDO2: a position, with
        the next SYNC, or target and speed of a move, at once. TPDO1: statusword, torque, position,
        and TPDO2: velocity and, where there is one, a temperature; both answer every SYNC.
        """
        second: tuple[DriveObject, ...] = (objects.VELOCITY,)
        if config.temperature is not None:
            second = (objects.VELOCITY, config.temperature.mapped)
        node = config.node_id
        return cls(
            orders=_orders(node, rung),
            answers=(
                PdoMap(
                    0x1800,
                    0x180 + node,
                    EVERY_SYNC,
                    (objects.STATUSWORD, objects.TORQUE, objects.POSITION),
                ),
                PdoMap(0x1801, 0x280 + node, EVERY_SYNC, second),
            ),
        )


def _orders(node: int, rung: Rung) -> tuple[PdoMap, ...]:
    """Return the RPDOs of a mode."""
    if rung.set_points is SetPoints.VELOCITY:
        target = objects.VL_TARGET if rung.mode is Mode.VELOCITY else objects.TARGET_VELOCITY
        return (PdoMap(0x1400, 0x200 + node, AT_ONCE, (objects.CONTROLWORD, target)),)
    control = PdoMap(0x1400, 0x200 + node, AT_ONCE, (objects.CONTROLWORD,))
    if rung.set_points is SetPoints.MOVE:
        entries: tuple[DriveObject, ...] = (objects.TARGET_POSITION, objects.PROFILE_VELOCITY)
        return control, PdoMap(0x1401, 0x300 + node, AT_ONCE, entries)
    streamed = (
        objects.INTERPOLATION_DATA
        if rung.mode is Mode.INTERPOLATED_POSITION
        else objects.TARGET_POSITION
    )
    return control, PdoMap(0x1401, 0x300 + node, EVERY_SYNC, (streamed,))


def wanted_settings(config: Cia402Config, rung: Rung) -> dict[DriveObject, int]:
    """Return every setting but PDOs and mode, in the order in which it is written."""
    settings = _ramps(config, rung)
    if config.has_quick_stop_deceleration:
        settings[objects.QUICK_STOP_DECELERATION] = config.scaling.acceleration_units(
            config.quick_stop_deceleration_rad_s2
        )
    limits = config.software_limits_counts
    if limits is not None:
        settings.update(zip(objects.SOFTWARE_LIMITS, limits, strict=True))
    if config.quick_stop_option is not None:
        settings[objects.QUICK_STOP_OPTION] = config.quick_stop_option
    if config.abort_connection_option is not None:
        settings[objects.ABORT_CONNECTION] = config.abort_connection_option
    if config.heartbeat_consumer_subindex is not None:
        settings[objects.heartbeat_consumer(config.heartbeat_consumer_subindex)] = (
            config.agent_node_id << 16 | config.agent_heartbeat_timeout_ms
        )
    return settings


def _ramps(config: Cia402Config, rung: Rung) -> dict[DriveObject, int]:
    """Return what bounds the motion between two set-points, by the mode."""
    scaling = config.scaling
    if rung.mode in (Mode.PROFILE_VELOCITY, Mode.PROFILE_POSITION):
        moves = rung.mode is Mode.PROFILE_POSITION
        rise = config.move_ramp_rad_s2 if moves else config.acceleration_rad_s2
        fall = config.move_ramp_rad_s2 if moves else config.deceleration_rad_s2
        return {
            objects.PROFILE_ACCELERATION: scaling.acceleration_units(rise),
            **(
                {objects.PROFILE_DECELERATION: scaling.acceleration_units(fall)}
                if config.has_deceleration
                else {}
            ),
            # Slow until the first move says its own speed.
            **({objects.PROFILE_VELOCITY: 1} if moves else {}),
        }
    if rung.mode is Mode.VELOCITY:
        return _velocity_mode(config)
    period = {
        objects.INTERPOLATION_TIME: _period_ms(config),
        objects.INTERPOLATION_EXPONENT: -3,
    }
    if rung.mode is Mode.INTERPOLATED_POSITION:
        return {objects.INTERPOLATION_SUBMODE: 0, **period}
    return period


def _velocity_mode(config: Cia402Config) -> dict[DriveObject, int]:
    """Return ramps and limits of mode vl, in rpm and whole seconds."""
    settings = {
        objects.VL_RISE_SPEED: _rpm_amount(config.acceleration_rad_s2),
        objects.VL_RISE_TIME: 1,
        objects.VL_FALL_SPEED: _rpm_amount(config.deceleration_rad_s2),
        objects.VL_FALL_TIME: 1,
        objects.VL_MIN: 0,
    }
    if config.velocity_max_rad_s is not None:
        settings[objects.VL_MAX] = _rpm_amount(config.velocity_max_rad_s)
    return settings


def _rpm_amount(rad_s: float) -> int:
    """Return rad/s, or rad/s in one second, as rpm: rounded up, or the slowest ramp would be 0."""
    return max(1, math.ceil(rad_s * 60.0 / math.tau - 1e-9))


def _period_ms(config: Cia402Config) -> int:
    """Return the SYNC period as 0x60C2 takes it.

    Raises
    ------
    ConfigurationError
        It is no whole number of milliseconds that a byte can hold.
    """
    period_ms = round(1000.0 * config.stop_period_s)
    if not 1 <= period_ms <= 255 or abs(1000.0 * config.stop_period_s - period_ms) > 1e-6:
        raise ConfigurationError(
            f"A SYNC every {1000.0 * config.stop_period_s:g} ms cannot be said in 0x60C2 to node "
            f"{config.node_id}, which interpolates over whole milliseconds.",
            "Give a sample rate of 1000 Hz divided by a whole number.",
        )
    return period_ms
