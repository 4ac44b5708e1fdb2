"""Stretches of one recording in a row, with the motion across the few samples that were lost.

An arm that swings behind the motor swings on while samples are lost. Begun anew in every stretch,
as if it followed the motor stiffly, it would be where it is not for as long as a swing lasts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.pieces import Piece
from agent.identify.result import Floats
from agent.physics.gaps import LONGEST_GAP_S, between, bridge

_SAME_PERIOD = 0.01  # share


@dataclass(frozen=True)
class Bridged:
    """All full-rate samples, and between them those that stand where some were lost.

    Parameters
    ----------
    size : int
        M, of samples and bridges together.
    where : ndarray of int, shape (N,)
        Where the full-rate samples stand among them.
    chains : tuple of (slice, float)
        What is followed without a break, and its period, s.
    bridges : ndarray of int, shape (M - N,)
        Where the others stand.
    last : ndarray of int, shape (M - N,)
        The full-rate sample before the gap of each.
    gap_s, share : ndarray, shape (M - N,)
        How long that gap is, and how far on each stands in it.
    """

    size: int
    where: NDArray[np.int64]
    chains: tuple[tuple[slice, float], ...]
    bridges: NDArray[np.int64]
    last: NDArray[np.int64]
    gap_s: Floats
    share: Floats

    @classmethod
    def of(cls, pieces: Sequence[Piece]) -> Bridged:
        """Lay out the bridges between stretches of a run that are not far apart."""
        where = np.empty(pieces[-1].full.stop, dtype=np.int64)
        chains: list[tuple[int, list[Piece]]] = []
        bridges, last, long_s, share = [], [], [], []
        size = 0
        for piece in pieces:
            before = chains[-1][1][-1] if chains else None
            if before is not None and _in_a_row(before, piece):
                gap_s = _gap_s(before, piece)
                lost = max(round(gap_s / piece.period_s) - 1, 0)
                bridges.append(np.arange(size, size + lost))
                last.append(np.full(lost, before.full.stop - 1))
                long_s.append(np.full(lost, gap_s))
                share.append(between(lost))
                size += lost
                chains[-1][1].append(piece)
            else:
                chains.append((size, [piece]))
            count = piece.full.stop - piece.full.start
            where[piece.full] = np.arange(size, size + count)
            size += count
        stops = [start for start, _ in chains[1:]] + [size]
        periods = [float(np.mean([piece.period_s for piece in own])) for _, own in chains]
        starts = [start for start, _ in chains]
        return cls(
            size,
            where,
            tuple(zip(map(slice, starts, stops), periods, strict=True)),
            np.concatenate([np.empty(0, dtype=np.int64), *bridges]),
            np.concatenate([np.empty(0, dtype=np.int64), *last]),
            np.concatenate([np.empty(0), *long_s]),
            np.concatenate([np.empty(0), *share]),
        )

    @cached_property
    def longest_first(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
        """Return where the chains begin and end, and their periods, s, each shape (p,)."""
        chains = sorted(self.chains, key=lambda chain: chain[0].start - chain[0].stop)
        starts = np.array([at.start for at, _ in chains], dtype=np.int64)
        stops = np.array([at.stop for at, _ in chains], dtype=np.int64)
        return starts, stops, np.array([period_s for _, period_s in chains])

    def recorded(self, values: Floats) -> Floats:
        """Return of values, shape (M,), those of the full-rate samples, shape (N,)."""
        return values[self.where] if self.bridges.size else values

    def over(self, values: Floats, way: Floats | None = None) -> Floats:
        """Return full-rate values and those across the gaps, shape (M,).

        Parameters
        ----------
        values : ndarray, shape (N,)
        way : ndarray, shape (N,), optional
            What they are the rate of by time: so far they lead across a gap. Straight lines where
            that is not known.
        """
        if not self.bridges.size:
            return np.ascontiguousarray(values)
        out = np.empty(self.size)
        out[self.where] = values
        ends = values[self.last], values[self.last + 1]
        went = np.full(1, np.nan) if way is None else way[self.last + 1] - way[self.last]
        out[self.bridges] = bridge(*ends, went, self.gap_s, self.share)
        return out


def _in_a_row(before: Piece, piece: Piece) -> bool:
    """Return whether one stretch goes on where another one of its run ended."""
    alike = abs(piece.period_s - before.period_s) <= _SAME_PERIOD * before.period_s
    return before.run == piece.run and alike and 0.0 < _gap_s(before, piece) <= LONGEST_GAP_S


def _gap_s(before: Piece, piece: Piece) -> float:
    return float(piece.stretch.time_s[0] - before.stretch.time_s[-1])
