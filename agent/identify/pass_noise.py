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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.passes import Pass
from agent.identify.result import Floats
from agent.identify.uncertainty import student_975
from agent.physics.rigid_body import gravity_columns

_BLOCKS = 240  # of all passes together, where they are long enough
_BLOCK_SAMPLES = 4
_MEMORIES = 16
_SHARES = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 0.99)
_ASYMMETRY_FROM = 6  # speeds, from which on a viscous friction of two directions can be allowed for
_BISECTIONS = 50
_BEYOND_CHANCE = 2.5


@dataclass(frozen=True)
class TimedPass:
    """A pass, and where it stands: recording, first sample's time, and the speed it belongs to."""

    samples: Pass
    recording: int
    start_s: float
    group: int


@dataclass(frozen=True)
class Spread:
    """What the noise does to one speed's friction: standard error, N m, and degrees of freedom.

    ``student_975(dof) x standard_error_nm`` is the half of the 95 % interval.
    """

    standard_error_nm: float
    dof: float


@dataclass(frozen=True)
class _Blocks:
    """All passes in blocks of about equal length, n in all, in order of recording and time."""

    torque_nm: Floats
    columns: Floats  # (n, p): what is no noise
    recording: NDArray[np.int64]
    time_s: Floats
    group: NDArray[np.int64]
    direction: Floats
    number: NDArray[np.int64]  # of the pass
    thinness: Floats  # usual length over own length: the white part's share of variance
    length_s: float


def spreads(passes: Sequence[TimedPass]) -> list[Spread] | None:
    """Return the spread of every speed's friction; None where there is too little to tell.

    Parameters
    ----------
    passes : sequence of TimedPass
        All passes of the curve; groups are numbered from 0 without gaps.
    """
    blocks = _cut(passes)
    free = blocks.torque_nm.shape[0] - np.linalg.matrix_rank(blocks.columns)
    if free < 4:
        return None
    scaled = _evened(blocks)
    memory_s, share = _grid(blocks)
    weight, variance_nm2 = _likelihood(scaled, memory_s, share)
    likeliest = int(np.argmax(weight))
    noise = _Noise(memory_s[likeliest], share[likeliest], variance_nm2[likeliest])
    left = scaled[0].torque_nm - scaled[0].columns @ (scaled[0].columns.T @ scaled[0].torque_nm)
    out = []
    for group in range(int(blocks.group.max()) + 1):
        of_noise = _of_mean(scaled, group, memory_s, share) * variance_nm2
        out.append(_spread(of_noise * _excess(scaled[0], left, group, noise), weight))
    return out


@dataclass(frozen=True)
class _Noise:
    """One memory, the slow part's share of the variance, and the variance."""

    memory_s: float
    share: float
    variance_nm2: float


