"""An observer of friction on ordinary motion: a Kalman filter with friction among its states.

The thesis (section 2.2.2) names observers as the residual generator that needs no special
excitation, and augmented states as the way to follow a parameter with one. The states are the
motor's position and velocity, and by how much friction lies above the healthy curve: at every speed
alike, and in proportion to speed. Both walk slowly. From block to block of ``T`` seconds, with the
recorded torque u as input,

``v+ = v + (1/J) int (u - g(q) - s F(|w|) - s c - b w / w_top) dt``

and the position with the same integrand's second integral, where w is the measured velocity, s its
sign and F the healthy friction curve: linear in the states, so that the filter is the exact one. A
block in which the joint stands or turns round says nothing of sliding friction: the motion is begun
anew after it.

What a model lacks colours the innovations. They are tested for whiteness at a stated false rate
(Ljung and Box, Biometrika 65 (1978) 297).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.preprocess import Motion
from agent.identify.result import Floats
from agent.physics.rigid_body import gravity_columns

LAGS = 8
_STANDS = 0.005  # of the fastest speed: slower counts as standing
_STANDS_SIGMAS = 6.0
_PRIOR = 0.3  # of the healthy friction: what is believed of c and b before the first block
_WALK_PER_S = 1e-3  # of the healthy friction, in a second's square root
_SETTLING = 10  # blocks after the start whose innovations are not judged


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


@dataclass(frozen=True)
class ObserverRun:
    """What the observer saw in one recording; arrays over n blocks.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    states : ndarray, shape (n, 4)
        Position, velocity, c and b, after each block.
    covariances : ndarray, shape (n, 4, 4)
    innovations : ndarray, shape (n, 2)
        Of position and velocity, whitened by their own covariance: independent with variance 1
        where the model is right. NaN where the motion was begun anew.
    """

    time_s: Floats
    states: Floats
    covariances: Floats
    innovations: Floats

    @property
    def nis(self) -> Floats:
        """Return the normalised innovations squared, shape (n,): mean 2 where all is right."""
        return np.asarray(np.sum(self.innovations**2, axis=1), dtype=np.float64)

    def judged(self) -> Floats:
        """Return the innovations without those of the first blocks, shape (m, 2)."""
        return self.innovations[_SETTLING:]

    def rise_nm(self, share_of_top: float) -> tuple[float, float]:
        """Return the rise of friction at a share of the top speed at the end, and its deviation."""
        weight = np.array([0.0, 0.0, 1.0, share_of_top])
        variance = float(weight @ self.covariances[-1] @ weight)
        return float(self.states[-1] @ weight), math.sqrt(max(variance, 0.0))


@dataclass(frozen=True)
class Whiteness:
    """Ljung and Box's test of one recording's innovations.

    `statistic` is chi-squared with `degrees` degrees of freedom where they are white, so that
    `threshold` is passed at `false_rate` then.
    """

    statistic: float
    degrees: int
    threshold: float
    false_rate: float
    innovations: int

    @property
    def white(self) -> bool:
        """Tell whether nothing speaks against whiteness."""
        return self.statistic <= self.threshold


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


def observe(blocks: Blocks, model: ObserverModel) -> ObserverRun:
    """Run the filter over one recording.

    Parameters
    ----------
    blocks : Blocks
        From `blocks_of`.
    model : ObserverModel
        Of the healthy joint.
    """
    count = blocks.time_s.size
    noise = np.diag([model.position_sd_rad**2, model.velocity_sd_rad_s**2])
    state = np.zeros(4)
    covariance = np.zeros((4, 4))
    covariance[2:, 2:] = np.eye(2) * (_PRIOR * model.level_nm) ** 2
    states, covariances = np.empty((count, 4)), np.empty((count, 4, 4))
    innovations = np.full((count, 2), np.nan)
    for k in range(count):
        if blocks.starts[k]:
            _begin(state, covariance, blocks.before[k], noise)
        transition, step = _transition(blocks, k, model)
        state = transition @ state + step
        covariance = transition @ covariance @ transition.T + _walk(float(blocks.span_s[k]), model)
        if blocks.slides[k]:
            left = blocks.measured[k] - state[:2]
            spread = covariance[:2, :2] + noise
            innovations[k] = np.linalg.solve(np.linalg.cholesky(spread), left)
            gain = np.linalg.solve(spread, covariance[:2, :]).T
            keep = np.eye(4)
            keep[:, :2] -= gain
            state = state + gain @ left
            covariance = keep @ covariance @ keep.T + gain @ noise @ gain.T
        else:
            _begin(state, covariance, blocks.measured[k], noise)
        states[k], covariances[k] = state, covariance
    return ObserverRun(blocks.time_s, states, covariances, innovations)


def whiteness(innovations: Floats, false_rate: float = 0.01, lags: int = LAGS) -> Whiteness:
    """Test innovations for whiteness; pairs across a new beginning do not count.

    ``Q = sum over channels and lags l of n_l r_l^2 (n + 2)/n``, with r_l the correlation of the
    n_l pairs that are there.

    Parameters
    ----------
    innovations : ndarray, shape (n, channels)
        Whitened by the filter's own covariance; NaN where there is none.
    false_rate : float
        How often white innovations are called coloured.
    lags : int
        How many lags are looked at.
    """
    from scipy.special import chdtri

    statistic = 0.0
    for column in innovations.T:
        centred = column - np.nanmean(column)
        power = float(np.nanmean(centred**2))
        for lag in range(1, lags + 1):
            products = centred[lag:] * centred[:-lag]
            products = products[np.isfinite(products)]
            if products.size > 1 and power > 0.0:
                statistic += float(np.mean(products) / power) ** 2 * (products.size + 2.0)
    degrees = lags * innovations.shape[1]
    seen = int(np.count_nonzero(np.isfinite(innovations[:, 0])))
    return Whiteness(statistic, degrees, float(chdtri(degrees, false_rate)), false_rate, seen)


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


def _begin(state: Floats, covariance: Floats, measured: Floats, noise: Floats) -> None:
    """Set position and velocity to what is measured; what is known of friction stays."""
    state[:2] = measured
    covariance[:2, :] = 0.0
    covariance[:, :2] = 0.0
    covariance[:2, :2] = noise


def _transition(blocks: Blocks, k: int, model: ObserverModel) -> tuple[Floats, Floats]:
    """Return the transition over block k, shape (4, 4), and what the input adds, shape (4,)."""
    once, twice = 1, 0  # rows of velocity and position
    transition = np.eye(4)
    transition[0, 1] = blocks.span_s[k]
    for row, integral in ((once, 0), (twice, 1)):
        transition[row, 2] = -blocks.coulomb[k, integral] / model.inertia_kg_m2
        transition[row, 3] = -blocks.viscous[k, integral] / model.inertia_kg_m2
    step = np.zeros(4)
    step[once] = blocks.push[k, 0] / model.inertia_kg_m2
    step[twice] = blocks.push[k, 1] / model.inertia_kg_m2
    return transition, step


def _walk(span_s: float, model: ObserverModel) -> Floats:
    """Return the covariance that a block adds, shape (4, 4)."""
    out = np.zeros((4, 4))
    density = model.torque_density_nm2_s / model.inertia_kg_m2**2
    out[:2, :2] = density * np.array(
        [[span_s**3 / 3.0, span_s**2 / 2.0], [span_s**2 / 2.0, span_s]]
    )
    out[2, 2] = out[3, 3] = span_s * (_WALK_PER_S * model.level_nm) ** 2
    return out
