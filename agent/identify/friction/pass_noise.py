"""How noisy the mean of a pass is, when the noise may remember for longer than the pass lasts.

A pass cannot tell by itself how far its own mean is off: what is slower than the pass looks like
friction. Many passes together can. Their torque, in blocks, is taken as

    friction of the speed x direction + offset + gravity + asymmetry x speed + noise,

with a friction of its own for every speed. That leaves the slopes and bends inside all passes, the
scatter between repeated passes, and the sums of forward and backward passes, whose differences are
the friction and whose sums are not. From these comes the noise: a white part and an
Ornstein-Uhlenbeck part that runs on through the whole recording, whatever moves meanwhile. Its
memory is not estimated but averaged over, weighted by the restricted likelihood of every memory
and share (Harville, JASA 72 (1977) 320), so that memories which the data do not tell apart make an
interval wider instead of wrong.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.friction.pass_blocks import Blocks, TimedPass, cut, evened
from agent.identify.result import Floats
from agent.identify.uncertainty import student_975

_MEMORIES = 16
_SHARES = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 0.99)
_BISECTIONS = 30
_ROOT_2 = math.sqrt(2.0)
_BEYOND_CHANCE = 2.5
_DUST = 1e-9  # of the friction: rounding, where there is no noise
_TOLD = 1e-4  # of the likeliest noise's weight: less likely ones change nothing


@dataclass(frozen=True)
class Spread:
    """What the noise does to one speed's friction: standard error, N m, and degrees of freedom.

    ``student_975(dof) x standard_error_nm`` is the half of the 95 % interval.
    """

    standard_error_nm: float
    dof: float


@dataclass(frozen=True)
class PassNoise:
    """What the noise of all passes does to the friction of G speeds.

    Parameters
    ----------
    spreads : tuple of Spread
        One a speed.
    weight : ndarray, shape (m,)
        How likely each of m kinds of noise is; sums to 1.
    covariance_nm2 : ndarray, shape (m, G, G)
        Of the speeds' friction, under each of them.
    freedom : float
        Degrees of freedom of its size.
    """

    spreads: tuple[Spread, ...]
    weight: Floats
    covariance_nm2: Floats
    freedom: float

    def of(self, speeds: Sequence[int], standard_error_nm: Floats) -> PassNoise:
        """Return the noise of some of the speeds, each as wide as its standard error says."""
        each = tuple(self.spreads[i] for i in speeds)
        error = np.array([s.standard_error_nm for s in each])
        wider = np.where(error > 0.0, standard_error_nm / np.maximum(error, 1e-300), 1.0)
        index = np.asarray(speeds, dtype=np.int64)
        chosen = self.covariance_nm2[:, index[:, np.newaxis], index]
        return replace(self, spreads=each, covariance_nm2=chosen * np.outer(wider, wider))

    def chance(self, columns: Floats, friction_nm: Floats) -> float:
        """Return how likely noise alone leaves as much as it is left of a curve by a linear law.

        What a law leaves is judged by Hotelling's statistic under every kind of noise that the
        passes allow, each by its weight: speeds err together, and a level that all of them share
        is no evidence against a law.

        Parameters
        ----------
        columns : ndarray, shape (G, p)
            Of the law, or its derivatives by its parameters.
        friction_nm : ndarray, shape (G,)
            The curve.

        Returns
        -------
        float
            1 where the law has as many parameters as there are speeds.
        """
        from scipy.special import betainc

        basis = np.linalg.qr(columns, mode="complete")[0]
        left = basis[:, np.linalg.matrix_rank(columns) :]
        many = left.shape[1]
        if many == 0:
            return 1.0
        dust = (_DUST * float(np.max(np.abs(friction_nm)))) ** 2 + 1e-300
        of_left = left.T @ self.covariance_nm2 @ left + dust * np.eye(many)
        value = left.T @ friction_nm
        statistic = np.linalg.solve(of_left, np.tile(value, (of_left.shape[0], 1))[..., np.newaxis])
        statistic = statistic[..., 0] @ value
        tail = betainc(0.5 * self.freedom, 0.5 * many, self.freedom / (self.freedom + statistic))
        return float(self.weight @ tail)


def noise_of(passes: Sequence[TimedPass]) -> PassNoise | None:
    """Return what the noise does to every speed's friction; None where there is too little to tell.

    Parameters
    ----------
    passes : sequence of TimedPass
        All passes of the curve; groups are numbered from 0 without gaps.
    """
    blocks = cut(passes)
    free = blocks.torque_nm.shape[0] - int(np.linalg.matrix_rank(blocks.columns))
    if free < 4:
        return None
    scaled = evened(blocks)
    memory_s, share = _grid(blocks)
    weight, variance_nm2 = _likelihood(scaled, memory_s, share)
    likeliest = int(np.argmax(weight))
    noise = _Noise(memory_s[likeliest], share[likeliest], variance_nm2[likeliest])
    told = weight > _TOLD * weight.max()
    weight = weight[told] / weight[told].sum()
    left = scaled[0].torque_nm - scaled[0].columns @ (scaled[0].columns.T @ scaled[0].torque_nm)
    groups = range(int(blocks.group.max()) + 1)
    louder = np.sqrt([_excess(scaled[0], left, group, noise) for group in groups])
    covariance = _of_means(scaled, memory_s[told], share[told])
    covariance *= variance_nm2[told][:, np.newaxis, np.newaxis] * np.outer(louder, louder)
    each = tuple(_spread(covariance[:, group, group], weight) for group in groups)
    return PassNoise(each, weight, covariance, float(free))


@dataclass(frozen=True)
class _Noise:
    """One memory, the slow part's share of the variance, and the variance."""

    memory_s: float
    share: float
    variance_nm2: float


