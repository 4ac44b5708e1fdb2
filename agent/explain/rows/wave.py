"""Waves of the motor's angle, as laws that repeat along the position are made of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.identify.result import Floats
from agent.physics.periodic import followed


def wave_of(
    order: float,
    position_rad: Floats,
    velocity_rad_s: Floats,
    pieces: Sequence[tuple[slice, float]],
) -> Floats:
    """Return cosine and sine of so many times the motor's angle, read-only, shape (N, 2).

    Nothing where the samples cannot follow them.

    Parameters
    ----------
    order : float
        Waves per motor turn.
    position_rad, velocity_rad_s : ndarray, shape (N,)
        The motor's.
    pieces : sequence of (slice, float)
        Stretches without a gap, with the period of each, s.
    """
    angle = order * position_rad
    wave = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    for at, period_s in pieces:
        wave[at] *= followed(order, velocity_rad_s[at], period_s)[:, np.newaxis]
    wave.flags.writeable = False
    return wave
