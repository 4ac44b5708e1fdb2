"""Loops that must run sample by sample, compiled. Import this late: numba is slow to load."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True)
def relax(steady: Floats, keep: Floats, start: float) -> Floats:
    """Return a state after each pair of pieces, shape (n,).

    ``x <- steady + (x - steady) keep`` for each of the 2 n pieces.
    """
    samples = steady.shape[0] // 2
    state = start
    out = np.empty(samples)
    for k in range(samples):
        for j in (2 * k, 2 * k + 1):
            state = steady[j] + (state - steady[j]) * keep[j]
        out[k] = state
    return out


@njit(cache=True, nogil=True)
def smoothed(time: Floats, values: Floats, lag_s: float) -> Floats:
    """Return what a first-order low-pass makes of columns on straight lines, shape (n, k).

    Each begins settled, and anew behind a value that is not known.
    """
    out = values.copy()
    for i in range(1, values.shape[0]):
        step = time[i] - time[i - 1]
        keep, per_step = math.exp(-step / lag_s), lag_s / step
        for k in range(values.shape[1]):
            behind = (values[i, k] - values[i - 1, k]) * per_step  # a ramp's delay
            state = values[i, k] - behind + (out[i - 1, k] - values[i - 1, k] + behind) * keep
            out[i, k] = state if math.isfinite(state) else values[i, k]
    return out


@njit(cache=True, nogil=True)
def settle(velocity: Floats, keep: Floats, start: float) -> Floats:
    """Return a state that goes to the sign of a velocity, shape (n,).

    Parameters
    ----------
    velocity : ndarray, shape (n,)
    keep : ndarray, shape (n,)
        Which share of its way each sample leaves; where nothing moves the state stays.
    start : float
        Where it is at first.
    """
    out = np.empty(velocity.shape[0])
    state = start
    for i in range(velocity.shape[0]):
        settled = 0.0
        if velocity[i] > 0.0:
            settled = 1.0
        elif velocity[i] < 0.0:
            settled = -1.0
        if settled != 0.0:
            state = settled + (state - settled) * keep[i]
        out[i] = state
    return out


@njit(cache=True)
def gap_angle(twist_rad: Floats, step_s: Floats, half_gap_rad: float, rate_per_s: float) -> Floats:
    """Return the clearance's angle, shape (n,), of a spring and damper in series with a gap.

    Freely the spring relaxes at `rate_per_s`; the walls at plus and minus `half_gap_rad` stop it.
    """
    out = np.empty(twist_rad.shape[0])
    gap = min(max(twist_rad[0], -half_gap_rad), half_gap_rad)
    out[0] = gap
    for k in range(1, twist_rad.shape[0]):
        spring = (twist_rad[k - 1] - gap) * math.exp(-rate_per_s * step_s[k])
        gap = min(max(twist_rad[k] - spring, -half_gap_rad), half_gap_rad)
        out[k] = gap
    return out


@njit(cache=True)
def yielding(
    time_s: Floats,
    velocity_rad_s: Floats,
    level: Floats,
    stiffness: float,
    exponent: float,
    start: float,
) -> Floats:
    """Return a spring's torque, shape (n,), that yields towards a level, from `start`.

    Each step's solution is exact for the step's mean level, so that no step is too long.
    """
    out = np.empty(time_s.shape[0])
    out[0] = force = start
    for k in range(1, time_s.shape[0]):
        first, second = _pieces(time_s[k] - time_s[k - 1], velocity_rad_s[k - 1], velocity_rad_s[k])
        limit = 0.5 * (level[k - 1] + level[k])
        for travel in (first, second):
            if travel != 0.0:
                sign = 1.0 if travel > 0.0 else -1.0
                left = 1.0 - force * sign / limit
                after = _left(abs(left), stiffness * abs(travel) / limit, exponent)
                force = sign * limit * (1.0 - (after if left >= 0.0 else -after))
        out[k] = force
    return out


@njit(cache=True)
def _left(before: float, travel: float, exponent: float) -> float:
    """Return ``y`` after a travel, for ``dy/dx = -y^i`` and `before` at its start."""
    if before == 0.0:
        return 0.0
    if exponent == 1.0:
        return before * math.exp(-travel)
    power = 1.0 - exponent
    # Written as a share of the start, which neither overflows nor loses a small y.
    inside = 1.0 - power * travel * before**-power
    return before * inside ** (1.0 / power) if inside > 0.0 else 0.0


@njit(cache=True)
def _pieces(step_s: float, before: float, after: float) -> tuple[float, float]:
    """Return the two travels of a step with straight velocity, cut where it changes sign."""
    if before * after < 0.0:
        share = before / (before - after)
        return 0.5 * before * share * step_s, 0.5 * after * (1.0 - share) * step_s
    return 0.5 * (before + after) * step_s, 0.0


@njit(cache=True, fastmath={"reassoc", "nsz"})
def slipping(
    time_s: Floats, velocity_rad_s: Floats, stiffness: Floats, level: Floats, start: float
) -> Floats:
    """Return the sum of springs that slip at their levels each, shape (n,).

    At first they are drawn out by `start`, a share of their levels.
    """
    out = np.empty(time_s.shape[0])
    force = np.empty(level.shape[0])
    out[0] = 0.0
    for j in range(level.shape[0]):
        force[j] = start * level[j]
        out[0] += force[j]
    for k in range(1, time_s.shape[0]):
        first, second = _pieces(time_s[k] - time_s[k - 1], velocity_rad_s[k - 1], velocity_rad_s[k])
        total = 0.0
        for j in range(stiffness.shape[0]):
            force[j] = min(max(force[j] + stiffness[j] * first, -level[j]), level[j])
            total += force[j]
        if second != 0.0:  # the motion turns round within few of the steps
            total = 0.0
            for j in range(stiffness.shape[0]):
                force[j] = min(max(force[j] + stiffness[j] * second, -level[j]), level[j])
                total += force[j]
        out[k] = total
    return out
