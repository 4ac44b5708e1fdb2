"""The measured motion that drives an arm: without holes, from the quieter channel, well begun."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.physics.derivative import slope_over
from agent.physics.effects.card import Floats
from agent.physics.effects.motion import Motion
from agent.physics.gaps import between, bridge

STEPS_PER_RAD = 10.0
"""Steps of a simulated arm in a radian of its own swing: their error is then below 0.1 %."""

_FEWEST = 3  # samples that have a slope and something left
_NOISE_SAMPLES = 200  # that the noise is read from
_AS_NOISE = 1.5  # times the noise: more is motion
_FORGOTTEN = 5.0  # time constants of a swing that dies away
_LEAST_MEMORY_S, _MOST_MEMORY_S = 1.0, 10.0


def known_of(time_s: Floats, *columns: Floats) -> slice:
    """Return the samples that are known, or refuse motion with a hole in it."""
    finite = np.flatnonzero(np.isfinite(time_s) & np.isfinite(columns).all(axis=0))
    if not finite.size or finite.size != finite[-1] - finite[0] + 1:
        raise ValueError("expected time_s, position_rad and velocity_rad_s without a hole")
    known = slice(int(finite[0]), int(finite[-1]) + 1)
    if np.any(np.diff(time_s[known]) <= 0.0):
        raise ValueError("time_s: expected strictly increasing samples")
    return known


def in_a_row(motion: Motion, memory_s: float) -> tuple[Floats, Floats, Floats, slice]:
    """Return time, angle and speed of the motor, (m,), and where those of the motion stand.

    Stretches before it that the arm remembers stand before it, with the samples that were lost.

    Parameters
    ----------
    motion : Motion
    memory_s : float
        Within which a swing of the arm dies away to its e-th part.
    """
    parts = motion.in_a_row(min(max(_FORGOTTEN * memory_s, _LEAST_MEMORY_S), _MOST_MEMORY_S))
    joined: tuple[Floats, ...] = ()
    for part in parts:
        here = part if part is motion else part.unfiltered
        columns = here.need("time_s"), here.need("position_rad"), here.velocity_rad_s
        known = known_of(*columns)
        stretch = tuple(column[known] for column in columns)
        joined = _bridged(joined, stretch) if joined else stretch
    # Copies: a loop is compiled anew for every mixture of writeable and read-only columns.
    time, position, velocity = (column.copy() for column in joined)
    return time, position, velocity, slice(time.shape[0] - stretch[0].shape[0], time.shape[0])


def driven(
    time_s: Floats,
    position_rad: Floats,
    velocity_rad_s: Floats,
    answer_s: float,
    *,
    by_velocity: bool,
) -> tuple[Floats, Floats]:
    """Return the motor's angle and speed that drive the spring, each shape (n,).

    The angle is the quieter of two, and the speed is that angle's own: a damper between two
    channels that disagree would make torque of their difference. Where what is compared takes
    its acceleration from the unfiltered velocity, the arm is driven by that as well.

    A position of coarse steps, or one that is not quite in step with the velocity, would shake
    a stiff spring; a noisy velocity, summed up, would let a soft one wander. White noise of the
    velocity adds up for as long as the spring takes to answer.

    Parameters
    ----------
    time_s, position_rad, velocity_rad_s : ndarray, shape (n,)
    answer_s : float
        A radian of the arm's swing.
    by_velocity : bool
        Whether what is compared takes its acceleration from the unfiltered velocity.
    """
    steps = np.diff(time_s)
    wander = _white(velocity_rad_s) * math.sqrt(float(np.mean(steps)) * answer_s)
    if not by_velocity and wander > _white(position_rad):
        return position_rad.copy(), slope_over(time_s, position_rad)
    # The end slopes correct the trapezoids (Euler and Maclaurin): angle and speed would differ
    # by (w T)^2 / 12 else, which a stiff damper turns into a lag.
    turn = np.diff(slope_over(time_s, velocity_rad_s)) * steps**2 / 12.0
    way = 0.5 * (velocity_rad_s[1:] + velocity_rad_s[:-1]) * steps - turn
    summed = position_rad[0] + np.concatenate(([0.0], np.cumsum(way)))
    return summed, velocity_rad_s.copy()


def start_of(time_s: Floats, velocity_rad_s: Floats, half_swing_s: float) -> tuple[float, float]:
    """Return acceleration and velocity that the arm starts with.

    One noisy sample would make a soft arm ring for long: a straight line is laid through up to
    half a swing, as far as it departs from the samples by no more than their noise.

    Parameters
    ----------
    time_s, velocity_rad_s : ndarray, shape (n,)
    half_swing_s : float
    """
    count = int(np.searchsorted(time_s, time_s[0] + half_swing_s, side="right"))
    count = min(max(count, _FEWEST), time_s.shape[0])
    if count < _FEWEST:
        return 0.0, float(velocity_rad_s[0])
    curvature = np.abs(np.diff(velocity_rad_s[:_NOISE_SAMPLES], n=2))
    noise_rad_s = float(np.median(curvature)) / (0.6745 * np.sqrt(6.0))
    while True:
        since, speed = time_s[:count] - time_s[0], velocity_rad_s[:count]
        away = since - np.mean(since)
        slope = float(away @ speed / (away @ away))
        first = float(np.mean(speed) - slope * np.mean(since))
        left = float(np.std(speed - slope * away))
        if count == _FEWEST or left <= _AS_NOISE * noise_rad_s:
            return slope, first
        count = max(_FEWEST, 2 * count // 3)


def _bridged(before: Sequence[Floats], after: Sequence[Floats]) -> tuple[Floats, ...]:
    """Return time, angle and speed of two stretches, with the samples that were lost in between."""
    (time, position, velocity), (time_after, position_after, velocity_after) = before, after
    period_s = float(np.mean(np.diff(time_after))) if time_after.shape[0] > 1 else np.inf
    gap_s = time_after[:1] - time[-1:]
    share = between(max(round(float(gap_s[0]) / period_s) - 1, 0))
    went = position_after[:1] - position[-1:]
    speeds = bridge(velocity[-1:], velocity_after[:1], went, gap_s, share)
    ends = np.concatenate((velocity[-1:], speeds, velocity_after[:1]))
    way = np.cumsum(0.5 * (ends[1:] + ends[:-1])) * gap_s / (share.shape[0] + 1)
    return (
        np.concatenate((time, time[-1] + share * gap_s, time_after)),
        np.concatenate((position, position[-1] + way[:-1], position_after)),
        np.concatenate((velocity, speeds, velocity_after)),
    )


def _white(values: Floats) -> float:
    """Return the standard deviation of a channel's white noise, from third differences."""
    if values.shape[0] < 4:
        return 0.0
    return float(np.sqrt(np.mean(np.diff(values, n=3) ** 2) / 20.0))
