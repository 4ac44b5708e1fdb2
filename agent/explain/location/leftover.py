"""Where a mismatch lies that no effect carries: bins of what is left, against the noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.located import Cell, Region, Spells, Varying
from agent.explain.location.deficiency import is_loaded, parameters_of
from agent.explain.location.regions import axis_values, row_seconds
from agent.explain.location.spells import spells_of
from agent.explain.location.varying import FEWEST, OF_GREATEST, Bins, varying
from agent.explain.rows.lines import Line
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_ABOVE = 1.15  # times the noise's root mean square: less is not said to lie anywhere
_SIGMAS = 3.0
_MOST_AXES, _MOST_REGIONS = 2, 3
_HALF_ORDER = 0.5
_BETWEEN = ("gearbox_temperature_degc", "motor_temperature_degc", "recording")
_CARRIES_MOST, _CLEARLY = 0.6, 1.1  # of what is left; times what another number carries
_EVERYWHERE = 0.8  # of the rows: a place that is so large is none
_TRAVEL = "after_reversal_rad"
_AS_COLUMN = {
    "direction": "velocity_rad_s",
    _TRAVEL: "after_reversal_s",
    "elapsed_s": "recording",
}


@dataclass(frozen=True)
class LeftWhere:
    """Where a mismatch without a name lies, and which number would have to vary there.

    Parameters
    ----------
    regions : tuple of Region
        Connected, with seconds; `share` is of the residual's energy above the noise.
    varies : Varying or None
        Of the cell of the deficiency map that gains most.
    spells : Spells or None
        When it is there, where it lies in no region.
    """

    regions: tuple[Region, ...] = ()
    varies: Varying | None = None
    spells: Spells | None = None


def left_where(
    scene: Scene,
    rows: NDArray[np.int64],
    left_nm: Floats,
    floor_nm: float,
    independent: float,
    cells: Sequence[Cell],
) -> LeftWhere:
    """Return where along some axes a residual exceeds the noise.

    Parameters
    ----------
    scene : Scene
    rows : ndarray of int, shape (m,)
    left_nm : ndarray, shape (m,)
        What the model leaves at the rows.
    floor_nm : float
    independent : float
        Share of the rows that counts as independent.
    cells : sequence of Cell
        Those of the deficiency map that count, the most telling first.
    """
    left = _Left(scene, rows, left_nm, floor_nm, independent)
    out, first = _in_cells(left, cells)
    if cells and cells[0].axis == _TRAVEL:
        first = _more_telling(first, _by_travel(left, cells[0].parameter))
    between = _between_recordings(left)
    if between is not None and (first is None or between.share > _CLEARLY * first.share):
        first, out = between, [*between.regions]
    if first is None:
        # What no number that varies carries comes and goes by itself: its spells say more than an
        # axis along which it is nearly everywhere.
        spells = spells_of(scene.table, rows, left_nm, floor_nm, independent)
        if spells is not None or not out:
            return LeftWhere(spells=spells)
    return LeftWhere(_places(out, left.row_s * rows.shape[0])[:_MOST_REGIONS], first)


@dataclass(frozen=True)
class _Left:
    """What a model leaves at some rows of a scene, as `left_where` is given it."""

    scene: Scene
    rows: NDArray[np.int64]
    left_nm: Floats
    floor_nm: float
    independent: float

    @cached_property
    def columns(self) -> Mapping[str, Floats]:
        """Return the column of each of the twin's numbers, shape (N,) each."""
        return parameters_of(self.scene)

    @cached_property
    def row_s(self) -> float:
        """Return how long a row lasts."""
        return row_seconds(self.scene.table.pieces)

    def along(self, variable: str) -> tuple[Bins | None, NDArray[np.bool_]]:
        """Return an axis in bins, and which of the rows it is known at, shape (m,)."""
        values = axis_values(self.scene, variable)[self.rows]
        there = np.isfinite(values)
        return Bins.of(variable, values[there]), there

    def varies(self, parameter: str, bins: Bins, there: NDArray[np.bool_]) -> Varying | None:
        """Return how a number would have to vary over bins of the rows that are there."""
        column, number = self.columns[parameter][self.rows][there], _number(parameter, self.scene)
        left_nm, noise = self.left_nm[there], (self.floor_nm, self.independent)
        return varying(bins, number, column, left_nm, *noise, self.row_s)

    def above_noise(self, bins: Bins, there: NDArray[np.bool_]) -> tuple[Region, ...]:
        """Return the connected bins in which the residual is clearly more than noise."""
        total = bins.total(self.left_nm[there] ** 2)
        mean = total / np.maximum(bins.count, 1.0)
        chance = _SIGMAS * np.sqrt(2.0 / np.maximum(bins.count * self.independent, 1.0))
        high = mean > self.floor_nm**2 * np.maximum(_ABOVE**2, 1.0 + chance)
        high &= bins.count >= FEWEST
        greatest = max(float(mean[high].max()) - self.floor_nm**2, 0.0) if high.any() else 0.0
        high &= mean - self.floor_nm**2 >= OF_GREATEST * greatest
        excess = np.maximum(total - bins.count * self.floor_nm**2, 0.0)
        return bins.regions(high, excess, self.row_s)


