"""Single rows that no drive can have meant: one sample far from both its neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals

_BEYOND = 8.0  # times what one row in a thousand departs from its neighbours: 26 sigmas of noise
_ONE_IN = 0.999
_BETWEEN = 0.25  # of the departure, at most, lies between the neighbours: else it is a step
_LEAST = 0.1  # of the signal's range
_FEWEST = 200  # rows


def without_glitches(runs: Sequence[Run]) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return recordings without single rows that stand alone, and what is to be said of them.

    One sample of torque 50 times the noise off outweighs minutes of what is to be explained.

    Parameters
    ----------
    runs : sequence of Run
    """
    out, said = [], []
    for run in runs:
        alone = _alone(run.signals)
        out.append(run)
        if alone.any():
            kept = replace(run.signals, valid=run.signals.valid & ~alone)
            out[-1] = replace(run, signals=kept)
            times = ", ".join(f"{t:.6g}" for t in run.signals.time_s[alone][:3])
            rows = "1 row" if alone.sum() == 1 else f"{alone.sum()} rows"
            said.append(
                f"{run.name}: {rows} far from both neighbours (at {times} s) "
                f"{'was' if alone.sum() == 1 else 'were'} left out"
            )
    return tuple(out), tuple(said)


def _alone(signals: Signals) -> NDArray[np.bool_]:
    """Return which rows stand alone in torque, velocity or position, shape (n,)."""
    out = np.zeros(signals.time_s.shape, np.bool_)
    rows = np.flatnonzero(signals.valid)
    if rows.shape[0] < _FEWEST:
        return out
    for values in (signals.torque_nm, signals.velocity_rad_s):
        if values is not None:
            out[rows[1:-1][_spikes(values[rows], _least(values[rows]))]] = True
    if signals.position_rad is not None:
        position = signals.position_rad[rows]
        steps = np.abs(np.diff(position))
        driven = float(np.quantile(steps, _ONE_IN))  # as far as the joint gets from row to row
        out[rows[1:-1][_spikes(position, driven)]] = True
        for end in (0, -1):
            out[rows[end]] |= driven > 0.0 and bool(steps[end] > _BEYOND * driven)
    return out


def _spikes(values: Floats, least: float) -> NDArray[np.bool_]:
    """Return which of the inner values, (n - 2,), are far from two neighbours that agree."""
    departs = np.abs(values[1:-1] - (values[2:] + values[:-2]) / 2.0)
    usual = max(float(np.quantile(departs, _ONE_IN)), least)
    between = np.abs(values[2:] - values[:-2])
    far = (usual > 0.0) & (departs > _BEYOND * usual) & (between < _BETWEEN * departs)
    return np.asarray(far)


def _least(values: Floats) -> float:
    """Return an eighth of a departure that is worth a word: a kink of a smooth motion is none."""
    low, high = np.quantile(values, (1.0 - _ONE_IN, _ONE_IN))
    return _LEAST / _BEYOND * float(high - low)
