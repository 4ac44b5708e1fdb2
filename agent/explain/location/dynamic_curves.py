"""What a law with a memory looks like: over the frequency, or in the moment when it shows most.

The torque of an arm that swings has no mean along any axis; its sign is that of the moment.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Curve
from agent.explain.rows.lines import Line
from agent.explain.rows.pieces import Piece
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_BANDS = 24
_BINS_IN_BAND = 3.0  # at least: fewer have no mean to speak of
_SAME_BAND = 0.99  # of the widest: slower stretches do not show what is fast
_NORMAL = 1.96
_EXCERPT_S = 1.0
_DRAWN = 600  # points of a spectrum


def over_frequency(
    scene: Scene, rows: NDArray[np.int64], added_nm: Floats, left_nm: Floats
) -> Curve | None:
    """Return an effect's root mean square torque by bands of frequency.

    Parameters
    ----------
    scene : Scene
    rows : ndarray of int, shape (m,)
        The table's rows that are used.
    added_nm, left_nm : ndarray, shape (m,)
        What the effect adds at the rows, and what the whole model leaves.
    """
    table = scene.table
    pieces = [
        p
        for p in table.pieces
        if table.used[p.rows].any() and p.cutoff_hz >= _SAME_BAND * table.cutoff_hz
    ]
    if not pieces:
        return None
    longest_s = max((p.rows.stop - p.rows.start) * p.stride * p.period_s for p in pieces)
    law, missing = (
        _power(pieces, _at_rows(scene, rows, x), longest_s) for x in (added_nm, added_nm + left_nm)
    )
    hertz = np.arange(law.shape[0]) / longest_s
    edges = _bands(hertz, table.cutoff_hz)
    if edges.shape[0] < 3:
        return None
    index = np.searchsorted(edges, hertz, side="right") - 1
    inside = (index >= 0) & (index < edges.shape[0] - 1)
    line, data = (
        np.sqrt(np.bincount(index[inside], x[inside], edges.shape[0] - 1)) for x in (law, missing)
    )
    count = np.bincount(index[inside], minlength=edges.shape[0] - 1) * len(pieces)
    # A mean of squares over n bins has a relative deviation of 1/sqrt(n), its root of half of that.
    error = _NORMAL * data / (2.0 * np.sqrt(np.maximum(count, 1)))
    at = np.sqrt(edges[1:] * edges[:-1])
    return Curve("frequency_hz", at, line, line, line, at, data, error)


def _at_rows(scene: Scene, rows: NDArray[np.int64], values: Floats) -> Floats:
    out = np.zeros(scene.table.used.shape[0])
    out[rows] = values
    return out


def _power(pieces: Sequence[Piece], values: Floats, longest_s: float) -> Floats:
    """Return the mean square of a signal by bins of one over `longest_s`, shape (f,)."""
    total: Floats | None = None
    used = sum(p.rows.stop - p.rows.start for p in pieces)
    for piece in pieces:
        signal = values[piece.rows]
        length = max(round(longest_s / (piece.period_s * piece.stride)), signal.shape[0])
        power = np.abs(np.fft.rfft(signal, length)) ** 2 * 2.0 / (length * used)
        if total is None:
            total = np.zeros(power.shape[0])
        count = min(total.shape[0], power.shape[0])
        total = total[:count] + power[:count]
    return np.zeros(0) if total is None else total


def _bands(hertz: Floats, cutoff_hz: float) -> Floats:
    """Return edges of bands, even in their logarithm but for the lowest, up to the cutoff."""
    if hertz.shape[0] < 2:
        return np.zeros(0)
    low = _BINS_IN_BAND * float(hertz[1])
    edges = [low]
    ratio = (cutoff_hz / low) ** (1.0 / _BANDS)
    while edges[-1] < cutoff_hz:
        edges.append(max(edges[-1] * ratio, edges[-1] + low))
    return np.array(edges)


def excerpt(
    scene: Scene, rows: NDArray[np.int64], added_nm: Floats, left_nm: Floats
) -> Curve | None:
    """Return the second in which an effect adds most, as it was recorded.

    Parameters
    ----------
    scene : Scene
    rows : ndarray of int, shape (m,)
        The table's rows that are used.
    added_nm, left_nm : ndarray, shape (m,)
        What the effect adds at the rows, and what the whole model leaves.
    """
    law, left = _at_rows(scene, rows, added_nm), _at_rows(scene, rows, left_nm)
    used = _at_rows(scene, rows, np.ones(rows.shape[0])) > 0.0
    best: tuple[float, slice] | None = None
    for piece in scene.table.pieces:
        count = max(4, round(_EXCERPT_S / (piece.period_s * piece.stride)))
        energy = np.concatenate(([0.0], np.cumsum(law[piece.rows] ** 2)))
        if energy.shape[0] <= count:
            continue
        within = energy[count:] - energy[:-count]
        at = int(np.argmax(within))
        if best is None or within[at] > best[0]:
            first = piece.rows.start + at
            best = (float(within[at]), slice(first, first + count))
    if best is None or best[0] <= 0.0:
        return None
    inside = np.arange(best[1].start, best[1].stop)[used[best[1]]]
    time = scene.table.rows["time_s"][inside]
    spread = _NORMAL * float(np.sqrt(np.mean(left_nm**2)))
    line = law[inside]
    nothing = np.zeros(inside.shape[0])
    data = line + left[inside]
    return Curve("time_s", time, line, line - spread, line + spread, time, data, nothing)


def spectrum_around(line: Line) -> Curve | None:
    """Return a line's spectrum as a curve: what is left, over what its neighbourhood has."""
    if line.spectrum is None:
        return None
    hertz, left, background = line.spectrum
    step = max(1, -(-hertz.shape[0] // _DRAWN))
    # The greatest of each few bins: a line is narrower than a point of the picture.
    tops = np.array(
        [k + int(np.argmax(left[k : k + step])) for k in range(0, hertz.shape[0], step)]
    )
    nothing, level = np.zeros(tops.shape[0]), background[tops]
    return Curve(
        "frequency_hz", hertz[tops], level, nothing, level, hertz[tops], left[tops], nothing
    )
