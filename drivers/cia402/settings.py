"""What a drive is set to for a run, found before, read back after, and given back at the end.

The order matters. Set: limits and ramps first, then who watches whom, then the PDOs, the mode
last. Given back: our heartbeat is no longer watched first of all, then everything backwards, the
drive's own heartbeat last.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.modes import Rung
from drivers.cia402.objects import DriveObject, setting_of
from drivers.cia402.pdo import AT_ONCE, EVERY_SYNC, MAPPING_OFFSET, PdoMap, snapshot_pdo, write_pdo
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.words import Mode
from drivers.errors import BusError, ConfigurationError, DriverError, SdoError
from drivers.ports import SetPoints

_Step = tuple[str, Callable[[], dict[str, int]]]

_LIMITS = objects.SOFTWARE_LIMITS


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
    settings[objects.QUICK_STOP_DECELERATION] = config.scaling.acceleration_units(
        config.quick_stop_deceleration_rad_s2
    )
    limits = config.software_limits_counts
    if limits is not None:
        settings.update(zip(_LIMITS, limits, strict=True))
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
            objects.PROFILE_DECELERATION: scaling.acceleration_units(fall),
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


def snapshot(sdo: SdoAccess, config: Cia402Config, rung: Rung) -> dict[str, int]:
    """Return everything that `apply` will write, as it is now; nothing is written."""
    items = (*wanted_settings(config, rung), objects.MODE)
    found = {item.key: sdo.read(item) for item in items}
    for pdo in ProcessData.of(config, rung).all:
        found.update(snapshot_pdo(sdo, pdo))
    return found


def apply(
    sdo: SdoAccess, config: Cia402Config, rung: Rung, found: Mapping[str, int]
) -> dict[str, int]:
    """Set everything for a run and return what was read back.

    Parameters
    ----------
    sdo : SdoAccess
        Of a node in PRE-OPERATIONAL, without torque.
    config : Cia402Config
        What to set.
    rung : Rung
        For which mode.
    found : mapping
        The snapshot taken before.

    Raises
    ------
    ConfigurationError
        Naming the object that does not hold its value.
    SdoError
        Naming the object that the drive refuses.
    """
    settings = wanted_settings(config, rung)
    read: dict[str, int] = {}
    for _, step in _setters(sdo, settings):
        read.update(step())
    for pdo in ProcessData.of(config, rung).all:
        read.update(write_pdo(sdo, pdo.communication_index, pdo.wanted(found)))
    read[objects.MODE.key] = sdo.set(objects.MODE, rung.mode)
    return read


def held_of(settings: Mapping[str, int], config: Cia402Config, rung: Rung) -> dict[str, int]:
    """Return those of the settings read back that nothing of ours changes afterwards."""
    orders = {entry.key for pdo in ProcessData.of(config, rung).orders for entry in pdo.entries}
    passing = {*orders, objects.MODE_DISPLAY.key}
    return {key: value for key, value in settings.items() if key not in passing}


def leave_at_rest(sdo: SdoAccess, rung: Rung) -> None:
    """Write a set-point that moves nothing; a position is where the joint stands now."""
    if rung.mode is Mode.VELOCITY:
        sdo.write(objects.VL_TARGET, 0)
    elif rung.set_points is SetPoints.VELOCITY:
        sdo.write(objects.TARGET_VELOCITY, 0)
    elif rung.mode is Mode.INTERPOLATED_POSITION:
        sdo.write(objects.INTERPOLATION_DATA, sdo.read(objects.POSITION))
    else:
        sdo.write(objects.TARGET_POSITION, sdo.read(objects.POSITION))


def give_back(sdo: SdoAccess, found: Mapping[str, int]) -> list[str]:
    """Bring every object of a snapshot back, in PRE-OPERATIONAL; return what could not be.

    When the drive no longer answers, the rest is not tried but listed.

    Parameters
    ----------
    sdo : SdoAccess
        Of a node in PRE-OPERATIONAL, without torque.
    found : mapping
        A snapshot, perhaps from a journal of a run that crashed.
    """
    pdos = sorted({int(key[2:6], 16) for key in found if _is_pdo(key) and key.endswith(":00")})
    plain = {setting_of(key): value for key, value in found.items() if not _is_pdo(key)}
    watch = {item: value for item, value in plain.items() if item.index == 0x1016}
    last = {item: plain[item] for item in plain if item == objects.HEARTBEAT_PRODUCER}
    rest = {item: plain[item] for item in reversed(plain) if item not in watch | last}
    steps = [
        *_setters(sdo, watch),
        *(_remapper(sdo, index - MAPPING_OFFSET, found) for index in pdos),
        *_setters(sdo, rest),
        *_setters(sdo, last),
    ]
    failures: list[str] = []
    for number, (name, step) in enumerate(steps):
        try:
            step()
        except DriverError as error:
            failures.append(f"{name}: {error.what}")
            if _is_silence(error):
                failures.extend(f"{left}: not tried" for left, _ in steps[number + 1 :])
                break
    return failures


def _setters(sdo: SdoAccess, values: Mapping[DriveObject, int]) -> list[_Step]:
    """Return one step for each setting; the two software limits make one step together."""
    steps: list[_Step] = []
    for item, value in values.items():
        if item not in _LIMITS:
            steps.append((str(item), _setter(sdo, item, value)))
        elif item == _LIMITS[0] and _LIMITS[1] in values:
            steps.append((str(item), _limits_setter(sdo, value, values[_LIMITS[1]])))
    return steps


def _setter(sdo: SdoAccess, item: DriveObject, value: int) -> Callable[[], dict[str, int]]:
    return lambda: {item.key: sdo.set(item, value)}


def _limits_setter(sdo: SdoAccess, low: int, high: int) -> Callable[[], dict[str, int]]:
    """Return a step that never lets the minimum exceed the maximum, which drives refuse."""

    def step() -> dict[str, int]:
        new = dict(zip(_LIMITS, (low, high), strict=True))
        upwards = low > sdo.read(objects.SOFTWARE_LIMIT_MAX)
        return {
            item.key: sdo.set(item, new[item]) for item in (_LIMITS[::-1] if upwards else _LIMITS)
        }

    return step


def _remapper(sdo: SdoAccess, communication_index: int, found: Mapping[str, int]) -> _Step:
    return (
        f"PDO 0x{communication_index:04X}",
        lambda: write_pdo(sdo, communication_index, found),
    )


def _is_pdo(key: str) -> bool:
    """Return whether a snapshot's key belongs to a PDO."""
    return 0x1400 <= int(key[2:6], 16) < 0x1C00


def _is_silence(error: DriverError) -> bool:
    """Return whether an error means that the drive cannot be reached at all."""
    return isinstance(error, BusError) or (isinstance(error, SdoError) and error.abort_code is None)
