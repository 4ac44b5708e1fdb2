"""Single rows that no drive can have meant: out of line with the rows beside, or at an end."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals

_BEYOND = 8.0  # times what one row in a thousand departs from its neighbours: 26 sigmas of noise
_ONE_IN = 0.999
_OF_MANY = 0.99
_TAIL = 1.6  # times what one row in a hundred departs: what one in a thousand of noise does at most
_BETWEEN = 0.25  # of the departure, at most, lies between the neighbours: else it is a step
_LEAST = 0.1  # of the signal's range
_FEWEST = 200  # rows
_LAST_ROWS = 3  # of either end: so many may be a logger's that was stopped, or a difference's


def without_glitches(signals: Signals) -> tuple[Signals, str]:
    """Return a recording without single rows that stand alone, and what is to be said of them.

    One sample of torque 50 times the noise off outweighs minutes of what is to be explained; one
    of position is a speed that no motor has.

    Parameters
    ----------
    signals : Signals

    Returns
    -------
    signals : Signals
        The same one where no row stands alone.
    said : str
        Nothing where no row does.
    """
    alone = _alone(signals)
    if not alone.any():
        return signals, ""
    times = ", ".join(f"{t:.6g}" for t in signals.time_s[alone][:3])
    rows = "1 row" if alone.sum() == 1 else f"{alone.sum()} rows"
    said = (
        f"{signals.name}: {rows} out of line with the rows beside (at {times} s) "
        f"{'was' if alone.sum() == 1 else 'were'} left out"
    )
    return replace(signals, valid=signals.valid & ~alone), said


def _alone(signals: Signals) -> NDArray[np.bool_]:
    """Return which rows stand alone in torque, velocity or position, shape (n,)."""
    out = np.zeros(signals.time_s.shape, np.bool_)
    rows = np.flatnonzero(signals.valid)
    if rows.shape[0] < _FEWEST:
        return out
    time_s = signals.time_s[rows]
    for values in (signals.torque_nm, signals.velocity_rad_s):
        if values is not None:
            least = _least(values[rows])
            out[rows[1:-1][_spikes(values[rows], least)]] = True
            out[rows[_broken_ends(values[rows], time_s, least)]] = True
    if signals.velocity_rad_s is not None:
        torque = signals.torque_nm[rows]
        kicks = _spikes(torque, _least(torque), at_most=_TAIL * _usual(_departs(torque), _OF_MANY))
        out[rows[1:-1][kicks & ~_kinks(signals.velocity_rad_s[rows])]] = True
    if signals.position_rad is not None:
        position = signals.position_rad[rows]
        steps = np.abs(np.diff(position))
        driven = _usual(steps)  # as far as the joint gets from row to row
        out[rows[1:-1][_spikes(position, driven)]] = True
        for end in (0, -1):
            out[rows[end]] |= driven > 0.0 and bool(steps[end] > _BEYOND * driven)
        out[rows[_broken_ends(position, time_s, 0.0)]] = True
    return out


def _departs(values: Floats) -> Floats:
    """Return how far the inner values are from the mean of their neighbours, shape (n - 2,)."""
    return np.asarray(np.abs(values[1:-1] - (values[2:] + values[:-2]) / 2.0))


def _spikes(values: Floats, least: float, at_most: float = math.inf) -> NDArray[np.bool_]:
    """Return which of the inner values, (n - 2,), are far from two neighbours that agree.

    Where more than one row in a thousand is out of line, these are what is usual, unless it is
    said how much that is at most.
    """
    departs = _departs(values)
    usual = max(min(_usual(departs), at_most), least)
    between = np.abs(values[2:] - values[:-2])
    far = (usual > 0.0) & (departs > _BEYOND * usual) & (between < _BETWEEN * departs)
    return np.asarray(far)


def _kinks(velocity: Floats) -> NDArray[np.bool_]:
    """Return where the velocity bends more than it mostly does, shape (n - 2,).

    A kick that the motor really got, as where a joint breaks away, is seen in its velocity.
    """
    bends = _departs(velocity)
    bends[1:-1] = np.maximum(bends[1:-1], np.maximum(bends[2:], bends[:-2]))
    return np.asarray(bends > _usual(bends, _OF_MANY))


def _broken_ends(values: Floats, time_s: Floats, least: float) -> list[int]:
    """Return which first and last rows do not carry on what the rows beside them do.

    The last row of a logger may be the one before, or zero, and a difference has none: as motion it
    is a stop within one sample, which a filter carries far into the recording. What is usual is
    asked where no row is missing.
    """
    steps_s = np.diff(time_s)
    even = steps_s < 1.5 * float(np.median(steps_s))
    departs = np.where(even[1:] & even[:-1], np.abs(np.diff(values, 2)), 0.0)
    # From the line through two a row is twice as far as from the mean of both its neighbours.
    most = _BEYOND * max(_usual(departs), 2.0 * least)
    if not most > 0.0:
        return []
    first = np.flatnonzero(departs[:_LAST_ROWS] > most)
    last = np.flatnonzero(departs[: -_LAST_ROWS - 1 : -1] > most)
    before, behind = (int(end.max(initial=-1)) + 1 for end in (first, last))
    return [*range(before), *range(-behind, 0)]


def _usual(values: Floats, one_in: float = _ONE_IN) -> float:
    """Return what one of a thousand exceeds, but for the three that a row by itself enlarges."""
    return float(np.quantile(np.sort(values)[:-3], one_in))


def _least(values: Floats) -> float:
    """Return an eighth of a departure that is worth a word: a kink of a smooth motion is none."""
    low, high = np.quantile(values, (1.0 - _ONE_IN, _ONE_IN))
    return _LEAST / _BEYOND * float(high - low)
