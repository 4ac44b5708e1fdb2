"""Which steady speeds to visit, and the one root finder that fits a stair to its time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from trajectories.checks import TrajectoryError, positive, whole

Spacing = Literal["geometric", "linear"]


def spaced_speeds(
    slowest_rad_s: float, fastest_rad_s: float, count: int, spacing: Spacing = "geometric"
) -> tuple[float, ...]:
    """Return rising speeds from the slowest to the fastest, both included.

    Parameters
    ----------
    slowest_rad_s, fastest_rad_s : float
        Above zero, the first below the second (equal when `count` is 1).
    count : int
        How many.
    spacing : {"geometric", "linear"}
        Geometric spacing gives every decade of speed as many points, so that the falling part of
        the friction curve (Stribeck) is as well covered as the viscous one; linear spacing weighs
        the viscous slope.

    Returns
    -------
    tuple of float
        Length `count`; the ends are exactly the given ones.
    """
    slowest = positive("slowest_rad_s", slowest_rad_s)
    fastest = positive("fastest_rad_s", fastest_rad_s)
    number = whole("count", count, 1)
    if spacing not in ("geometric", "linear"):
        raise TrajectoryError(f"spacing must be geometric or linear, got {spacing!r}")
    if number == 1 and slowest == fastest:
        return (slowest,)
    if number == 1 or slowest >= fastest:
        raise TrajectoryError(
            f"slowest_rad_s must lie below fastest_rad_s, and equal it for a single speed; "
            f"got {slowest:g} and {fastest:g} for {number}"
        )
    space = np.geomspace if spacing == "geometric" else np.linspace
    inner = space(slowest, fastest, number)[1:-1]
    return (slowest, *(float(speed) for speed in inner), fastest)


def crossing(function: Callable[[float], float], low: float, high: float) -> float:
    """Return where a continuous function rises through zero, to the last bit.

    Parameters
    ----------
    function : callable
        Not above zero at `low`, not below zero at `high`; it need not be monotone in between.
    low, high : float
        The bracket, ``low <= high``.
    """
    while True:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            return low if abs(function(low)) <= abs(function(high)) else high
        if function(middle) < 0.0:
            low = middle
        else:
            high = middle
