"""An arm behind a spring whose other end shakes it: a wobbling gear's, a misread angle's."""

from __future__ import annotations

import math

import numpy as np

from agent.physics.effects.card import Floats
from agent.physics.effects.driving import STEPS_PER_RAD, known_of

_ANY_RAD = 0.01  # friction that is not there gives way by whatever length


def shaken_nm(
    time_s: Floats,
    angle_rad: Floats,
    velocity_rad_s: Floats,
    acceleration_rad_s2: Floats,
    inertia_kg_m2: float,
    swing_rad_s: float,
    damping_ratio: float,
) -> Floats:
    """Return what a spring bears of an arm that its other end shakes, shape (n,), N m.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    angle_rad, velocity_rad_s, acceleration_rad_s2 : ndarray, shape (n,)
        Of that other end; the arm follows it stiffly at first.
    inertia_kg_m2 : float
        Of the arm.
    swing_rad_s, damping_ratio : float
        Of the arm on its spring while that end is held.
    """
    from agent.physics.kernels_carried import carried_arms

    out = np.full_like(time_s, np.nan)
    known = known_of(time_s, angle_rad, velocity_rad_s)
    longest_s = float(np.max(np.diff(time_s[known]), initial=0.0))
    rate_per_s = swing_rad_s * (1.0 + 2.0 * damping_ratio)
    (out[known],) = carried_arms(
        time_s[known].copy(),
        angle_rad[known].copy(),
        velocity_rad_s[known].copy(),
        inertia_kg_m2,
        inertia_kg_m2 * swing_rad_s**2,
        0.0,
        2.0 * damping_ratio * swing_rad_s * inertia_kg_m2,
        np.zeros(1),
        0.0,
        0.0,
        1.0,
        math.ceil(STEPS_PER_RAD * rate_per_s * longest_s),
        float(acceleration_rad_s2[known][0]),
        float(velocity_rad_s[known][0]),
        np.zeros(known.stop - known.start),
        _ANY_RAD,
        0.0,
        0.0,
        0.0,
        _ANY_RAD,
        0.0,
    )
    return out
