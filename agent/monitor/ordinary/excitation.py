"""What ordinary motion visits, and whether that can carry friction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.preprocess import Motion

MOVING = 0.02
"""Of the fastest speed: slower counts as standing."""

_SPEED_RATIO = 3.0  # fast to slow, that tells Coulomb from viscous friction
_ONE_WAY = 0.1  # of the moving time that each direction needs
_CONDITION = 60.0  # of columns of unit length


@dataclass(frozen=True)
class Excitation:
    """What the motion visits.

    Parameters
    ----------
    speeds_rad_s : tuple of float
        5, 50 and 95 % quantiles of the moving joint's speed.
    forward_share : float
        Of the moving time.
    steady_share : float
        Of the moving time spent in steady windows.
    condition_number : float
        Of sign, velocity, acceleration and constant, columns scaled to unit length.
    arm_stroke_rad : float
        NaN where no position was recorded.
    """

    speeds_rad_s: tuple[float, float, float]
    forward_share: float
    steady_share: float
    condition_number: float
    arm_stroke_rad: float

    def reasons(self) -> list[str]:
        """Return why this motion does not carry friction; empty where it does."""
        slow, _, fast = self.speeds_rad_s
        out = []
        if fast < _SPEED_RATIO * slow:
            out.append(
                f"the joint moves at {slow:.3g} to {fast:.3g} rad/s only: Coulomb and viscous "
                f"friction need a ratio of {_SPEED_RATIO:g} between fast and slow to be told apart"
            )
        rarer = min(self.forward_share, 1.0 - self.forward_share)
        if rarer < _ONE_WAY:
            out.append(
                f"{100.0 * rarer:.0f} % of the moving time is in the rarer direction, "
                f"{100.0 * _ONE_WAY:.0f} % are needed to tell friction from a constant torque"
            )
        if self.condition_number > _CONDITION:
            out.append(
                f"the condition number is {self.condition_number:.3g}, up to {_CONDITION:g} is "
                "allowed: friction, inertia and offset look alike in this motion"
            )
        return out


def excitation_of(motions: Sequence[Motion], steady: int, arm_stroke_rad: float) -> Excitation:
    """Return what recordings visit.

    Parameters
    ----------
    motions : sequence of Motion
        At least one that moves.
    steady : int
        Samples of theirs in steady windows.
    arm_stroke_rad : float
        NaN where no position was recorded.
    """
    velocity = np.concatenate([v for m in motions for v in m.velocity_rad_s])
    change = np.concatenate(
        [
            np.gradient(lowpass(v, s.period_s, 0.1 / s.period_s), s.period_s)
            for m in motions
            for s, v in zip(m.timing.stretches, m.velocity_rad_s, strict=True)
        ]
    )
    moves = np.abs(velocity) > MOVING * float(np.abs(velocity).max())
    moving = velocity[moves]
    columns = np.column_stack((np.sign(moving), moving, change[moves], np.ones(moving.size)))
    length = np.linalg.norm(columns, axis=0)
    singular = np.linalg.svd(columns / np.where(length > 0.0, length, 1.0), compute_uv=False)
    slow, middle, fast = (float(q) for q in np.quantile(np.abs(moving), (0.05, 0.5, 0.95)))
    return Excitation(
        (slow, middle, fast),
        float(np.mean(moving > 0.0)),
        min(steady / moving.size, 1.0),
        float(singular[0] / singular[-1]) if singular[-1] > 0.0 else math.inf,
        arm_stroke_rad,
    )
