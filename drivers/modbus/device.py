"""A device behind its register map: values by name, judged, in physical units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

from drivers.modbus.register_map import (
    COILS,
    RawValue,
    Register,
    RegisterMap,
    decode_block,
)
from drivers.ports import Quality

if TYPE_CHECKING:  # whoever has a connection has imported pymodbus; whoever has none need not
    from drivers.modbus.connection import ModbusConnection


class Value(NamedTuple):
    """One register's value: NaN, with the reason, wherever it is not to be believed."""

    value: float
    quality: Quality
    reason: str
    raw: RawValue

    @property
    def whole(self) -> int:
        """Return the whole number of a word that means something; -1 where there is none."""
        return int(self.value) if math.isfinite(self.value) else -1


class MappedDevice:
    """Reads and writes a device by the names of its map.

    Parameters
    ----------
    connection : ModbusConnection
        To the device; its gap is the map's.
    register_map : RegisterMap
        What stands where.
    """

    def __init__(self, connection: ModbusConnection, register_map: RegisterMap) -> None:
        self.connection = connection
        self.map = register_map

    def read(self, names: Iterable[str], deadline_s: float) -> dict[str, Value]:
        """Return the values of `names`, each judged by its sentinels, quality and range.

        Raises
        ------
        BusError, NodeMissingError, AnswerError
            As `ModbusConnection.read`.
        """
        chosen = self.map.with_quality(names)
        raw: dict[str, RawValue] = {}
        for block in self.map.blocks(chosen):
            words = self.connection.read(block.function, block.address, block.size, deadline_s)
            raw |= decode_block(self.map, block, words)
        return {name: judge(self.map[name], raw) for name in chosen}

    def write(self, values: Mapping[str, float], deadline_s: float) -> None:
        """Write registers by name, each in its own request, in the given order.

        Raises
        ------
        BusError, NodeMissingError, AnswerError
            As `ModbusConnection.write_registers`.
        ValueError
            A register that the map does not call writable, or a value that does not fit.
        """
        for name, value in values.items():
            register = self.map[name]
            if not register.writable:
                raise ValueError(f"{self.map.device}: {name} is not writable")
            at = self.map.wire_address(register)
            if register.function == COILS:
                self.connection.write_coil(at, bool(value), deadline_s)
            else:
                words = self.map.layout(register).encode(register.raw(value))
                self.connection.write_registers(at, words, deadline_s)


def judge(register: Register, raw: Mapping[str, RawValue]) -> Value:
    """Return a register's value, or NaN with the reason why it is none.

    Parameters
    ----------
    register : Register
        Which one.
    raw : mapping
        What was read, the register's quality register included.
    """
    own = raw[register.name]
    if register.is_sentinel(own.number):
        return Value(
            math.nan, Quality.ABSENT, f"the device says that there is no value ({own.number})", own
        )
    quality = register.quality
    if quality is not None:
        status = int(raw[quality.name].number) & quality.mask
        if status not in quality.good:
            return Value(
                math.nan, Quality.BAD, f"{quality.name} is {status}, not {quality.good}", own
            )
    value = register.physical(own.number)
    if register.range is not None and not register.range[0] <= value <= register.range[1]:
        low, high = register.range
        return Value(
            math.nan,
            Quality.BAD,
            f"{value:g} {register.unit} is outside of [{low:g}, {high:g}]",
            own,
        )
    return Value(value, Quality.GOOD, "", own)
