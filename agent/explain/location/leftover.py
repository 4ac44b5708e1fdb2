"""Where a mismatch lies that no effect carries: bins of what is left, against the noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Region
from agent.explain.location.regions import axis_values, row_seconds
from agent.explain.rows.lines import Line
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_BINS = 30
_FEWEST = 8
_ABOVE = 1.15  # times the noise's root mean square: less is not said to lie anywhere
_SIGMAS = 3.0
_LEAST_SHARE = 0.15
_OF_GREATEST = 0.2  # of the greatest excess: what lies everywhere is still greatest somewhere
_MOST_AXES, _MOST_REGIONS = 2, 3
_HALF_ORDER = 0.5
_AS_COLUMN = {
    "direction": "velocity_rad_s",
    "after_reversal_rad": "after_reversal_s",
    "elapsed_s": "recording",
}


def left_regions(
    scene: Scene,
    rows: NDArray[np.int64],
    left_nm: Floats,
    floor_nm: float,
    independent: float,
    axes: tuple[str, ...],
) -> tuple[Region, ...]:
    """Return where along some axes a residual exceeds the noise, connected, with seconds.

    Parameters
    ----------
    scene : Scene
    rows : ndarray of int, shape (m,)
    left_nm : ndarray, shape (m,)
        What the model leaves at the rows.
    floor_nm : float
    independent : float
        Share of the rows that counts as independent.
    axes : tuple of str
        As the deficiency map names them, the most telling first.

    Returns
    -------
    tuple of Region
        `share` is of the residual's energy above the noise.
    """
    out: list[Region] = []
    seen: list[str] = []
    for axis in axes:
        if axis.startswith("frequency_hz"):
            continue
        variable = _variable(axis, scene)
        if variable in seen or len(seen) == _MOST_AXES:
            continue
        if variable.startswith("order_per_"):
            order = float(axis.split()[1])
            half = min(_HALF_ORDER, 0.5 * order)
            found = [Region(variable, order - half, order + half)]
        else:
            values = axis_values(scene, variable)[rows]
            found = _above_noise(scene, variable, values, left_nm, floor_nm, independent)
        if found:
            seen.append(variable)
            out += found
    return tuple(out[:_MOST_REGIONS])


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


def _variable(axis: str, scene: Scene) -> str:
    """Return the word of contract section 6 for an axis of the map."""
    kind = axis.split(maxsplit=1)[0]
    if kind == "elapsed_s" and len(scene.table.runs) == 1:
        return "time_s"
    return _AS_COLUMN.get(kind, kind)


def _above_noise(
    scene: Scene,
    variable: str,
    values: Floats,
    left_nm: Floats,
    floor_nm: float,
    independent: float,
) -> list[Region]:
    """Return the connected bins in which the residual is clearly more than noise."""
    good = np.isfinite(values)
    values, square = values[good], left_nm[good] ** 2
    edges = _edges(values, variable)
    if edges.shape[0] < 2:
        return []
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.shape[0] - 2)
    count = np.bincount(index, minlength=edges.shape[0] - 1).astype(np.float64)
    total = np.bincount(index, square, edges.shape[0] - 1)
    mean = total / np.maximum(count, 1.0)
    chance = _SIGMAS * np.sqrt(2.0 / np.maximum(count * independent, 1.0))
    high = mean > floor_nm**2 * np.maximum(_ABOVE**2, 1.0 + chance)
    high &= count >= _FEWEST
    greatest = max(float(mean[high].max()) - floor_nm**2, 0.0) if high.any() else 0.0
    high &= mean - floor_nm**2 >= _OF_GREATEST * greatest
    excess = np.maximum(total - count * floor_nm**2, 0.0)
    ends = np.flatnonzero(np.diff(_joined(high).astype(np.int8), prepend=0, append=0))
    out = []
    for begin, end in zip(ends[::2], ends[1::2], strict=True):
        share = float(excess[begin:end].sum()) / max(float(excess.sum()), 1e-300)
        if share < _LEAST_SHARE:
            continue
        seconds = row_seconds(scene.table.pieces) * float(count[begin:end].sum())
        low, up = float(edges[begin]), float(edges[end])
        if variable == "recording":
            low, up = low + 0.5, up - 0.5
        out.append(Region(variable, low, up, seconds, share))
    return sorted(out, key=lambda region: -region.share)


def _joined(high: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return flags with single holes closed: one quiet bin does not make two places of one."""
    out = high.copy()
    out[1:-1] |= high[:-2] & high[2:]
    return out


def _edges(values: Floats, variable: str) -> Floats:
    if variable == "recording":
        return np.append(np.unique(values) - 0.5, float(values.max()) + 0.5)
    points = np.linspace(0.0, 1.0, _BINS + 1)
    if variable in ("velocity_rad_s", "acceleration_rad_s2", "after_reversal_s"):
        return np.unique(np.quantile(values, points))
    low, high = (float(x) for x in np.quantile(values, [0.001, 0.999]))
    return low + (high - low) * points if high > low else np.zeros(0)