def _grid(blocks: Blocks) -> tuple[Floats, Floats]:
    """Return memories and slow shares of the noise, shapes (g,): white, then all pairs."""
    longest_s = max(
        float(np.ptp(blocks.time_s[blocks.recording == r])) for r in np.unique(blocks.recording)
    )
    memories = np.geomspace(0.5 * blocks.length_s, max(longest_s, blocks.length_s), _MEMORIES)
    memory, share = np.meshgrid(memories, np.array(_SHARES), indexing="ij")
    return np.append(blocks.length_s, memory.ravel()), np.append(0.0, share.ravel())


def _likelihood(
    scaled: tuple[Blocks, Floats], memory_s: Floats, share: Floats
) -> tuple[Floats, Floats]:
    """Return each grid point's weight and its noise variance, shapes (g,).

    The restricted likelihood, by Kalman's filter: it whitens torque and columns alike, for all
    grid points side by side.
    """
    blocks = scaled[0]
    data = np.column_stack((blocks.columns, blocks.torque_nm))
    n, width = data.shape
    left, gain, whole = _gains(blocks, memory_s, share)
    white = np.empty((n, width, memory_s.size))
    slow = np.zeros(white.shape[1:])
    for i in range(n):
        slow *= left[i]
        np.subtract(data[i][:, np.newaxis], slow, out=white[i])
        slow += gain[i] * white[i]
    white /= np.sqrt(whole)[:, np.newaxis]
    gram = np.empty((memory_s.size, width, width))
    for j in range(width):  # a column at a time, and half of a symmetric matrix
        gram[:, j, j:] = np.einsum("ig,ikg->gk", white[:, j], white[:, j:])
        gram[:, j:, j] = gram[:, j, j:]
    log_size = np.log(whole).sum(axis=0)
    own, cross, square = gram[:, :-1, :-1], gram[:, :-1, -1], gram[:, -1, -1]
    solved = np.linalg.solve(own, cross[:, :, np.newaxis])[:, :, 0]
    rest = np.maximum(square - np.einsum("gj,gj->g", cross, solved), 1e-300)
    freedom = n - width + 1
    log_weight = -0.5 * (log_size + np.linalg.slogdet(own)[1] + freedom * np.log(rest))
    # All memories weigh alike beforehand; white noise, which is none, as much as one of them.
    weight = np.exp(log_weight - log_weight.max())
    weight[0] *= len(_SHARES)
    return weight / weight.sum(), rest / freedom


