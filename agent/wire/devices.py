"""The composition root's other half: register maps, probes, controllers and releases.

Like `agent.wire.wire`, it turns descriptions into drivers' objects, and nothing is built on import.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from agent.cell.cell import Axis, Cell
from agent.cell.devices import (
    AdamTemperature,
    Cia404Temperature,
    ContactRelease,
    ModbusPlace,
    Temperature,
)
from agent.errors import InputError
from drivers.can.owner import CanBusOwner
from drivers.cia401.contact import CanContact
from drivers.cia404.rtd import RtdNode
from drivers.clock import Clock, MonotonicClock
from drivers.modbus.device import MappedDevice
from drivers.modbus.job import JobConfig, ModbusJob
from drivers.modbus.job_words import STATUS
from drivers.modbus.map_file import RegisterMapError, load_map
from drivers.modbus.plausibility import RegisterVerdict
from drivers.modbus.probe import ModbusProbe
from drivers.modbus.register_map import RegisterMap
from drivers.modbus.release import SAYS, ModbusRelease
from drivers.modbus.verification import verify
from drivers.ports import Axis as AxisPort
from drivers.ports import Release, TemperatureProbe
from drivers.probed_axis import ProbedAxis
from drivers.serial.line import SerialConfig, SerialLine
from drivers.serial.probe import AdamProbe

if TYPE_CHECKING:
    from drivers.modbus.connection import Endpoint


def register_map_named(name_or_path: str, folder: Path | None = None) -> RegisterMap:
    """Return a shipped map, or one from a file.

    Raises
    ------
    agent.errors.InputError
        With every mistake in it.
    """
    try:
        return load_map(name_or_path, folder)
    except RegisterMapError as error:
        raise InputError(str(error)) from error


@dataclass(frozen=True)
class Probed:
    """An axis, perhaps with a temperature from beside its drive.

    Parameters
    ----------
    axis : drivers.ports.Axis
        What the cycle drives.
    source : callable
        Says, once the axis is open, where the temperature comes from; empty: from the drive.
    """

    axis: AxisPort
    source: Callable[[], Mapping[str, str | int | float]]


def with_probe(axis: AxisPort, described: Axis, owner: CanBusOwner, clock: Clock) -> Probed:
    """Return the axis with the temperature that its description asks for.

    Parameters
    ----------
    axis : drivers.ports.Axis
        The drive.
    described : agent.cell.axis.Axis
        Its part of the cell.
    owner : CanBusOwner
        The drive's bus, on which a temperature node may be.
    clock : Clock
        The one time base of both.

    Raises
    ------
    agent.errors.InputError
        Where the register map cannot be used.
    """
    if described.temperature is None:
        return Probed(axis, dict)
    probe = temperature_probe(described.temperature, owner, clock)
    probed = ProbedAxis(axis, probe, described.temperature.age_max_s)
    return Probed(probed, lambda: probed.probe_identity)


def temperature_probe(
    described: Temperature, owner: CanBusOwner | None, clock: Clock
) -> TemperatureProbe:
    """Return the probe that `[axis.temperature]` describes; nothing is opened yet.

    Raises
    ------
    agent.errors.InputError
        Where the register map cannot be used, or a node on the CAN bus is asked for without one.
    """
    period_s, timeout_s = described.period_s, described.timeout_s
    if isinstance(described, AdamTemperature):
        return AdamProbe(
            SerialLine(SerialConfig(described.port, described.baudrate), clock),
            clock,
            address=described.address,
            channel=described.channel,
            checksum=described.checksum,
            period_s=period_s,
            timeout_s=timeout_s,
        )
    if isinstance(described, Cia404Temperature):
        if owner is None:
            raise InputError("A temperature node on the CAN bus cannot be read without the bus.")
        return RtdNode(
            owner,
            clock,
            node_id=described.node_id,
            channel=described.channel,
            period_s=period_s,
            timeout_s=timeout_s,
        )
    device = mapped_device(described, clock)
    try:
        return ModbusProbe(
            device, described.register_name, clock, period_s=period_s, timeout_s=timeout_s
        )
    except (KeyError, ValueError) as error:
        raise InputError(f"[axis.temperature]: {error.args[0]}.") from error


def cell_release(cell: Cell, owner: CanBusOwner | None, clock: Clock) -> Release | None:
    """Return the release that `[release]` describes; None where the cell has none.

    Raises
    ------
    agent.errors.InputError
        Where the register map cannot be used.
    """
    described = cell.release
    if described is None:
        return None
    if isinstance(described, ContactRelease):
        if owner is None:
            raise InputError("A release on a CAN input needs the cell's CAN bus.")
        return CanContact(
            owner,
            clock,
            node_id=described.node_id,
            bit=described.bit,
            age_max_s=described.age_max_s,
        )
    device = mapped_device(described, clock)
    _insist_on(device, described.map, (*SAYS, "request", "agent_alive", "done"))
    return ModbusRelease(
        device,
        clock,
        period_s=described.period_s,
        timeout_s=described.timeout_s,
        age_max_s=described.age_max_s,
    )


def permit_wait_s(cell: Cell) -> float:
    """Return how long to wait for the cell's permit."""
    return cell.release.wait_s if cell.release is not None else 0.0


