"""Reads a whole register map a few times, and finds out which registers the device refuses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from drivers.clock import Clock
from drivers.errors import AnswerError
from drivers.modbus.plausibility import RegisterVerdict, judge_map
from drivers.modbus.register_map import Block, RawValue, RegisterMap, decode_block

if TYPE_CHECKING:
    from drivers.modbus.connection import ModbusConnection


def verify(
    connection: ModbusConnection,
    register_map: RegisterMap,
    names: Sequence[str],
    clock: Clock,
    *,
    rounds: int,
    interval_s: float,
    timeout_s: float,
) -> tuple[RegisterVerdict, ...]:
    """Read `names` in `rounds` rounds and judge what came.

    Parameters
    ----------
    connection : ModbusConnection
        To the device; it stays open.
    register_map : RegisterMap
        The map in question.
    names : sequence of str
        Which registers; their quality registers come with them.
    clock : Clock
        Paces the rounds.
    rounds : int
        How often.
    interval_s, timeout_s : float
        Between rounds, and for each request.

    Raises
    ------
    drivers.errors.DriverError
        Nobody answers, or what comes is no Modbus. That the device refuses a register is a
        verdict, not an error.
    """
    chosen = register_map.with_quality(names)
    refused: dict[str, str] = {}
    seen: list[dict[str, RawValue]] = []
    due_s = clock.now()
    for _ in range(rounds):
        clock.sleep_until(due_s)
        due_s = clock.now() + interval_s
        values: dict[str, RawValue] = {}
        for block in register_map.blocks(n for n in chosen if n not in refused):
            values |= _read(connection, register_map, block, clock, timeout_s, refused)
        seen.append(values)
    judged_by = {r.name: r.quality.name for r in register_map.registers if r.quality is not None}
    for name in chosen:
        if judged_by.get(name) in refused:
            refused.setdefault(name, f"its quality register {judged_by[name]} is refused")
    return judge_map(register_map, seen, refused)


def _read(
    connection: ModbusConnection,
    register_map: RegisterMap,
    block: Block,
    clock: Clock,
    timeout_s: float,
    refused: dict[str, str],
) -> dict[str, RawValue]:
    """Read a block; where the device refuses it, each of its registers by itself."""
    try:
        words = connection.read(block.function, block.address, block.size, clock.now() + timeout_s)
        return decode_block(register_map, block, words)
    except AnswerError as error:
        if error.exception_code is None:
            raise
        if len(block.names) == 1:
            refused[block.names[0]] = error.what
            return {}
    values: dict[str, RawValue] = {}
    for name in block.names:
        for single in register_map.blocks((name,)):
            values |= _read(connection, register_map, single, clock, timeout_s, refused)
    return values
