"""How much of the torque no model can explain: the noise floor by three routes."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from agent.explain.answer.result import Floor
from agent.explain.rows.pieces import Piece
from agent.explain.rows.resolution import resolution_nm
from agent.explain.rows.strata import STEADY
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass

_WINDOW_S, _SHORTEST_S = 0.5, 0.25
_FEWEST_WINDOWS, _FEWEST_SHORT = 8, 12
_FEWEST_INDEPENDENT = 6.0  # samples in a window: fewer do not bear a parabola
_TREND = 3  # numbers that a parabola takes
_LOUD = 1.5  # times a joint's own noise: the band lets less of the motion's noise into a simulation
_AS_FAST = 15  # windows, about as fast as one
_UNUSUAL, _A_FEW = 10.0, 0.3  # times what is usual; of the windows: of more it would be usual
_SAME_SPEED, _SAME_PLACE = 0.01, 0.02


def noise_floor(table: Table, residual_nm: Floats) -> Floor:
    """Return the noise floor in the table's band.

    Parameters
    ----------
    table : Table
    residual_nm : ndarray, shape (n,)
        What a model leaves. The neighbours' route looks at how it scatters about a parabola within
        half a second of steady motion (longer in a narrow band), which no slow misfit enlarges.

    Returns
    -------
    Floor
        Its value is the neighbours' route, else the repeated passes: a joint that stands has
        another noise than one that moves. No less than the rounding of a torque that was reported
        in coarser steps than its noise, and than what differences and filters make of any torque.
    """
    neighbours = _neighbours(table, residual_nm)
    if table.simulated:  # what shakes the motion may shake an arm that it has
        own = _neighbours(table, table.given_nm if table.exchanged else table.measured_nm)
        neighbours = own if neighbours > _LOUD * own else neighbours
    repeats = _repeats(table, residual_nm)
    standstill = _standstill(table)
    value = next((v for v in (neighbours, repeats) if math.isfinite(v)), math.nan)
    if math.isfinite(value):
        value = max(value, resolution_nm(table), table.exact_nm)
    return Floor(value, repeats, neighbours, standstill)


def _window_s(piece: Piece, at_least_s: float = _WINDOW_S) -> float:
    """Return half a second, or as long as a narrow band needs to bear a parabola."""
    return max(at_least_s, _FEWEST_INDEPENDENT / (2.0 * piece.cutoff_hz))


def steady_windows(table: Table) -> list[tuple[slice, float]]:
    """Return short windows of rows of steady motion, and how many samples each is worth.

    Where the acceleration's own noise, or what shakes the joint, hides that motion is steady, those
    of the speeds that are held. Where neither lasts, as in short moves, windows half as long.
    """
    steady = table.used & (table.stratum == STEADY)
    held = table.used & (table.rows["held_rad_s"] != 0.0)
    windows = _windows_in(table, steady)
    if len(windows) >= _FEWEST_WINDOWS:
        return windows
    windows = max(windows, _windows_in(table, held), key=len)
    if len(windows) >= _FEWEST_WINDOWS:
        return windows
    short = max((_windows_in(table, each, _SHORTEST_S) for each in (steady, held)), key=len)
    return short if len(short) >= _FEWEST_SHORT else windows


def _windows_in(
    table: Table, steady: NDArray[np.bool_], at_least_s: float = _WINDOW_S
) -> list[tuple[slice, float]]:
    out = []
    for piece in table.pieces:
        window_s = _window_s(piece, at_least_s)
        length = max(4, round(window_s / (piece.period_s * piece.stride)))
        flags = steady[piece.rows].astype(np.int8)
        edges = np.flatnonzero(np.diff(flags, prepend=0, append=0))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            for at in range(begin, end - length + 1, length):
                first = piece.rows.start + at
                worth = min(2.0 * piece.cutoff_hz * window_s, float(length))
                out.append((slice(first, first + length), worth))
    return out


def _neighbours(table: Table, residual_nm: Floats) -> float:
    """Return the scatter about a parabola within short windows, N m.

    What happens in a few of them, where motion about as fast is quiet, is no noise.
    """
    variances, speeds = list[float](), list[float]()
    for window, independent in steady_windows(table):
        if round(independent, 6) >= _FEWEST_INDEPENDENT:
            variances.append(variance_about_trend(residual_nm[window], independent))
            speeds.append(abs(float(np.mean(table.rows["velocity_rad_s"][window]))))
    if len(variances) < _FEWEST_WINDOWS:
        return math.nan
    return math.sqrt(float(np.mean(_as_it_is_usual(np.array(variances), np.array(speeds)))))


def _as_it_is_usual(variances: Floats, speeds: Floats) -> Floats:
    """Return variances, shape (n,), of which none is far above those of windows about as fast.

    Noise of one drive is alike in all windows of a speed. A torque that jumps every few seconds is
    in some of them, with many times the noise's energy.
    """
    order = np.argsort(speeds, kind="stable")
    count = min(_AS_FAST, order.shape[0])
    beside = np.clip(np.arange(order.shape[0]) - count // 2, 0, order.shape[0] - count)
    usual = np.empty_like(variances)
    usual[order] = [np.median(variances[order[at : at + count]]) for at in beside]
    unusual = variances > _UNUSUAL * usual
    return np.where(unusual & (np.mean(unusual) < _A_FEW), usual, variances)


def variance_about_trend(values: Floats, independent: float) -> float:
    """Return the variance of noise about a parabola, the noise that the parabola takes included.

    Noise of a drive is slow in part, so that a parabola takes more of it than its share of the
    numbers: about as much as is in the next three shapes, which no trend has bent.

    Parameters
    ----------
    values : ndarray, shape (n,)
    independent : float
        How many samples they are worth.
    """
    shapes = _shapes(values.shape[0])
    own = shapes.T @ values
    left = values - shapes[:, :_TREND] @ own[:_TREND]
    if shapes.shape[1] < 2 * _TREND:
        return float(np.mean(left**2)) * independent / (independent - _TREND)
    taken = own[_TREND:]
    return float(left @ left + taken @ taken) / len(values)


@lru_cache(maxsize=64)
def _shapes(count: int) -> Floats:
    """Return a parabola's three shapes over so many rows, and the next three, orthonormal, (n, 6).

    The first three alone where there are not twice as many rows as shapes.
    """
    degree = 2 * _TREND - 1 if count >= 4 * _TREND else _TREND - 1
    shapes = np.linalg.qr(legvander(np.linspace(-1.0, 1.0, count), degree))[0]
    shapes.flags.writeable = False
    return np.asarray(shapes)


def _repeats(table: Table, residual_nm: Floats) -> float:
    """Return how much passes at the same speed, over the same places of one run, differ, N m."""
    if not table.has("position_rad"):
        return math.nan
    velocity, position = table.rows["velocity_rad_s"], table.rows["position_rad"]
    passes = [
        (
            int(table.run[window.start]),
            float(np.mean(velocity[window])),
            float(np.mean(position[window])),
            window,
        )
        for window, _ in steady_windows(table)
    ]
    stroke = float(np.ptp(position[table.used])) if table.used.any() else 0.0
    squares = []
    taken: set[int] = set()
    for i, (run, speed, place, window) in enumerate(passes):
        if i in taken:
            continue
        for j in range(i + 1, len(passes)):
            other = passes[j]
            if j in taken or other[0] != run or abs(other[1] - speed) > _SAME_SPEED * abs(speed):
                continue
            if abs(other[2] - place) > _SAME_PLACE * stroke or other[3].start < window.stop + 2:
                continue
            taken.update((i, j))
            first, second = residual_nm[window], residual_nm[other[3]]
            length = min(first.shape[0], second.shape[0])
            difference = first[:length] - second[:length]
            squares.append(0.5 * float(np.mean(difference**2)))
            break
    return math.sqrt(float(np.mean(squares))) if len(squares) >= _FEWEST_WINDOWS else math.nan


def _standstill(table: Table) -> float:
    """Return the torque's scatter while the joint stands, N m.

    The median over short windows, each about its own parabola: a joint that stands may still be
    pulled from one holding torque to another, which is no noise.
    """
    variances = []
    for piece in table.pieces:
        independent = 2.0 * piece.cutoff_hz * _window_s(piece)
        still = table.full["direction"][piece.full] == 0.0
        torque = lowpass(table.full["torque_nm"][piece.full], piece.period_s, piece.cutoff_hz)
        edges = np.flatnonzero(np.diff(still.astype(np.int8), prepend=0, append=0))
        margin = math.ceil(1.5 / (piece.cutoff_hz * piece.period_s))
        length = round(_window_s(piece) / piece.period_s)
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            for at in range(begin + margin, end - margin - length + 1, length):
                inner = torque[at : at + length]
                variances.append(variance_about_trend(inner, independent))
    return math.sqrt(float(np.median(variances))) if variances else math.nan