def _gains(blocks: Blocks, memory_s: Floats, share: Floats) -> tuple[Floats, Floats, Floats]:
    """Return what Kalman's filter does at every block, whatever the torque, shapes (n, g).

    How much of the slow part is left since the block before (none at a recording's beginning), how
    much of what is new in a block is taken for slow, and the variance of what is new.
    """
    begins = np.diff(blocks.recording, prepend=-1) != 0
    since_s = np.where(begins, np.inf, np.diff(blocks.time_s, prepend=0.0))
    left = np.exp(-since_s[:, np.newaxis] / memory_s)
    kept = left**2
    renewed = (1.0 - kept) * share
    white = (1.0 - share) * blocks.thinness[:, np.newaxis]
    gain, whole = np.empty_like(left), np.empty_like(left)
    unsure = np.zeros_like(share)
    for i in range(left.shape[0]):
        unsure = kept[i] * unsure + renewed[i]
        whole[i] = unsure + white[i]
        gain[i] = unsure / whole[i]
        unsure = unsure * (1.0 - gain[i])
    return left, gain, whole


def _of_means(scaled: tuple[Blocks, Floats], memory_s: Floats, share: Floats) -> Floats:
    """Return the covariance of all speeds' friction for noise of variance 1, shape (m, G, G).

    Friction is half the difference of the directions' means, or one direction's mean.
    """
    blocks, scale = scaled
    weight = np.zeros((scale.shape[0], blocks.group.shape[0]))
    for group in range(scale.shape[0]):
        own = blocks.group == group
        sides = np.unique(blocks.direction[own])
        for side in sides.tolist():
            there = own & (blocks.direction == side)
            mass = 1.0 / blocks.thinness[there]
            weight[group, there] = side * mass / (mass.sum() * sides.size)
    weight *= scale[:, np.newaxis]
    apart_s = np.abs(blocks.time_s[:, np.newaxis] - blocks.time_s)
    same = blocks.recording[:, np.newaxis] == blocks.recording
    white = (weight * blocks.thinness) @ weight.T
    out = np.empty((share.shape[0], *white.shape))
    for memory in np.unique(memory_s).tolist():
        at = memory_s == memory
        slow = weight @ np.where(same, np.exp(-apart_s / memory), 0.0) @ weight.T
        out[at] = np.multiply.outer(1.0 - share[at], white) + np.multiply.outer(share[at], slow)
    return out


def _excess(blocks: Blocks, left_nm: Floats, group: int, noise: _Noise) -> float:
    """Return how much larger one speed's slow noise is than all speeds', 1 within chance.

    Second differences do not see a slow stick-slip or ripple that only this speed has. What is left
    of its passes' torque about their means is held against what the common noise would leave, and
    chance may exceed that by `_BEYOND_CHANCE` of the logarithm's deviations.
    """
    own = np.flatnonzero(blocks.group == group)
    number = blocks.number[own]
    same = number[:, np.newaxis] == number
    centre = np.eye(own.size) - same / same.sum(axis=1)
    apart_s = np.abs(blocks.time_s[own][:, np.newaxis] - blocks.time_s[own])
    covariance = noise.share * same * np.exp(-apart_s / noise.memory_s)
    covariance += (1.0 - noise.share) * np.diag(blocks.thinness[own])
    about = centre @ covariance @ centre
    expected = float(np.trace(about)) * noise.variance_nm2
    if not expected > 0.0:
        return 1.0
    freedom = float(np.trace(about)) ** 2 / float(np.sum(about**2))
    ratio = float(np.sum((centre @ left_nm[own]) ** 2)) / expected
    return ratio if ratio > math.exp(_BEYOND_CHANCE * math.sqrt(2.0 / freedom)) else 1.0


def _spread(variance_nm2: Floats, weight: Floats) -> Spread:
    """Return the spread whose interval holds 95 % of the mixture of normal errors."""
    deviation = np.sqrt(np.maximum(variance_nm2, 0.0))
    each = [
        (s * _ROOT_2, w)
        for s, w in zip(deviation.tolist(), weight.tolist(), strict=True)
        if s > 0.0
    ]
    low, high = 0.0, 4.0 * float(deviation.max())
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        outside = sum([w * math.erfc(middle / s) for s, w in each])
        low, high = (middle, high) if outside > 0.05 else (low, middle)
    mean = float(weight @ deviation**2)
    scatter = float(weight @ (deviation**2 - mean) ** 2)
    dof = max(2.0 * mean**2 / scatter, 1.0) if scatter > 0.0 else math.inf
    return Spread(high / student_975(dof), dof)
