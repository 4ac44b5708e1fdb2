"""Over which motion a twin's laws were learnt, and where a recording goes beyond it.

A spring that stiffens, a drift, an oil's temperature: told straight over a short range, and carried
on beyond it, a law is a guess. The twin says how far it was seen, in a table of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.physics.twin import Twin

Floats = NDArray[np.float64]

KEY = "learnt_over"
"""The twin's table: variable of contract section 6 to its lowest and highest value."""

_ENDS = (0.002, 0.998)  # quantiles: one wild sample is no range
_BEYOND = 0.1  # of the range on either side: so far a law is taken to reach
_LEAST = MappingProxyType({"arm_position_rad": math.radians(1.0), "gearbox_temperature_degc": 2.0})
"""At least so far a law reaches beyond a narrow range: no oil changes within a degree."""

_CALLED: Mapping[str, tuple[str, float, str]] = MappingProxyType(
    {
        "arm_position_rad": ("arm angles", math.degrees(1.0), "degrees"),
        "velocity_rad_s": ("motor speeds", 1.0, "rad/s"),
        "gearbox_temperature_degc": ("gearbox temperatures", 1.0, "°C"),
    }
)


def ranges_of(columns: Mapping[str, Floats]) -> dict[str, tuple[float, float]]:
    """Return the range of every column that a law may be carried beyond.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        ``arm_position_rad``, ``velocity_rad_s`` and ``gearbox_temperature_degc``, as far as known;
        of the speed its size counts.
    """
    out = {}
    for name in _CALLED:
        values = columns.get(name)
        known = np.empty(0) if values is None else values[np.isfinite(values)]
        if known.size:
            size = np.abs(known) if name == "velocity_rad_s" else known
            low, high = (float(x) for x in np.quantile(size, _ENDS))
            out[name] = (low, high)
    return out


def noted(ranges: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Return ranges as a twin's file holds them, under `KEY`."""
    return {KEY: {name: list(ends) for name, ends in ranges.items()}}


def known_to(twin: Twin) -> dict[str, tuple[float, float]]:
    """Return the ranges that a twin's file notes; what is no range there is left out."""
    table = twin.extra.get(KEY)
    out = {}
    for name, ends in table.items() if isinstance(table, Mapping) else ():
        pair = list(ends) if isinstance(ends, (list, tuple)) else []
        if len(pair) == 2 and all(isinstance(x, (int, float)) for x in pair):
            out[name] = (float(pair[0]), float(pair[1]))
    return out


def _short(value: float) -> str:
    """Return a number with three digits, and all of a larger one before its point."""
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"


def beyond(
    learnt: Mapping[str, tuple[float, float]], driven: Mapping[str, tuple[float, float]]
) -> tuple[str, ...]:
    """Return in words where a motion goes clearly beyond the ranges that laws were learnt over.

    Parameters
    ----------
    learnt, driven : mapping of str to (float, float)
        As `ranges_of` gives them.
    """
    out = []
    for name, (called, scale, unit) in _CALLED.items():
        if name not in learnt or name not in driven:
            continue
        (low, high), (least, most) = learnt[name], driven[name]
        margin = max(_BEYOND * (high - low), _LEAST.get(name, 0.0))
        below = name != "velocity_rad_s" and least < low - margin
        if below or most > high + margin:
            there, here = (
                _short(scale * a)
                if _short(scale * a) == _short(scale * b)
                else f"{_short(scale * a)} to {_short(scale * b)}"
                for a, b in ((least, most), (low, high))
            )
            out.append(f"{called} of {there} {unit} where the law was learnt over {here}")
    return tuple(out)
