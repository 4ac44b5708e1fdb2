"""A friction curve held against its baseline's: how much more, where, and how sure.

Numbers only; what is bad news is the monitor's to say, which knows temperature and many cycles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """Friction over velocity, motor side; arrays of shape (n,), velocity rising."""

    velocity_rad_s: Floats
    friction_nm: Floats
    half_ci95_nm: Floats


@dataclass(frozen=True)
class Change:
    """How much the mean friction torque differs from the baseline's, with a 95 % interval.

    The intervals of both curves are taken as independent from speed to speed; the mean's interval
    is therefore no wider than it is, and may be narrower where they are not.
    """

    percent: float
    half_ci95_percent: float
    healthy_nm: float

    @property
    def clear(self) -> bool:
        """Return whether the interval excludes no change."""
        return abs(self.percent) > self.half_ci95_percent


@dataclass(frozen=True)
class Against:
    """One curve against another, over the speeds that both have.

    `low` and `high` are the lower and upper half of these speeds; None where they have too few.
    """

    whole: Change
    low: Change | None
    high: Change | None
    difference: Curve


def curve_of(estimate: Mapping[str, Any] | None) -> Curve | None:
    """Return the friction curve of a `stribeck.estimate/1` document; None where it has none."""
    found = (estimate or {}).get("friction_curve")
    if not isinstance(found, Mapping):
        return None
    try:
        velocity = np.asarray(found["velocity_rad_s"], dtype=np.float64)
        friction = np.asarray(found["friction_nm"], dtype=np.float64)
        ends = np.asarray(found["ci95_nm"], dtype=np.float64).reshape(-1, 2)
    except (TypeError, KeyError, ValueError):
        return None
    half = 0.5 * (ends[:, 1] - ends[:, 0])
    if not velocity.size == friction.size == half.size or velocity.size == 0:
        return None
    good = np.isfinite(velocity) & np.isfinite(friction) & np.isfinite(half)
    order = np.argsort(velocity[good])
    return Curve(velocity[good][order], friction[good][order], half[good][order])


def against(now: Curve, baseline: Curve) -> Against | None:
    """Hold a curve against a baseline's; None where they share no speeds.

    The baseline is read between its own speeds, never beyond them.
    """
    inside = (now.velocity_rad_s >= baseline.velocity_rad_s[0]) & (
        now.velocity_rad_s <= baseline.velocity_rad_s[-1]
    )
    if inside.sum() < 2:
        return None
    speed = now.velocity_rad_s[inside]
    healthy = np.interp(speed, baseline.velocity_rad_s, baseline.friction_nm)
    spread = np.interp(speed, baseline.velocity_rad_s, baseline.half_ci95_nm)
    difference = now.friction_nm[inside] - healthy
    half = np.hypot(now.half_ci95_nm[inside], spread)
    order = np.argsort(np.abs(speed), kind="stable")
    whole = _change(difference, half, healthy)
    if whole is None:
        return None
    low = high = None
    if order.size >= 4:
        halves = np.split(order, [order.size // 2])
        low, high = (_change(difference[h], half[h], healthy[h]) for h in halves)
    return Against(whole, low, high, Curve(speed, difference, half))


def _change(difference: Floats, half: Floats, healthy: Floats) -> Change | None:
    level = float(np.abs(healthy).mean())
    if not math.isfinite(level) or level <= 0.0:
        return None
    # Friction opposes motion: where a curve has both directions, more of it is away from zero.
    more = float((np.sign(healthy) * difference).mean())
    spread = float(np.sqrt((half**2).sum())) / difference.size
    return Change(100.0 * more / level, 100.0 * spread / level, level)
