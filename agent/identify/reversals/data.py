"""The samples about all reversals, and a law's columns at them: what a fit works on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.reversals.laws import ReversalLaw
from agent.identify.reversals.smoothing import resolution, white_noise
from agent.identify.reversals.turns import Motion, standing

_PER_CUTOFF = 4.0  # samples that are used, to one period of the cutoff
_FINEST = 1e-3  # of the torque: no sensor reads it finer, and no law is truer
_PASSED = 1.8  # of cutoff over sampling rate: the share of white noise that the filter passes


@dataclass(frozen=True)
class Data:
    """The samples about all reversals, N in all.

    Parameters
    ----------
    motion : Motion
        The tracks; laws with memory are simulated over the whole of them.
    kept : tuple of ndarray of int
        For every track the samples that are used.
    torque_nm : ndarray, shape (N,)
        Of the samples used, filtered.
    common : ndarray, shape (N, m)
        The columns that every law has, filtered alike.
    turn : ndarray of int, shape (N,)
        Number of the reversal that each belongs to.
    noise_nm : float
        Standard deviation of the torque's white noise behind the low-pass.
    """

    motion: Motion
    kept: tuple[NDArray[np.intp], ...]
    torque_nm: Floats
    common: Floats
    turn: NDArray[np.intp]
    noise_nm: float

    @property
    def turns(self) -> int:
        """Return the number of reversals."""
        return int(self.turn.max()) + 1

    def sums(self, rows: Floats) -> Floats:
        """Return the sums over every reversal's samples of rows (N, ...), shape (G, ...)."""
        starts = np.flatnonzero(np.diff(self.turn, prepend=-1))
        return np.asarray(np.add.reduceat(rows, starts, axis=0), dtype=np.float64)


def data_of(motion: Motion) -> Data:
    """Gather the samples about every reversal, less those that stand."""
    kept, torque, turn, noise = [], [], [], []
    number = 0
    for track in motion.tracks:
        moving = ~standing(track)
        # Behind the low-pass neighbours are alike: samples at four times the cutoff say it all.
        stride = max(1, int(1.0 / (_PER_CUTOFF * track.cutoff_hz * track.period_s)))
        filtered = track.filtered(track.torque_nm)
        index: list[NDArray[np.intp]] = [np.zeros(0, dtype=np.intp)]
        for one in track.turns:
            own = np.arange(one.start, one.stop, stride)
            own = own[moving[own]]
            index.append(own)
            torque.append(filtered[own])
            turn.append(np.full(own.size, number))
            number += 1
        kept.append(np.concatenate(index))
        passed = min(_PASSED * track.cutoff_hz * track.period_s, 1.0)
        # A drive's coarse torque can be noisier than its own step.
        own_noise = max(resolution(track.torque_nm)[1], white_noise(track.torque_nm))
        # A simulator's torque has no noise, and against none of it every law would be wrong.
        own_noise = max(own_noise, _FINEST * float(np.std(track.torque_nm)))
        noise.append(own_noise * math.sqrt(passed))
    return Data(
        motion,
        tuple(kept),
        np.concatenate(torque),
        common_columns(motion, kept),
        np.concatenate(turn),
        float(np.median(noise)),
    )


def columns_of(law: ReversalLaw, data: Data, x: Floats) -> Floats:
    """Return all columns at the samples used: the law's own, and every joint's, shape (N, m)."""
    shape = np.exp(x)
    own = [
        track.filtered(law.columns(track, shape))[kept]
        for track, kept in zip(data.motion.tracks, data.kept, strict=True)
    ]
    return np.concatenate((np.concatenate(own), data.common), axis=1)


def common_columns(motion: Motion, kept: Sequence[NDArray[np.intp]]) -> Floats:
    """Return velocity, acceleration, position and one offset for each recording, shape (N, m)."""
    recordings = sorted({track.recording for track in motion.tracks})
    rows = []
    for track, index in zip(motion.tracks, kept, strict=True):
        motion_of = np.column_stack(
            (
                track.velocity_rad_s,
                track.acceleration_rad_s2,
                track.position_rad - track.position_rad[0],
            )
        )
        offset = np.tile([float(track.recording == r) for r in recordings], (index.size, 1))
        rows.append(np.column_stack((motion_of[index], offset)))
    return np.concatenate(rows)