def _in_cells(left: _Left, cells: Sequence[Cell]) -> tuple[list[Region], Varying | None]:
    """Return where it lies along the axes of the most telling cells, and what varies in the first.

    Frequency is no place: what swings there is told by its line.
    """
    out: list[Region] = []
    seen: list[str] = []
    first: Varying | None = None
    for cell in cells:
        if cell.axis.startswith("frequency_hz"):
            continue
        variable = _variable(cell.axis, left.scene)
        if variable in seen or len(seen) == _MOST_AXES:
            continue
        if variable.startswith("order_per_"):
            order = float(cell.axis.split()[1])
            half = min(_HALF_ORDER, 0.5 * order)
            seen.append(variable)
            out.append(Region(variable, order - half, order + half))
            continue
        bins, there = left.along(variable)
        if bins is None:
            continue
        own = left.varies(cell.parameter, bins, there)
        found = own.regions if own else left.above_noise(bins, there)
        first = own if cell is cells[0] else first
        if found:
            seen.append(variable)
            out += found
    return out, first


def _by_travel(left: _Left, parameter: str) -> Varying | None:
    """Return how a number would have to vary with the travel since a reversal."""
    bins = Bins.of(_TRAVEL, left.scene.table.rows["travel_rad"][left.rows])
    everywhere = np.ones(left.rows.shape[0], dtype=np.bool_)
    return None if bins is None else left.varies(parameter, bins, everywhere)


def _between_recordings(left: _Left) -> Varying | None:
    """Return the number that carries most of it from recording to recording; None for none.

    The map leaves out whole recordings, each of which may be the only one that is so warm: what
    differs between them does not count there. Warmth comes before the mere recording.
    """
    best: Varying | None = None
    for variable in _BETWEEN:
        if variable != "recording" and not left.scene.has(variable):
            continue
        bins, there = left.along(variable)
        if bins is None:
            continue
        for parameter in left.columns:
            own = left.varies(parameter, bins, there)
            least = _CARRIES_MOST if best is None else _CLEARLY * best.share
            best = own if own is not None and own.share > least else best
    return best


def _more_telling(by_time: Varying | None, by_travel: Varying | None) -> Varying | None:
    """Return what varies since a reversal along the axis on which it carries more."""
    if by_time is None or by_travel is None:
        return by_time or by_travel
    return by_time if by_time.share >= by_travel.share else by_travel


def _places(regions: Sequence[Region], whole_s: float) -> tuple[Region, ...]:
    """Return the regions that are places; where there is none, what lies everywhere, as that."""
    large = [region.seconds > _EVERYWHERE * whole_s for region in regions]
    places = tuple(r for r, everywhere in zip(regions, large, strict=True) if not everywhere)
    return places or tuple(replace(region, everywhere=True) for region in regions[:1])


def line_regions(lines: Sequence[Line]) -> tuple[Region, ...]:
    """Return the frequencies at which the torque swings of its own, as far as they matter."""
    return tuple(
        Region(
            "frequency_hz",
            line.frequency_hz - line.half_width_hz,
            line.frequency_hz + line.half_width_hz,
        )
        for line in lines
        if line.matters
    )


def _number(parameter: str, scene: Scene) -> str:
    """Return what a column of the map is one of: of the load, where there is one, its own part."""
    own = parameter != "gravity" or is_loaded(scene)
    return parameter if own else "gravity_sin_nm"


def _variable(axis: str, scene: Scene) -> str:
    """Return the word of contract section 6 for an axis of the map."""
    kind = axis.split(maxsplit=1)[0]
    if kind == "elapsed_s" and len(scene.table.runs) == 1:
        return "time_s"
    return _AS_COLUMN.get(kind, kind)
