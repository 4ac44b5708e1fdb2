"""Does a register map fit the device? Judged from a few rounds of reading; pure.

A wrong map reads numbers too. What gives it away: a value outside of what its quantity can be, a
32-bit number whose low word hardly moves while its high word jumps, a temperature of 6550 degrees
that was -3 in a signed register, a number that never changes at all. Where another layout puts
every reading into its range, it is named.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drivers.modbus.codec import SIGNED_TWIN, ByteOrder, Layout, WordOrder
from drivers.modbus.device import judge
from drivers.modbus.register_map import RawValue, Register, RegisterMap
from drivers.ports import Quality

DEFAULT_RANGES: Mapping[str, tuple[float, float]] = {
    "degC": (-60.0, 300.0),
    "rad": (-1e4, 1e4),
    "deg": (-1e5, 1e5),
    "V": (-1e3, 1e3),
}
"""What a quantity can be where its map does not say."""

_TINY, _HUGE = 1e-6, 1e9
"""A measured float beyond these is no measurement: read in the wrong order, most floats are."""


class Finding(enum.Enum):
    """How a register's readings look; the value is the word in the table."""

    PLAUSIBLE = "plausible"
    NO_VALUE = "no value"  # sentinel or quality: the map may well be right
    DOUBTFUL = "doubtful"
    WRONG = "wrong"
    REFUSED = "refused"  # the device has no such register

    @property
    def is_bad(self) -> bool:
        """Return whether somebody should look at the map before relying on it."""
        return self in (Finding.DOUBTFUL, Finding.WRONG, Finding.REFUSED)


@dataclass(frozen=True)
class RegisterVerdict:
    """What was read of one register, and what is to be thought of it.

    Parameters
    ----------
    name, unit : str
        As in the map.
    value : float
        The last one; NaN where there is none.
    raw : tuple of int
        The registers of the last reading; empty where it was refused.
    finding : Finding
        The verdict.
    reasons : tuple of str
        Why, in words; what would make more sense, where something does.
    confirmed : str
        Whether the map's own entry was ``read`` in a vendor's file, ``unconfirmed`` or ``own``.
    """

    name: str
    unit: str
    value: float
    raw: tuple[int, ...]
    finding: Finding
    reasons: tuple[str, ...]
    confirmed: str

    def to_json(self) -> dict[str, object]:
        """Return it as JSON has it; NaN is null."""
        return {
            "register": self.name,
            "value": self.value if math.isfinite(self.value) else None,
            "unit": self.unit,
            "raw": list(self.raw),
            "finding": self.finding.value,
            "reasons": list(self.reasons),
            "confirmed": self.confirmed,
        }


Rounds = Sequence[Mapping[str, RawValue]]


def judge_map(
    register_map: RegisterMap, rounds: Rounds, refused: Mapping[str, str]
) -> tuple[RegisterVerdict, ...]:
    """Return a verdict for every register that was read or refused, in the map's order.

    Parameters
    ----------
    register_map : RegisterMap
        The map in question.
    rounds : sequence of mapping
        Raw values by name, one mapping a round, oldest first.
    refused : mapping
        Registers that the device does not give, with its words.
    """
    verdicts = []
    for register in register_map.registers:
        if register.name in refused:
            verdicts.append(_refused(register_map, register, refused[register.name]))
        elif rounds and register.name in rounds[-1]:
            verdicts.append(_judged(register_map, register, rounds))
    return tuple(verdicts)


def _refused(register_map: RegisterMap, register: Register, why: str) -> RegisterVerdict:
    confirmed = register.confirmed or register_map.confirmed
    return RegisterVerdict(
        register.name, register.unit, math.nan, (), Finding.REFUSED, (why,), confirmed
    )


def _judged(register_map: RegisterMap, register: Register, rounds: Rounds) -> RegisterVerdict:
    newest = rounds[-1]
    value = judge(register, newest)
    series = [r[register.name] for r in rounds]
    reasons: list[str] = []
    finding = Finding.PLAUSIBLE
    judged_bad = value.quality is Quality.BAD and register.quality is not None
    absent = value.quality is Quality.ABSENT and not _strays(register_map, register, series)
    if absent or (judged_bad and _in_range(register, series)):
        finding, reasons = Finding.NO_VALUE, [value.reason]
    elif not _in_range(register, series):
        finding = Finding.WRONG
        reasons = [_outside(register, series), *_what_would_fit(register_map, register, series)]
    elif register.type != "bit":
        reasons = _doubts(register_map.layout(register), register, series)
        if reasons:
            finding = Finding.DOUBTFUL
            reasons += _what_would_fit(register_map, register, series)
    measured = bool(register.unit) and not register.writable
    if finding is Finding.PLAUSIBLE and measured and _frozen(series):
        reasons.append(f"the same in all {len(series)} rounds: does it ever move?")
    return RegisterVerdict(
        register.name,
        register.unit,
        value.value,
        series[-1].registers,
        finding,
        tuple(reasons),
        register.confirmed or register_map.confirmed,
    )


