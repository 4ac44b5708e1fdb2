"""What the observer knows of a healthy joint, and a recording's motion in the blocks it takes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.preprocess import Motion
from agent.physics.rigid_body import gravity_columns

_STANDS = 0.005  # of the fastest speed: slower counts as standing
_STANDS_SIGMAS = 6.0


@dataclass(frozen=True)
class ObserverModel:
    """What the observer knows of a healthy joint.

    Parameters
    ----------
    inertia_kg_m2, gravity_sin_nm, gravity_cos_nm, torque_offset_nm : float
        The rigid body, motor side.
    speed_rad_s, friction_nm : ndarray, shape (m,)
        The healthy friction curve at rising speeds above zero; straight lines between, the first
        value below the first speed, the last slope beyond the last.
    top_rad_s : float
        Speed by which the state b is scaled, so that it is a torque, too.
    torque_density_nm2_s : float
        Spectral density of the torque that the model does not know: noise, ripple.
    velocity_sd_rad_s, position_sd_rad : float
        Of the measurements.
    block_s : float
        Length of a block, T.
    """

    inertia_kg_m2: float
    gravity_sin_nm: float
    gravity_cos_nm: float
    torque_offset_nm: float
    speed_rad_s: Floats
    friction_nm: Floats
    top_rad_s: float
    torque_density_nm2_s: float
    velocity_sd_rad_s: float
    position_sd_rad: float
    block_s: float = 0.05

    def __post_init__(self) -> None:
        above = {
            "inertia_kg_m2": self.inertia_kg_m2,
            "top_rad_s": self.top_rad_s,
            "torque_density_nm2_s": self.torque_density_nm2_s,
            "velocity_sd_rad_s": self.velocity_sd_rad_s,
            "position_sd_rad": self.position_sd_rad,
            "block_s": self.block_s,
        }
        for name, value in above.items():
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name}: expected a number above 0, got {value}")
        if self.speed_rad_s.shape != self.friction_nm.shape or self.speed_rad_s.size < 2:
            raise ValueError("expected a friction curve of two speeds or more")
        if np.any(np.diff(self.speed_rad_s) <= 0.0) or self.speed_rad_s[0] <= 0.0:
            raise ValueError("expected rising speeds above zero")

    def curve_nm(self, speed_rad_s: Floats) -> Floats:
        """Return the healthy friction at speeds of 0 or more, shape (n,)."""
        v, f = self.speed_rad_s, self.friction_nm
        slope = (f[-1] - f[-2]) / (v[-1] - v[-2])
        beyond = slope * np.maximum(speed_rad_s - v[-1], 0.0)
        return np.asarray(np.interp(speed_rad_s, v, f) + beyond, dtype=np.float64)

    @property
    def level_nm(self) -> float:
        """Return the scale of the healthy friction: its mean over the curve."""
        return float(np.mean(np.abs(self.friction_nm)))


@dataclass(frozen=True)
class Blocks:
    """One recording's motion in blocks, as the filter takes it; arrays over n blocks.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        End of each block.
    slides : ndarray of bool, shape (n,)
        Whether the joint slides one way throughout the block.
    push : ndarray, shape (n, 2)
        First and second integral of the torque that accelerates a healthy joint, N m s, N m s^2.
    coulomb, viscous : ndarray, shape (n, 2)
        The same integrals of the sign, and of velocity over `top_rad_s`.
    measured : ndarray, shape (n, 2)
        Position and velocity at each block's end.
    starts : ndarray of bool, shape (n,)
        Whether the block follows on none: begun from `before`.
    before : ndarray, shape (n, 2)
        Position and velocity at each block's start.
    span_s : ndarray, shape (n,)
        Length of each block.
    """

    time_s: Floats
    slides: NDArray[np.bool_]
    push: Floats
    coulomb: Floats
    viscous: Floats
    measured: Floats
    starts: NDArray[np.bool_]
    before: Floats
    span_s: Floats


def blocks_of(motion: Motion, model: ObserverModel) -> Blocks:
    """Cut a recording into blocks and integrate over each.

    Raises
    ------
    ValueError
        The recording has no position: the observer needs it for gravity and for its own state.
    """
    signals = motion.signals
    if signals.position_rad is None:
        raise ValueError(f"{signals.name}: the observer needs position_rad, which is not there")
    pieces = []
    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
        position = stretch.on_grid(signals, signals.position_rad)
        torque = stretch.on_grid(signals, signals.torque_nm)
        net, sign = _healthy_push(motion, position, velocity, torque, model)
        integrand = np.stack((net, sign, velocity / model.top_rad_s), axis=1)
        per = max(round(model.block_s / stretch.period_s), 1)
        if velocity.size > per:
            pieces.append(_cut(integrand, position, velocity, stretch.time_s, per))
    if not pieces:
        raise ValueError(f"{signals.name}: no stretch is as long as a block of {model.block_s} s")
    return Blocks(*(np.concatenate(column) for column in zip(*pieces, strict=True)))


def _healthy_push(
    motion: Motion, position: Floats, velocity: Floats, torque: Floats, model: ObserverModel
) -> tuple[Floats, Floats]:
    """Return the torque that is left to accelerate a healthy joint, and the velocity's sign.

    Where the joint stands both are NaN: the block is then known not to slide.
    """
    gravity = gravity_columns(position, motion.signals.gear_ratio) @ np.array(
        [model.gravity_sin_nm, model.gravity_cos_nm]
    )
    slow = max(_STANDS * model.top_rad_s, _STANDS_SIGMAS * model.velocity_sd_rad_s)
    sign = np.where(np.abs(velocity) > slow, np.sign(velocity), np.nan)
    healthy = gravity + model.torque_offset_nm + sign * model.curve_nm(np.abs(velocity))
    return torque - healthy, sign


def _cut(
    integrand: Floats, position: Floats, velocity: Floats, time_s: Floats, per: int
) -> tuple[Floats | NDArray[np.bool_], ...]:
    """Return one stretch's columns of `Blocks`; trapezoids over each block."""
    count = (velocity.size - 1) // per
    period_s = float(time_s[1] - time_s[0])
    index = per * np.arange(count)[:, np.newaxis] + np.arange(per + 1)
    weight = np.full(per + 1, period_s)
    weight[[0, -1]] *= 0.5
    inside = integrand[index]  # (count, per + 1, 3)
    once = np.einsum("kjc,j->kc", inside, weight)
    twice = np.einsum("kjc,j->kc", inside, weight * (per - np.arange(per + 1)) * period_s)
    sign = inside[:, :, 1]
    slides = np.abs(sign.sum(axis=1)) == per + 1  # NaN, or both ways, is not equal
    both = np.stack((once, twice), axis=2)
    both[~slides] = 0.0
    ends, begins = index[:, -1], index[:, 0]
    starts = np.zeros(count, dtype=np.bool_)
    starts[0] = True
    return (
        time_s[ends],
        slides,
        both[:, 0],
        both[:, 1],
        both[:, 2],
        np.stack((position[ends], velocity[ends]), axis=1),
        starts,
        np.stack((position[begins], velocity[begins]), axis=1),
        np.full(count, per * period_s),
    )
