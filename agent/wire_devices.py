"""The composition root's other half: register maps, probes and releases beside the drive.

Like `agent.wire`, it turns descriptions into drivers' objects, and nothing is built on import.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agent.errors import InputError
from drivers.clock import MonotonicClock
from drivers.modbus.connection import Endpoint, ModbusConnection
from drivers.modbus.plausibility import RegisterVerdict
from drivers.modbus.register_map import RegisterMap, RegisterMapError, load_map
from drivers.modbus.verification import verify


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