def _cut(passes: Sequence[TimedPass]) -> _Blocks:
    """Cut all passes into blocks of about equal length."""
    ordered = sorted(passes, key=lambda p: (p.recording, p.start_s))
    total = sum(p.samples.torque_nm.size for p in ordered)
    size = max(_BLOCK_SAMPLES, -(-total // _BLOCKS))
    position = all(p.samples.position_rad is not None for p in ordered)
    rows = []
    for number, p in enumerate(ordered):
        torque = p.samples.torque_nm
        pieces = np.array_split(np.arange(torque.size), max(torque.size // size, 1))
        where = np.zeros(2)
        for piece in pieces:
            if position and p.samples.position_rad is not None:
                gravity = gravity_columns(p.samples.position_rad[piece], p.samples.gear_ratio)
                where = gravity.mean(axis=0)
            rows.append(
                (
                    float(torque[piece].mean()),
                    p.recording,
                    p.start_s + float(piece.mean()) * p.samples.period_s,
                    p.group,
                    float(np.sign(p.samples.velocity_rad_s)),
                    number,
                    size / piece.size,
                    abs(p.samples.velocity_rad_s),
                    float(where[0]),
                    float(where[1]),
                )
            )
    table = np.array(rows)
    group, direction = table[:, 3].astype(np.int64), table[:, 4]
    speeds = int(group.max()) + 1
    friction = (group[:, np.newaxis] == np.arange(speeds)) * direction[:, np.newaxis]
    shared = [np.ones(len(rows)), table[:, 8], table[:, 9]]
    if speeds >= _ASYMMETRY_FROM:
        shared.append(table[:, 7])
    return _Blocks(
        torque_nm=table[:, 0],
        columns=_independent(np.column_stack((friction, *shared))),
        recording=table[:, 1].astype(np.int64),
        time_s=table[:, 2],
        group=group,
        direction=direction,
        number=table[:, 5].astype(np.int64),
        thinness=table[:, 6],
        length_s=size * float(np.median([p.samples.period_s for p in ordered])),
    )


def _independent(columns: Floats) -> Floats:
    """Return an orthonormal basis of the columns, shape (n, rank)."""
    length = np.linalg.norm(columns, axis=0)
    scaled = columns[:, length > 0.0] / length[length > 0.0]
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, singular > 1e-6 * singular[0]])


def _evened(blocks: _Blocks) -> tuple[_Blocks, Floats]:
    """Divide every speed by the size of its noise, as far as speeds differ beyond chance.

    Sizes come from second differences inside the passes, which neither gravity nor slow noise
    touches, and are drawn to their mean by as much as chance explains of their scatter.

    Returns
    -------
    blocks : _Blocks
        With scaled torque and columns.
    scale : ndarray, shape (groups,)
    """
    inside = (blocks.number[2:] == blocks.number[:-2]).nonzero()[0]
    bend = blocks.torque_nm[:-2] - 2.0 * blocks.torque_nm[1:-1] + blocks.torque_nm[2:]
    groups = int(blocks.group.max()) + 1
    level, freedom = np.full(groups, np.nan), np.zeros(groups)
    for group in range(groups):
        own = inside[blocks.group[inside] == group]
        size = float(np.sum(bend[own] ** 2 / blocks.thinness[own]))
        if own.size >= 2 and size > 0.0:
            # Second differences of white noise are correlated: 18/35 of them count.
            level[group], freedom[group] = math.log(size / own.size), 18.0 / 35.0 * own.size
    known = np.isfinite(level)
    scale = np.ones(groups)
    if np.count_nonzero(known) >= 2:
        chance = float(np.mean(2.0 / freedom[known]))
        scatter = float(np.var(level[known], ddof=1))
        keep = max(0.0, 1.0 - chance / scatter) if scatter > 0.0 else 0.0
        middle = float(np.mean(level[known]))
        scale[known] = np.exp(0.5 * keep * (level[known] - middle))
    by = scale[blocks.group]
    evened = _Blocks(
        blocks.torque_nm / by,
        _independent(blocks.columns / by[:, np.newaxis]),
        blocks.recording,
        blocks.time_s,
        blocks.group,
        blocks.direction,
        blocks.number,
        blocks.thinness,
        blocks.length_s,
    )
    return evened, scale


def _grid(blocks: _Blocks) -> tuple[Floats, Floats]:
    """Return memories and slow shares of the noise, shapes (g,): white, then all pairs."""
    longest_s = max(
        float(np.ptp(blocks.time_s[blocks.recording == r])) for r in np.unique(blocks.recording)
    )
    memories = np.geomspace(0.5 * blocks.length_s, max(longest_s, blocks.length_s), _MEMORIES)
    memory, share = np.meshgrid(memories, np.array(_SHARES), indexing="ij")
    return np.append(blocks.length_s, memory.ravel()), np.append(0.0, share.ravel())


def _likelihood(
    scaled: tuple[_Blocks, Floats], memory_s: Floats, share: Floats
) -> tuple[Floats, Floats]:
    """Return each grid point's weight and its noise variance, shapes (g,).

    The restricted likelihood, by Kalman's filter: it whitens torque and columns alike, for all
    grid points side by side.
    """
    blocks = scaled[0]
    data = np.column_stack((blocks.columns, blocks.torque_nm))
    n, width = data.shape
    white = np.empty((n, memory_s.size, width))
    slow = np.zeros((memory_s.size, width))
    unsure = share.copy()
    log_size = np.zeros(memory_s.size)
    for i in range(n):
        if i and blocks.recording[i] != blocks.recording[i - 1]:
            slow, unsure = np.zeros_like(slow), share.copy()
        elif i:
            left = np.exp((blocks.time_s[i - 1] - blocks.time_s[i]) / memory_s)
            slow = left[:, np.newaxis] * slow
            unsure = left**2 * unsure + (1.0 - left**2) * share
        whole = unsure + (1.0 - share) * blocks.thinness[i]
        new = data[i] - slow
        white[i] = new / np.sqrt(whole)[:, np.newaxis]
        log_size += np.log(whole)
        gain = unsure / whole
        slow = slow + gain[:, np.newaxis] * new
        unsure = unsure * (1.0 - gain)
    gram = np.einsum("igj,igk->gjk", white, white)
    own, cross, square = gram[:, :-1, :-1], gram[:, :-1, -1], gram[:, -1, -1]
    solved = np.linalg.solve(own, cross[:, :, np.newaxis])[:, :, 0]
    rest = np.maximum(square - np.einsum("gj,gj->g", cross, solved), 1e-300)
    freedom = n - width + 1
    log_weight = -0.5 * (log_size + np.linalg.slogdet(own)[1] + freedom * np.log(rest))
    # All memories weigh alike beforehand; white noise, which is none, as much as one of them.
    weight = np.exp(log_weight - log_weight.max())
    weight[0] *= len(_SHARES)
    return weight / weight.sum(), rest / freedom


def _of_mean(scaled: tuple[_Blocks, Floats], group: int, memory_s: Floats, share: Floats) -> Floats:
    """Return the variance of a speed's friction for noise of variance 1, shape (g,).

    Friction is half the difference of the directions' means, or one direction's mean.
    """
    blocks, scale = scaled
    own = np.flatnonzero(blocks.group == group)
    direction, mass = blocks.direction[own], 1.0 / blocks.thinness[own]
    weight = np.zeros(own.size)
    sides = np.unique(direction)
    for side in sides.tolist():
        there = direction == side
        weight[there] = side * mass[there] / (mass[there].sum() * sides.size)
    apart_s = np.abs(blocks.time_s[own][:, np.newaxis] - blocks.time_s[own])
    same = blocks.recording[own][:, np.newaxis] == blocks.recording[own]
    pairs = np.where(same, np.outer(weight, weight), 0.0)
    out = (1.0 - share) * float(np.sum(weight**2 * blocks.thinness[own]))
    for memory in np.unique(memory_s).tolist():
        at = memory_s == memory
        out[at] += share[at] * float(np.sum(pairs * np.exp(-apart_s / memory)))
    return np.asarray(scale[group] ** 2 * out, dtype=np.float64)


def _excess(blocks: _Blocks, left_nm: Floats, group: int, noise: _Noise) -> float:
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
    told = weight > 1e-6 * weight.max()
    deviation, weight = deviation[told], weight[told] / weight[told].sum()
    low, high = 0.0, 4.0 * float(deviation.max())
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        outside = sum(
            w * math.erfc(middle / (s * math.sqrt(2.0))) if s > 0.0 else 0.0
            for s, w in zip(deviation.tolist(), weight.tolist(), strict=True)
        )
        low, high = (middle, high) if outside > 0.05 else (low, middle)
    mean = float(weight @ deviation**2)
    scatter = float(weight @ (deviation**2 - mean) ** 2)
    dof = max(2.0 * mean**2 / scatter, 1.0) if scatter > 0.0 else math.inf
    return Spread(high / student_975(dof), dof)
