"""The direction of motion, which dry friction has: the thresholded sign of thesis (4.10).

A low-pass moves the turn between two unlike speeds in time, towards the slower one. One sample of a
stair of 20 s whose friction so had the wrong sign moved gravity by half of a standard error. So a
turn is where the motor's angle is extreme, as far as the velocity's noise lets that be seen.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass

SIGN_BAND = 4.0
"""The sign is taken from a velocity that keeps so many times the cutoff."""

_SIGMAS = 4.0
_REACH = 0.5  # of that band's period: by so much at most the low-pass moves a turn
_BESIDE = 2  # samples to either side of a turn, by which its slope is told
_PARABOLA = np.array([-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0]) / 21.0
_LEFT = math.sqrt(1.0 / 3.0)  # of white noise behind that


def direction_of(velocity: Floats, period_s: float, cutoff_hz: float, noise_rad_s: float) -> Floats:
    """Return the thresholded sign of the velocity, -1, 0 or 1, shape (n,) (thesis 4.10).

    Parameters
    ----------
    velocity : ndarray, shape (n,)
        Unfiltered velocity, rad/s.
    period_s, cutoff_hz : float
        Sampling period, and cutoff of the filter to come.
    noise_rad_s : float
        Standard deviation of the unfiltered velocity's white noise.
    """
    band_hz = SIGN_BAND * cutoff_hz
    smooth = lowpass(velocity, period_s, band_hz)
    left = noise_rad_s * np.sqrt(min(2.0 * band_hz * period_s, 1.0))
    # Without noise, numerical dust around standstill must not look like motion.
    threshold = max(_SIGMAS * left, 1e-6 * float(np.max(np.abs(velocity), initial=0.0)))
    return np.where(np.abs(smooth) > threshold, np.sign(smooth), 0.0)


def direction_in_time(
    velocity: Floats, period_s: float, cutoff_hz: float, noise_rad_s: float
) -> Floats:
    """Return the same with every turn in its own samples, as far as the velocity shows them.

    Parameters
    ----------
    velocity, period_s, cutoff_hz, noise_rad_s
        As of `direction_of`.
    """
    direction = direction_of(velocity, period_s, cutoff_hz, noise_rad_s)
    known = _without_chance(direction, velocity, noise_rad_s)
    reach = round(_REACH / (SIGN_BAND * cutoff_hz * period_s))
    return _turned(known, velocity, reach, noise_rad_s)


def _without_chance(direction: Floats, velocity: Floats, noise_rad_s: float) -> Floats:
    """Return directions without legs that are no longer than noise makes them, shape (n,).

    A joint that only just stops between two passes of one direction does not go back by that.
    """
    out = direction.copy()
    edges = np.flatnonzero(np.diff(direction, prepend=0.0, append=0.0))
    path = np.concatenate(([0.0], np.cumsum(velocity)))
    for begin, end in itertools.pairwise(edges):
        if abs(path[end] - path[begin]) <= _SIGMAS * noise_rad_s * math.sqrt(end - begin):
            out[begin:end] = 0.0
    return out


def _turned(direction: Floats, velocity: Floats, reach: int, noise_rad_s: float) -> Floats:
    """Return directions that change where the angle is extreme, shape (n,).

    Where the velocity's noise is less than it changes by in a sample, samples about a turn have the
    direction of a parabola through their neighbours, or none within one standard error of it. Else
    a change is moved where the angle between both places is more than that noise makes it, and what
    was unknown stays so.

    Parameters
    ----------
    direction, velocity : ndarray, shape (n,)
        Thresholded sign of the low-passed velocity, and the velocity before it.
    reach : int
        Samples by which the low-pass may move a turn; a rest that is longer is none.
    noise_rad_s : float
        Standard deviation of the velocity's white noise.
    """
    out, known = direction.copy(), np.flatnonzero(direction)
    fine, chance = _parabola(velocity), noise_rad_s * _LEFT
    changes = np.flatnonzero(np.diff(direction[known]))
    last, first = known[changes], known[changes + 1]
    middle = (first[:-1] + last[1:]) // 2
    begins = np.maximum(last - reach, np.concatenate(([0], middle)))
    ends = np.minimum(first + reach, np.concatenate((middle, [direction.size])))
    for old, new, begin, end in zip(last + 1, first, begins, ends, strict=True):
        if new - old > reach:
            continue
        way = direction[old - 1]
        path = np.concatenate(([0.0], np.cumsum(way * velocity[begin:end])))
        top = np.flatnonzero(path == path.max())
        at = int(begin + (top[0] + top[-1]) // 2)
        change = np.ptp(velocity[max(at - _BESIDE, 0) : at + _BESIDE]) / (2 * _BESIDE - 1)
        if _SIGMAS * noise_rad_s <= change:
            own = slice(max(min(at, old) - 1, 0), max(at, new) + 1)
            out[own] = np.where(np.abs(fine[own]) > chance, np.sign(fine[own]), 0.0)
            continue
        near = min(max(at, old), new)
        doubt = _SIGMAS * noise_rad_s * math.sqrt(abs(at - near))
        if path[at - begin] - path[near - begin] > doubt:
            out[at:near], out[near:at] = -way, way
    return out


def _parabola(values: Floats) -> Floats:
    """Return the middles of parabolas through seven samples each (Savitzky and Golay 1964)."""
    reach = _PARABOLA.size // 2
    out = values.copy()
    if values.size > 2 * reach:
        out[reach:-reach] = np.convolve(values, _PARABOLA, mode="valid")
    return out
