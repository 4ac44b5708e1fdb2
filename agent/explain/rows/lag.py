"""How much later than its position a drive reports its velocity, and the velocity without that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.rows.pieces import Piece
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass
from agent.physics.derivative import slope

_LONGEST_LAG_S = 0.03
_PART = 0.75  # of a sample: differences and observers are late by so much, and it is no riddle


@dataclass(frozen=True)
class Lag:
    """How late a velocity is, as the first two terms of ``own + a own' + b own''``.

    Parameters
    ----------
    late_s : float
        a: a delay, or the time constant of a filter; 0 where unclear.
    bend_s2 : float
        ``b - a**2 / 2``: 0 for a delay, which shifts all frequencies alike; down to ``-a**2 / 2``
        for a filter, which takes ``(w a)**2 / 2`` of a swing at w, too.
    period_s : float
        Of the samples.
    """

    late_s: float
    bend_s2: float
    period_s: float

    @property
    def part_of_sample(self) -> bool:
        """Return whether velocities are usually so late: more is for an explanation to name."""
        return is_part_of_sample(self.late_s, self.period_s)

    def undone(self, velocity: Floats, period_s: float, cutoff_hz: float) -> Floats:
        """Return a velocity in step with the position, shape (n,)."""
        if self.late_s == 0.0:
            return velocity
        own = lowpass(velocity, period_s, cutoff_hz)
        bent = self.bend_s2 * slope(slope(own, period_s), period_s)
        return np.asarray(earlier(velocity, self.late_s, period_s) + bent)


def is_part_of_sample(late_s: float, period_s: float) -> bool:
    """Return whether a lag, s, is one that velocities usually have between samples."""
    return abs(late_s) <= _PART * period_s


def lags_of(
    pieces: Sequence[Piece], velocities: Sequence[Floats], position_rad: Floats
) -> tuple[Lag, ...]:
    """Return by how much each piece's velocity is later than its position.

    Observers, filters and differences report it late. It is what acceleration and jerk explain of
    the difference to the position's own derivative, in the band.

    Parameters
    ----------
    pieces : sequence of Piece
    velocities : sequence of ndarray
        As reported, by piece.
    position_rad : ndarray, shape (N,)
        NaN where not recorded.
    """
    return tuple(
        lag_of(velocity, position_rad[piece.full], piece.period_s, piece.cutoff_hz)
        for piece, velocity in zip(pieces, velocities, strict=True)
    )


def lag_of(velocity: Floats, position: Floats, period_s: float, cutoff_hz: float) -> Lag:
    """Return the lag of one piece, arrays of shape (n,); see `lags_of`."""
    none = Lag(0.0, 0.0, period_s)
    if np.isnan(position).all():
        return none
    derived, own = lowpass(np.stack((slope(position, period_s), velocity)), period_s, cutoff_hz)
    first = slope(own, period_s)
    second = slope(first, period_s)
    late = derived - own
    energy = float(first @ first)
    if not energy > 0.0:
        return none
    late_s = float(late @ first) / energy
    if abs(late_s) > _LONGEST_LAG_S:
        return none
    jerk = second - first * float(second @ first) / energy
    square = float(jerk @ jerk)
    bend = float(late @ jerk) / square if square > 0.0 else 0.0
    return Lag(late_s, min(max(bend, 0.0), 0.5 * late_s**2) - 0.5 * late_s**2, period_s)


def earlier(values: Floats, by_s: float, period_s: float) -> Floats:
    """Return even samples, (n,) or (n, k), each as it is `by_s` later; the ends stay what they are.

    By four points: a straight line between two would take ``(w T)^2 / 8`` of a swing at w, half a
    sample from either.
    """
    return earlier_by_stretch(values, [(slice(0, values.shape[0]), period_s)], by_s)


def earlier_by_stretch(
    columns: Floats, stretches: Sequence[tuple[slice, float]], by_s: float
) -> Floats:
    """Return the same of every stretch by itself, shape (N,) or (N, k).

    Parameters
    ----------
    columns : ndarray, shape (N,) or (N, k)
    stretches : sequence of (slice, float)
        Where each stands, together all N samples, and its period, s.
    by_s : float
    """
    from agent.explain.rows.lag_kernel import earlier_stretches

    own = np.ascontiguousarray(columns.reshape(columns.shape[0], -1), dtype=np.float64)
    out = np.empty_like(own)
    points = [_four_points(by_s / period_s) for _, period_s in stretches]
    earlier_stretches(
        own,
        np.array([at.start for at, _ in stretches], dtype=np.int64),
        np.array([at.stop for at, _ in stretches], dtype=np.int64),
        np.array([first for first, _ in points], dtype=np.int64),
        np.array([weights for _, weights in points]),
        out,
    )
    return out.reshape(columns.shape)


def _four_points(samples: float) -> tuple[int, tuple[float, float, float, float]]:
    """Return how many samples later the first of four points stands, and their weights."""
    whole, part = divmod(samples, 1.0)
    return int(whole) - 1, (
        -part * (part - 1.0) * (part - 2.0) / 6.0,
        (part + 1.0) * (part - 1.0) * (part - 2.0) / 2.0,
        -(part + 1.0) * part * (part - 2.0) / 2.0,
        (part + 1.0) * part * (part - 1.0) / 6.0,
    )