def _range(register: Register) -> tuple[float, float] | None:
    return register.range or DEFAULT_RANGES.get(register.unit)


def _in_range(register: Register, series: Sequence[RawValue]) -> bool:
    limits = _range(register)
    if limits is None:
        return True
    numbers = [v.number for v in series if not register.is_sentinel(v.number)]
    return all(limits[0] <= register.physical(n) <= limits[1] for n in numbers)


def _strays(register_map: RegisterMap, register: Register, series: Sequence[RawValue]) -> bool:
    """Return whether a register that is now without a value has others that no sensor gives.

    A device that has no value says so by one pattern of bits, time and again.
    """
    odd = {v.registers for v in series if not math.isfinite(v.number)}
    numbers = [v for v in series if math.isfinite(v.number)]
    if len(odd) > 1 or not _in_range(register, numbers):
        return True
    is_float = register.type != "bit" and register_map.layout(register).is_float
    return is_float and any(_seldom_measured(v.number) for v in numbers)


def _seldom_measured(number: float) -> bool:
    """Return whether a float is of a size that is hardly ever a measurement."""
    return number != 0.0 and not _TINY < abs(number) < _HUGE


def _outside(register: Register, series: Sequence[RawValue]) -> str:
    """Say which reading is outside of the range, the newest that is."""
    low, high = _range(register) or (math.nan, math.nan)
    out = next(v for v in reversed(series) if not _in_range(register, [v]))
    said = f"{register.physical(out.number):.6g} {register.unit} is outside of [{low:g}, {high:g}]"
    return said.replace("  ", " ")


def _what_would_fit(
    register_map: RegisterMap, register: Register, series: Sequence[RawValue]
) -> list[str]:
    """Return the other layouts in which every reading would be inside of its range.

    A layout that makes all of them the same tiny number, or 0, proves nothing and is left out.
    """
    if register.type == "bit":
        return []
    layout = register_map.layout(register)
    limits = _range(register)
    found = []
    for words, other in _alternatives(layout):
        numbers = [other.decode(v.registers) for v in series]
        values = [register.physical(n) for n in numbers]
        if limits is None or not all(
            math.isfinite(v) and limits[0] <= v <= limits[1] for v in values
        ):
            continue
        if other.is_float and all(abs(v) < _TINY for v in numbers):
            continue
        found.append(f"with {words} it would be {values[-1]:.6g} {register.unit}".rstrip())
    return found


def _alternatives(layout: Layout) -> list[tuple[str, Layout]]:
    """Return the layouts that vendors confuse with this one, in words."""
    kind, words, order = layout.kind, layout.word_order, layout.byte_order
    other_words: WordOrder = "low-first" if words == "high-first" else "high-first"
    other_bytes: ByteOrder = "little" if order == "big" else "big"
    twin = SIGNED_TWIN.get(kind)
    others: list[tuple[str, Layout]] = []
    if layout.registers > 1:
        others.append((f'word_order = "{other_words}"', Layout(kind, other_words, order)))
    if twin is not None:
        others.append((f'type = "{twin}"', Layout(twin, words, order)))
    others.append((f'byte_order = "{other_bytes}"', Layout(kind, words, other_bytes)))
    if layout.registers > 1:
        both = f'word_order = "{other_words}" and byte_order = "{other_bytes}"'
        others.append((both, Layout(kind, other_words, other_bytes)))
    return others


def _doubts(layout: Layout, register: Register, series: Sequence[RawValue]) -> list[str]:
    """Return what is odd about readings that are inside of their range."""
    doubts = []
    numbers = [v.number for v in series if not register.is_sentinel(v.number)]
    if layout.is_float and any(map(_seldom_measured, numbers)):
        doubts.append("a float of this size is seldom measured: is the word order right?")
    if layout.registers == 2 and not layout.is_float and _moves_at_the_wrong_end(layout, series):
        doubts.append(
            "the word taken for the high one moves while the low one stands still: "
            "the word order is probably the other one"
        )
    if layout.kind == "u16" and numbers and _wraps(numbers, 1 << 16):
        doubts.append('it jumps between 0 and 65535: it is probably signed (type = "i16")')
    return doubts


def _moves_at_the_wrong_end(layout: Layout, series: Sequence[RawValue]) -> bool:
    high, low = (0, 1) if layout.word_order == "high-first" else (1, 0)
    highs = {v.registers[high] for v in series}
    lows = {v.registers[low] for v in series}
    return len(highs) > 1 and len(lows) == 1


def _wraps(numbers: Sequence[float], span: int) -> bool:
    """Return whether neighbours of an unsigned number lie at both of its ends."""
    return min(numbers) < span // 64 and max(numbers) >= span - span // 64


def _frozen(series: Sequence[RawValue]) -> bool:
    return len(series) > 2 and len({v.registers for v in series}) == 1
