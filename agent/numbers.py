"""Numbers for people: the interval decides the digits, the size decides the unit.

Rule: half of the 95 % interval is written with two significant digits, and the value ends at the
same decimal place. A number without an interval has four significant digits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

NO_NUMBER = "–"

# A parameter's name ends with its unit; the longest ending that fits is taken.
_UNIT_OF_SUFFIX = {
    "_nm_s_per_rad": "N m s/rad",
    "_nm_per_rad3": "N m/rad³",
    "_nm_per_rad": "N m/rad",
    "_kg_m2": "kg m²",
    "_s_per_rad": "s/rad",
    "_rad_s2": "rad/s²",
    "_rad_s": "rad/s",
    "_degc": "°C",
    "_percent": "%",
    "_nm": "N m",
    "_rad": "rad",
    "_hz": "Hz",
    "_kg": "kg",
    "_s": "s",
}

# From large to small: factor from the SI unit, and what it is then called.
_SCALES: Mapping[str, tuple[tuple[float, str], ...]] = {
    "N m": ((1.0, "N m"), (1e3, "mN m"), (1e6, "µN m")),
    "N m s/rad": ((1.0, "N m s/rad"), (1e3, "mN m s/rad"), (1e6, "µN m s/rad")),
    "kg m²": ((1.0, "kg m²"), (1e4, "kg cm²"), (1e7, "g cm²")),
    "s": ((1.0, "s"), (1e3, "ms"), (1e6, "µs")),
}
_SMALLEST_COMFORTABLE = 0.1

_NO_TEXT = re.compile(
    r"(<(script|style|title|svg|option|textarea)\b.*?</\2>|<!--.*?-->|<[^>]*>)", re.DOTALL
)
_DATE = re.compile(r"(?<![\w./-])\d{4}-\d\d-\d\d(?![\w/-])")

_LABELS = {
    "coulomb_nm": "Coulomb friction",
    "viscous_nm_s_per_rad": "Viscous friction",
    "static_extra_nm": "Extra friction at standstill (Stribeck)",
    "stribeck_velocity_rad_s": "Stribeck velocity",
    "exponent": "Stribeck exponent",
    "inertia_kg_m2": "Inertia, motor side",
    "gravity_sin_nm": "Gravity, sine of the arm angle",
    "gravity_cos_nm": "Gravity, cosine of the arm angle",
    "torque_offset_nm": "Torque offset",
}


class Quantity(Protocol):
    """A number with its 95 % interval, as `agent.identify.result.Parameter` is one."""

    @property
    def value(self) -> float:
        """Return the number, in SI."""
        ...

    @property
    def ci95(self) -> tuple[float, float] | None:
        """Return both ends of the interval, where there is one."""
        ...

    @property
    def identified(self) -> bool:
        """Return whether the data carry it."""
        ...


@dataclass(frozen=True)
class Scale:
    """A unit to write in: number written = `factor` x number in SI."""

    factor: float
    unit: str


def parameter_label(name: str) -> str:
    """Return a parameter's name in words: the field's own where we know it, else the name's."""
    if name in _LABELS:
        return _LABELS[name]
    unit_suffix = _suffix(name)
    return name.removesuffix(unit_suffix).replace("_", " ").strip().capitalize() or name


def parameter_unit(name: str) -> str:
    """Return the SI unit that a parameter's name ends with; empty when it has none."""
    return _UNIT_OF_SUFFIX.get(_suffix(name), "")


def scale_for(unit: str, values: Iterable[float]) -> Scale:
    """Choose the unit in which the largest of `values` is at least 0.1.

    Parameters
    ----------
    unit : str
        SI unit of the values.
    values : iterable of float
        In `unit`; what is not finite is left out.
    """
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    scales = _SCALES.get(unit, ((1.0, unit),))
    if largest == 0.0:
        return Scale(*scales[0])
    for factor, name in scales:
        if largest * factor >= _SMALLEST_COMFORTABLE:
            return Scale(factor, name)
    return Scale(*scales[-1])


def scales_for(parameters: Iterable[tuple[str, Quantity]]) -> dict[str, Scale]:
    """Choose one scale for each SI unit, so that numbers in one table can be compared.

    Parameters that were not identified have no say: their numbers are not shown.
    """
    values: dict[str, list[float]] = {}
    for name, parameter in parameters:
        if parameter.identified:
            values.setdefault(parameter_unit(name), []).append(parameter.value)
    return {unit: scale_for(unit, numbers) for unit, numbers in values.items()}


