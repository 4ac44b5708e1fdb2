"""Noise like that of the measured motion, drawn anew: what it does to a simulation can be seen.

A reported velocity has white noise of its own, a differenced one that of its position. Both are
read off the spectrum above all that a joint does; of noise that a drive has filtered less is seen
there than there is below.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.rows.pieces import Piece
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.physics.derivative import slope

_SEGMENT = 256  # samples
_FROM_SHARE, _FROM_BANDS = 0.15, 2.0  # of the sampling rate, and times the comparison's band
_SMOOTHED = 9  # bins: the median of so many passes over lines
_FOURTH = math.sqrt(70.0)  # of white noise, its fourth differences
_MEDIAN = math.log(2.0)  # of a power with two degrees of freedom, over its mean


def drawn_noise_rad_s(table: Table, rng: np.random.Generator) -> Floats:
    """Return noise like that of the unfiltered velocity, shape (N,).

    Parameters
    ----------
    table : Table
    rng : numpy.random.Generator
    """
    out = np.zeros(table.full["velocity_raw_rad_s"].shape[0])
    reported = [piece for piece in table.pieces if _is_reported(table, piece)]
    sizes = {period: _sizes(table, own) for period, own in _by_period(reported).items()}
    for piece in table.pieces:
        drawn = rng.standard_normal(piece.full.stop - piece.full.start + 1)
        if _is_reported(table, piece):
            white, differenced = sizes[_period(piece)]
            other = rng.standard_normal(drawn.shape[0])
            out[piece.full] = white * drawn[1:] + differenced * np.diff(other)
        else:
            out[piece.full] = slope(_position_noise_rad(table, piece) * drawn[1:], piece.period_s)
    return out


def _is_reported(table: Table, piece: Piece) -> bool:
    return table.runs[piece.run].signals.velocity_rad_s is not None


def _as_sampled(table: Table, piece: Piece) -> Floats:
    velocity = table.runs[piece.run].signals.velocity_rad_s
    assert velocity is not None
    own = velocity[piece.stretch.index]
    return own[np.isfinite(own)]


def _period(piece: Piece) -> float:
    return round(piece.period_s, 6)


def _by_period(pieces: Sequence[Piece]) -> dict[float, list[Piece]]:
    out: dict[float, list[Piece]] = {}
    for piece in pieces:
        out.setdefault(_period(piece), []).append(piece)
    return out


def _position_noise_rad(table: Table, piece: Piece) -> float:
    """Return the size of a position's white noise, from differences in which no motion is left."""
    rough = np.diff(table.full["position_rad"][piece.full], n=4)
    return float(np.sqrt(np.mean(rough**2))) / _FOURTH if rough.size else 0.0


def _sizes(table: Table, pieces: Sequence[Piece]) -> tuple[float, float]:
    """Return the sizes of a velocity's white noise, and of white noise that was differenced."""
    from scipy.optimize import nnls

    window = np.hanning(_SEGMENT)
    # As sampled: what is brought onto an even grid in between has lost some of its noise.
    velocities = [_as_sampled(table, piece) for piece in pieces]
    segments = [
        velocity[first : first + _SEGMENT]
        for velocity in velocities
        for first in range(0, velocity.shape[0] - _SEGMENT + 1, _SEGMENT // 2)
    ]
    # What is reported in steps may stand still in most of them: no noise is read off there.
    segments = [segment for segment in segments if np.ptp(segment) > 0.0]
    if not segments:
        rough = np.concatenate([np.diff(velocity, n=3) for velocity in velocities])
        return (float(np.sqrt(np.mean(rough**2) / 20.0)) if rough.size else 0.0), 0.0
    # Third differences first: what a window lets through of a motion is far above such noise.
    rough = np.diff(np.array(segments), n=3, axis=1)
    power = np.abs(np.fft.rfft(rough * window[3:], axis=1)) ** 2 / float(window[3:] @ window[3:])
    share = np.fft.rfftfreq(rough.shape[1])
    once = 4.0 * np.sin(math.pi * share) ** 2
    lowest = max(_FROM_SHARE, _FROM_BANDS * table.cutoff_hz * _period(pieces[0]))
    high = share >= min(lowest, 0.4)
    level = np.median(power[:, high], axis=0) / _MEDIAN / once[high] ** 3
    pad = np.pad(level, _SMOOTHED // 2, mode="edge")
    level = np.median(np.lib.stride_tricks.sliding_window_view(pad, _SMOOTHED), axis=1)
    there = level > 0.0
    if not there.any():
        return 0.0, 0.0
    laws = np.stack((np.ones_like(level), once[high]), axis=-1)[there]
    found = nnls(laws / level[there, np.newaxis], np.ones(laws.shape[0]))[0]
    return math.sqrt(found[0]), math.sqrt(found[1])
