"""The deficiency map as a table that is coloured: base parameters across, axes down.

A table rather than a picture: its numbers can be read aloud, copied and searched, and it turns with
the page on a phone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from agent.explain.answer.result import Cell
from agent.numbers import NO_NUMBER, parameter_label, significant
from agent.report.explanation.places import variable
from agent.report.explanation.words import (
    heading,
    percent,
    share,
)

LEVELS = 10
_BLANK_BELOW = 0.005

_PARAMETERS: Mapping[str, str] = MappingProxyType(
    {
        "coulomb": "Coulomb",
        "viscous": "Viscous",
        "inertia": "Inertia",
        "gravity": "Gravity",
        "gravity_sin": "Gravity, sine",
        "gravity_cos": "Gravity, cosine",
        "offset": "Offset",
        "torque_offset": "Offset",
        "scale": "Scale",
    }
)
_UNITS = ("_nm_s_per_rad", "_kg_m2", "_nm")
_AXES: Mapping[str, str] = MappingProxyType(
    {
        "velocity_rad_s": "motor speed",
        "load_torque_nm": "size of the load",
        "time_s": "time in the cycle",
    }
)

# What a cell usually stands for: a parameter that varies along an axis, read as physics.
_READINGS: Mapping[tuple[str, str], str] = MappingProxyType(
    {
        ("Coulomb", "velocity_rad_s"): "friction falls or bends with speed",
        ("Viscous", "velocity_rad_s"): "friction bends with speed",
        ("Coulomb", "direction"): "friction differs by direction",
        ("Viscous", "direction"): "friction differs by direction",
        ("Offset", "direction"): "friction differs by direction",
        ("Viscous", "gearbox_temperature_degc"): "the oil thins",
        ("Coulomb", "gearbox_temperature_degc"): "friction changes with the gearbox temperature",
        ("Coulomb", "load_torque_nm"): "friction grows with the load on the gear",
        ("Coulomb", "arm_position_rad"): "a tight spot",
        ("Offset", "arm_position_rad"): "a cable, gravity or a local fault",
        ("Coulomb", "after_reversal_rad"): "presliding",
        ("Offset", "after_reversal_rad"): "presliding or backlash",
        ("Gravity", "recording"): "another payload",
        ("Coulomb", "recording"): "friction changes with time or use",
        ("Viscous", "recording"): "friction changes with time or use",
        ("Coulomb", "elapsed_s"): "run-in or wear",
        ("Viscous", "elapsed_s"): "run-in or wear",
        ("Scale", "motor_temperature_degc"): "the magnets weaken with warmth",
        ("Offset", "order_per_motor_rev"): "torque ripple",
        ("Inertia", "order_per_motor_rev"): "the gear's ratio wobbles",
        ("Inertia", "acceleration_rad_s2"): "a soft gear, or torque cut off",
    }
)


@dataclass(frozen=True)
class MapCell:
    """One cell as shown: its text, how dark it is (0 to 10), whether it counts, and more of it."""

    text: str
    level: int
    counts: bool
    detail: str


@dataclass(frozen=True)
class MapRow:
    """One axis."""

    label: str
    cells: tuple[MapCell, ...]


@dataclass(frozen=True)
class RankedCell:
    """One cell in the list of all, the greatest gain among those that count first."""

    name: str
    gain: str
    p_value: str
    counts: bool
    reads_as: str


@dataclass(frozen=True)
class HeatMap:
    """The map: names of its columns, its rows, and the whole of it as a sorted list."""

    columns: tuple[str, ...]
    rows: tuple[MapRow, ...]
    sentence: str
    ranked: tuple[RankedCell, ...]


def heat_map(cells: Sequence[Cell]) -> HeatMap | None:
    """Arrange the cells: axes down, those that count first, then by gain; None without a cell.

    Parameters
    ----------
    cells : sequence of Cell
        In any order. Where several share a place (one axis at several orders), the one that counts
        with the largest gain stands for them; the list has them all.
    """
    if not cells:
        return None
    best: dict[tuple[str, str], Cell] = {}
    for cell in cells:
        place = (cell.parameter, cell.axis)
        if place not in best or _weight(cell) > _weight(best[place]):
            best[place] = cell
    parameters = _in_order({cell.parameter for cell in cells})
    axes = sorted(
        {cell.axis for cell in cells},
        key=lambda axis: max(_weight(best[p, axis]) for p in parameters if (p, axis) in best),
        reverse=True,
    )
    return HeatMap(
        tuple(parameter_word(p) for p in parameters),
        tuple(
            MapRow(heading(axis_word(axis)), tuple(_cell(best.get((p, axis))) for p in parameters))
            for axis in axes
        ),
        map_in_words(cells),
        tuple(_ranked(cell) for cell in sorted(cells, key=_weight, reverse=True)),
    )


def map_in_words(cells: Sequence[Cell]) -> str:
    """Say which cells count, in one sentence."""
    counting = sorted((cell for cell in cells if cell.counts), key=_weight, reverse=True)
    if not counting:
        return "No cell counts: no number of the simulation has to vary along any axis."
    named = [f"{_name(cell)} ({share(cell.gain)})" for cell in counting[:3]]
    rest = len(counting) - len(named)
    more = f" and {rest} more" if rest else ""
    return f"What has to vary most: {'; '.join(named)}{more}."


def parameter_word(parameter: str) -> str:
    """Return a base parameter in one word."""
    short = parameter
    for unit in _UNITS:
        short = short.removesuffix(unit)
    return _PARAMETERS.get(short) or parameter_label(parameter)


def axis_word(axis: str) -> str:
    """Return an axis of the map in words."""
    return _AXES.get(axis) or variable(axis).label


def _name(cell: Cell) -> str:
    return f"{_subject(cell.parameter)} along {axis_word(cell.axis)}"


def _subject(parameter: str) -> str:
    """Return a base parameter as a sentence names it."""
    word = parameter_word(parameter)
    if word in ("Coulomb", "Viscous"):
        return f"{word.replace('V', 'v')} friction"
    return word.lower()


def _weight(cell: Cell) -> tuple[bool, float]:
    return cell.counts, cell.gain if math.isfinite(cell.gain) else -math.inf


def _in_order(parameters: set[str]) -> list[str]:
    """Sort base parameters as the field writes its regressor, what is unknown last."""
    order = list(_PARAMETERS.values())

    def place(parameter: str) -> tuple[int, str]:
        word = parameter_word(parameter)
        return (order.index(word) if word in order else len(order), parameter)

    return sorted(parameters, key=place)


def _cell(cell: Cell | None) -> MapCell:
    if cell is None or not math.isfinite(cell.gain):
        return MapCell("", 0, counts=False, detail="not tried")
    gain = min(max(cell.gain, 0.0), 1.0)
    # The root spreads the small gains: 2 %, where a cell begins to matter, is seen.
    level = round(LEVELS * math.sqrt(gain))
    text = NO_NUMBER if cell.gain < _BLANK_BELOW else f"{100.0 * gain:.0f}"
    return MapCell(text, level, cell.counts, f"{_name(cell)}: {_detail(cell)}")


def _detail(cell: Cell) -> str:
    gain = "no gain" if cell.gain < _BLANK_BELOW else f"{share(cell.gain)} of the energy"
    return f"{gain}, p {_p_value(cell)}{', counts' if cell.counts else ''}"


def _p_value(cell: Cell) -> str:
    if not math.isfinite(cell.p_value):
        return NO_NUMBER
    return significant(cell.p_value, 2) if cell.p_value > 0.0 else "0"


def reading(cell: Cell) -> str:
    """Return what a cell that counts usually stands for; empty where physics has no word for it."""
    if not cell.counts:
        return ""
    return _READINGS.get((parameter_word(cell.parameter), cell.axis.partition(" ")[0]), "")


def _ranked(cell: Cell) -> RankedCell:
    return RankedCell(
        heading(_name(cell)),
        percent(100.0 * cell.gain, 1),
        _p_value(cell),
        cell.counts,
        heading(reading(cell)),
    )