def decimals_for(half_width: float) -> int:
    """Return the decimal place at which two significant digits of `half_width` end.

    Negative for intervals of hundreds and more. Zero or not finite is the caller's mistake.
    """
    if not (math.isfinite(half_width) and half_width > 0.0):
        raise ValueError(f"expected a positive, finite half-width, got {half_width}")
    decimals = 1 - math.floor(math.log10(half_width))
    if round(half_width, decimals) >= 10.0 ** (2 - decimals):
        decimals -= 1  # 0.0996 is written 0.10
    return decimals


def fixed(value: float, decimals: int) -> str:
    """Write `value` with `decimals` places, a true minus sign, and no negative zero."""
    if not math.isfinite(value):
        return NO_NUMBER
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    if not text.strip("-0."):
        text = text.lstrip("-")
    return text.replace("-", "−")


def signed(value: float, form: str) -> str:
    """Write `value` by a format such as ``+.1f``, with a true minus sign."""
    return f"{value:{form}}".replace("-", "−")


def significant(value: float, digits: int = 4) -> str:
    """Write `value` with that many significant digits, never in powers of ten."""
    if not math.isfinite(value):
        return NO_NUMBER
    if value == 0.0:
        return "0"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return fixed(value, decimals)


def signed_interval(change: Quantity, scale: Scale) -> str:
    """Write a change with its interval and both signs: ``+0.095 N m (+0.086 to +0.104)``.

    Parameters
    ----------
    change : Quantity
        With an interval.
    scale : Scale
        What it is written in; one for all that stand in a column.
    """
    value, interval, _ = written(change, scale.factor)
    ends = " to ".join(_signed(end) for end in interval.split(" to "))
    return f"{_signed(value)} {scale.unit} ({ends})"


def _signed(number: str) -> str:
    return number if number.startswith("−") else f"+{number}"


def written(parameter: Quantity, factor: float = 1.0) -> tuple[str, str, str]:
    """Write value, interval and half-width of an identified parameter by the digits rule.

    Parameters
    ----------
    parameter : Quantity
        An identified one.
    factor : float
        From SI to the unit written.

    Returns
    -------
    tuple of str
        ``("0.604", "0.519 to 0.689", "0.085")``; interval and half-width are empty when the
        parameter has none.
    """
    value = parameter.value * factor
    if parameter.ci95 is None:
        return significant(value), "", ""
    low, high = (end * factor for end in parameter.ci95)
    half_width = (high - low) / 2.0
    if not (math.isfinite(half_width) and half_width > 0.0):
        return significant(value), f"{significant(low)} to {significant(high)}", ""
    places = decimals_for(half_width)
    return (
        fixed(value, places),
        f"{fixed(low, places)} to {fixed(high, places)}",
        fixed(half_width, places),
    )


def units_unbroken(sentence: str) -> str:
    """Keep each number, its ``±`` and its unit on one line of a sentence."""
    unit = r"[mµ]?N m s/rad|[mµ]?N m|rad/s|kg|°C|Hz|%|[mµ]?s\b|min\b|h\b"
    glued = re.sub(rf"(?<=\d) (?={unit})|(?<=±) | (?=±)", "\u00a0", sentence)
    return re.sub(r"(?<=N) (?=m\b)|(?<=N m|N\u00a0m) (?=s/rad)", "\u00a0", glued)


def dates_unbroken(page: str) -> str:
    """Keep each date of ISO 8601 in a page's text on one line: browsers break it at its hyphens.

    Its characters stay what they are, so that what is copied is a date. Names that hold a date may
    break, for they may be longer than a line.

    Parameters
    ----------
    page : str
        HTML whose attributes hold no bare ``>``.
    """
    parts = _NO_TEXT.split(page)
    for i in range(0, len(parts), 3):  # between them what is split at, and its element's name
        parts[i] = _DATE.sub(r'<span class="date">\g<0></span>', parts[i])
    return "".join(part for i, part in enumerate(parts) if i % 3 != 2)


def _suffix(name: str) -> str:
    return max((s for s in _UNIT_OF_SUFFIX if name.endswith(s)), key=len, default="")
