"""How far a quantised encoder's signal may be smoothed before a reversal is rounded off.

Motion, torque and every column of a law pass the same low-pass, so that what is linear stays true
after it. The lowest cutoff is taken at which what the filter removes at the turns is no more than
the encoder's own error.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass

_EXCESS = 0.97  # of the encoder's error: what the filter may take away at the turns
_CALM = 0.9  # of it: above, the filter rounds off the calm turns, too
_CALM_TURNS = 1 / 3  # of all
_HIGHEST = 0.25
_STEPS = 14  # cutoffs to try, each lower by the square root of 2
_JOLT = 1.6  # of the encoder's error: the same over the worst stretch, an impact for example
_SHORTEST = 8  # samples of such a stretch
_ABOUT_S = 0.5  # of the cutoff's period, to either side of a turn
_SWINGS = 0.08  # of the sampling rate: cutoff of the motion that tells where the motor swings
_QUIET = 10.0  # standard errors of its acceleration there: what a line of the steps reaches
_HARD = 0.05  # of the hardest acceleration: that must be less
_CUTOFFS = 12  # to try, each lower by the square root of 2
_BESIDE = 1.2  # of the cutoff's period, to either side of a swing
_IMPULSE = 2001  # samples
_LEFT_OUT = 10  # samples at either end, which a derivative does not reach
_DUST = 1e-9  # of the range: below, two positions are the same number


def resolution(values: Floats) -> tuple[float, float]:
    """Return the step and the standard error of a quantised or noisy signal.

    Where all differences are multiples of the smallest one it is the encoder's step, and the error
    is ``step/sqrt(12)``; otherwise the step is 0 and the error comes from third differences, whose
    variance is 20 times that of white noise.
    """
    steps = np.abs(np.diff(values))
    moved = steps > _DUST * max(float(np.ptp(values)), 1e-300)
    waits, steps = not moved.all(), steps[moved]
    if not steps.size:
        return 0.0, 0.0
    smallest = float(steps.min())
    multiples = steps / smallest
    # A signal that is not quantised has a smallest difference that divides none of the others; a
    # plain ramp has one difference only, but never waits between two steps.
    whole = float(np.mean(np.abs(multiples - np.rint(multiples)))) < 0.02
    if whole and (waits or multiples.max() > 1.5):
        return smallest, smallest / math.sqrt(12.0)
    return 0.0, white_noise(values)


def white_noise(values: Floats) -> float:
    """Return the standard deviation of white noise, from third differences; 0 for too few."""
    third = np.diff(values, n=3)
    if not third.size:
        return 0.0
    return float(np.median(np.abs(third))) / (0.6745 * math.sqrt(20.0))


def cutoff_for(values: Floats, period_s: float, error: float, turns: NDArray[np.intp]) -> float:
    """Return the lowest cutoff in Hz that leaves the turns as sharp as the encoder saw them.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Position or velocity, evenly sampled.
    period_s : float
        Time between samples.
    error : float
        Standard error of a sample, as `resolution` gives it.
    turns : ndarray of int, shape (k,)
        Where the motion turns round.
    """
    chosen = _HIGHEST / period_s
    if error <= 0.0 or not turns.size:
        return chosen
    for k in range(1, _STEPS):
        cutoff = _HIGHEST / period_s / math.sqrt(2.0) ** k
        reach = max(round(_ABOUT_S / (cutoff * period_s)), 2)
        near = np.clip(turns[:, np.newaxis] + np.arange(-reach, reach + 1), 0, values.size - 1)
        rest = values - lowpass(values, period_s, cutoff)
        # A turn that just comes over an edge of a step reads half a step too high for as long as
        # it stays there. That is not the filter's doing, which takes from every turn.
        each = np.sqrt(np.mean(rest[near] ** 2, axis=1))
        calm = float(np.quantile(each, _CALM_TURNS))
        all_turns = float(np.sqrt(np.mean(rest[np.unique(near)] ** 2)))
        if all_turns > _EXCESS * error and calm > _CALM * error:
            break
        if _worst(rest, max(round(1.0 / (cutoff * period_s)), _SHORTEST)) > _JOLT * error:
            break
        chosen = cutoff
    return chosen


def _worst(rest: Floats, width: int) -> float:
    """Return the root mean square over the worst stretch of so many samples."""
    if rest.size <= width:
        return 0.0
    total = np.concatenate(([0.0], np.cumsum(rest**2)))
    return math.sqrt(max(float(np.max(total[width:] - total[:-width])) / width, 0.0))


def swings(position: Floats, period_s: float, error_rad: float) -> NDArray[np.bool_]:
    """Tell where the motor does not keep a steady speed, shape (n,).

    By its acceleration, in the widest band in which the encoder's error is none beside it. At a
    steady speed that error is a line, at any frequency: it is no acceleration.
    """
    from scipy.ndimage import maximum_filter1d

    impulse = np.zeros(_IMPULSE)
    impulse[_IMPULSE // 2] = error_rad
    share = _SWINGS
    for k in range(_CUTOFFS):
        share = _SWINGS / math.sqrt(2.0) ** k
        hard = np.abs(_acceleration(position, period_s, share))
        hard[:_LEFT_OUT] = hard[-_LEFT_OUT:] = 0.0
        least = _QUIET * float(np.linalg.norm(_acceleration(impulse, period_s, share)))
        if least < _HARD * float(np.quantile(hard, 0.99)):
            break
    swung = np.asarray(hard > least, dtype=np.uint8)
    return np.asarray(maximum_filter1d(swung, 2 * round(_BESIDE / share) + 1) > 0)


def _acceleration(position: Floats, period_s: float, share: float) -> Floats:
    """Return the acceleration below a share of the sampling rate, shape (n,)."""
    smooth = lowpass(position, period_s, share / period_s)
    return np.asarray(np.gradient(np.gradient(smooth, period_s), period_s))
