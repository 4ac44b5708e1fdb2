"""All passes of a friction curve in blocks of time: what the noise of their means is read from.

A block's torque is the friction of its speed, gravity, an offset, an asymmetry, and noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction.passes import Pass
from agent.identify.result import Floats
from agent.physics.rigid_body import gravity_columns

_BLOCKS = 240  # of all passes together, where they are long enough
_BLOCK_SAMPLES = 4
_ASYMMETRY_FROM = 6  # speeds, from which on a viscous friction of two directions can be allowed for


@dataclass(frozen=True)
class TimedPass:
    """A pass, and where it stands: recording, first sample's time, and the speed it belongs to."""

    samples: Pass
    recording: int
    start_s: float
    group: int


@dataclass(frozen=True)
class Blocks:
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


def cut(passes: Sequence[TimedPass]) -> Blocks:
    """Cut all passes into blocks of about equal length."""
    ordered = sorted(passes, key=lambda p: (p.recording, p.start_s))
    total = sum(p.samples.torque_nm.size for p in ordered)
    size = max(_BLOCK_SAMPLES, -(-total // _BLOCKS))
    position = all(p.samples.position_rad is not None for p in ordered)
    table = np.concatenate(
        [_rows(p, number, size, with_position=position) for number, p in enumerate(ordered)]
    )
    group, direction = table[:, 3].astype(np.int64), table[:, 4]
    speeds = int(group.max()) + 1
    friction = (group[:, np.newaxis] == np.arange(speeds)) * direction[:, np.newaxis]
    shared = [np.ones(table.shape[0]), table[:, 8], table[:, 9]]
    if speeds >= _ASYMMETRY_FROM:
        shared.append(table[:, 7])
    return Blocks(
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


def _rows(p: TimedPass, number: int, size: int, *, with_position: bool) -> Floats:
    """Return one pass's blocks of `size` samples or a little more, shape (n, 10).

    Torque, recording, time, group, direction, pass, thinness, speed, gravity's sine and cosine.
    """
    samples = p.samples
    where = np.zeros((samples.torque_nm.size, 2))
    if with_position and samples.position_rad is not None:
        where = gravity_columns(samples.position_rad, samples.gear_ratio)
    count = max(samples.torque_nm.size // size, 1)
    out = np.empty((count, 10))
    out[:, 1], out[:, 3], out[:, 5] = p.recording, p.group, number
    out[:, 4], out[:, 7] = np.sign(samples.velocity_rad_s), abs(samples.velocity_rad_s)
    for part, first, length in _even_parts(samples.torque_nm.size, count):
        inside = slice(first, first + length * (part.stop - part.start))
        middle = first + length * np.arange(part.stop - part.start) + 0.5 * (length - 1)
        out[part, 0] = samples.torque_nm[inside].reshape(-1, length).mean(axis=1)
        out[part, 2] = p.start_s + middle * samples.period_s
        out[part, 6] = size / length
        out[part, 8:] = where[inside].reshape(-1, length, 2).mean(axis=1)
    return out


def _even_parts(total: int, count: int) -> list[tuple[slice, int, int]]:
    """Cut into blocks whose lengths differ by one at most, the longer ones first.

    Returns
    -------
    list of (slice, int, int)
        Which blocks, where the first of them begins, and how long each of them is.
    """
    length, longer = divmod(total, count)
    parts = [
        (slice(0, longer), 0, length + 1),
        (slice(longer, count), longer * (length + 1), length),
    ]
    return [p for p in parts if p[0].stop > p[0].start]


def _independent(columns: Floats) -> Floats:
    """Return an orthonormal basis of the columns, shape (n, rank)."""
    length = np.linalg.norm(columns, axis=0)
    scaled = columns[:, length > 0.0] / length[length > 0.0]
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, singular > 1e-6 * singular[0]])


def evened(blocks: Blocks) -> tuple[Blocks, Floats]:
    """Divide every speed by the size of its noise, as far as speeds differ beyond chance.

    Sizes come from second differences inside the passes, which neither gravity nor slow noise
    touches, and are drawn to their mean by as much as chance explains of their scatter.

    Returns
    -------
    blocks : Blocks
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
    even = Blocks(
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
    return even, scale