def _insist_on(device: MappedDevice, map_name: str, names: Iterable[str]) -> None:
    """Refuse a map that lacks what a handshake needs."""
    known = {register.name for register in device.map.registers}
    missing = [name for name in names if name not in known]
    if missing:
        raise InputError(f"The map {map_name} is not for this handshake: it has no {missing[0]}.")


def job_controller(axis: Axis, clock: Clock, *, reverse: bool) -> ModbusJob:
    """Return the controller that `[axis.job]` describes, with the cell's stair as parameters.

    Raises
    ------
    agent.errors.InputError
        Where the register map cannot be used, or the axis has no job.
    """
    if axis.job is None:
        raise InputError(f"Axis {axis.number} has no [axis.job].")
    stair = axis.stair
    parameters = {
        "stair_kind": float(stair.kind == "between"),
        "stair_reversed": float(reverse),
        "speeds": float(stair.speeds),
        "position_from": axis.motor_rad(stair.arm_from_deg),
        "position_to": axis.motor_rad(stair.arm_to_deg),
        "velocity_min": stair.motor_velocity_min_rad_s,
        "velocity_max": stair.motor_velocity_max_rad_s,
        "acceleration": stair.motor_acceleration_rad_s2,
        "jerk": stair.motor_jerk_rad_s3,
        "duration": stair.duration_s,
        "approach_velocity": stair.approach_velocity_rad_s,
    }
    device = mapped_device(axis.job, clock)
    _insist_on(device, axis.job.map, (*STATUS, "command", "axis", "agent_alive", *parameters))
    config = JobConfig(
        axis=axis.number,
        parameters=parameters,
        alive_timeout_s=axis.job.alive_timeout_s,
        timeout_s=axis.job.timeout_s,
    )
    return ModbusJob(device, config, clock)


def mapped_device(place: ModbusPlace, clock: Clock) -> MappedDevice:
    """Return a Modbus device behind its register map; nothing is opened yet."""
    from drivers.modbus.connection import ModbusConnection  # pymodbus: 0.1 s that few cells need

    register_map = register_map_named(place.map)
    connection = ModbusConnection(
        _endpoint(place), clock, device_id=place.device_id, min_gap_s=register_map.min_gap_s
    )
    return MappedDevice(connection, register_map)


def _endpoint(place: ModbusPlace) -> Endpoint:
    from drivers.modbus.connection import SerialEndpoint, TcpEndpoint

    if place.tcp is not None:
        host, _, port = place.tcp.rpartition(":")
        return TcpEndpoint(host, int(port))
    return SerialEndpoint(str(place.rtu), place.baudrate, place.parity, place.stopbits)


@dataclass(frozen=True)
class MapCheck:
    """A register map that shall be compared with a device.

    Parameters
    ----------
    register_map, endpoint, device_id
        The map, where the device is, and its unit or station.
    registers : tuple of str
        Only these; empty means all of the map.
    rounds : int
        How often to read.
    interval_s, timeout_s : float
        Between rounds, and for each request.
    """

    register_map: RegisterMap
    endpoint: Endpoint
    device_id: int = 1
    registers: tuple[str, ...] = ()
    rounds: int = 5
    interval_s: float = 0.2
    timeout_s: float = 1.0


def check_map(check: MapCheck) -> tuple[RegisterVerdict, ...]:
    """Read the device by the map and return what is to be thought of each register.

    Raises
    ------
    agent.errors.InputError
        For a register that the map does not have.
    drivers.errors.DriverError
        Nobody answers, or what comes is no Modbus.
    """
    from drivers.modbus.connection import ModbusConnection

    register_map, clock = check.register_map, MonotonicClock()
    known = [r.name for r in register_map.registers]
    unknown = [name for name in check.registers if name not in known]
    if unknown:
        raise InputError(
            f"{register_map.device} has no register {unknown[0]!r}; it has {', '.join(known)}."
        )
    connection = ModbusConnection(
        check.endpoint, clock, device_id=check.device_id, min_gap_s=register_map.min_gap_s
    )
    try:
        return verify(
            connection,
            register_map,
            check.registers or known,
            clock,
            rounds=check.rounds,
            interval_s=check.interval_s,
            timeout_s=check.timeout_s,
        )
    finally:
        connection.close()
