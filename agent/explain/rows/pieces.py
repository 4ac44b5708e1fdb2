"""Where every stretch of every run stands, and the one filter that everything passes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.sampling import Stretch
from agent.identify.signals.thinning import Part, Thinned
from agent.physics.derivative import slope

SLOWEST_HZ = 10.0
"""Samples a second below which a change of speed is over before it has been sampled."""

_UNKNOWN = 1e-3  # of a filter's weight
_SPELL_S = 0.1
_FAR_MORE = 20.0  # times the power: noise has at most a few times as much


@dataclass(frozen=True)
class Piece:
    """One stretch of one run: where it stands, and the band in which it is compared.

    Parameters
    ----------
    run : int
    stretch : Stretch
    full, rows : slice
        Where it stands among the full-rate samples and among the rows.
    stride : int
        Samples per row.
    cutoff_hz : float
        Of the low-pass that all its signals pass: its own sampling rate may narrow it.
    one_speed : bool
        Whether it is one pass: no speed is driven to change in it.
    """

    run: int
    stretch: Stretch
    full: slice
    rows: slice
    stride: int
    cutoff_hz: float
    one_speed: bool = False

    @property
    def period_s(self) -> float:
        """Return the even grid's period."""
        return self.stretch.period_s

    @property
    def slow(self) -> bool:
        """Return whether it is sampled too slowly for anything but speeds that are held."""
        return 1.0 / self.period_s < SLOWEST_HZ

    @property
    def shows_changes(self) -> bool:
        """Return whether a change of speed was driven in it, and sampled."""
        return not (self.slow or self.one_speed)


def band_of_pieces(pieces: Sequence[Piece]) -> Thinned:
    """Return the one filter that everything passes."""
    return Thinned([Part(p.full, p.rows, p.period_s, p.cutoff_hz, p.stride) for p in pieces])


def banded(raw: Floats, pieces: Sequence[Piece], band: Thinned | None = None) -> Floats:
    """Return full-rate columns, shape (N,) or (N, k), filtered, at the rows: (n,) or (n, k).

    Parameters
    ----------
    raw : ndarray
    pieces : sequence of Piece
    band : Thinned, optional
        Of these pieces, where it is known already.
    """
    out = (band or band_of_pieces(pieces))(raw.reshape(raw.shape[0], -1))
    return out[:, 0] if raw.ndim == 1 else out


def thinned(values: Floats, pieces: Sequence[Piece]) -> Floats:
    """Return full-rate values at the rows, shape (n,), as they are."""
    out = np.empty(pieces[-1].rows.stop)
    for piece in pieces:
        out[piece.rows] = values[piece.full][:: piece.stride]
    return out


def known_part(raw: Floats, pieces: Sequence[Piece]) -> Floats:
    """Return a full-rate torque (N,) as `banded` does, NaN only where the unknown reaches.

    A twin may not know its torque everywhere, as before a late channel's first sample.
    """
    unknown = ~np.isfinite(raw)
    out = banded(np.where(unknown, 0.0, raw), pieces)
    if unknown.any():
        out[np.abs(banded(unknown.astype(np.float64), pieces)) > _UNKNOWN] = np.nan
    return out


def as_recorded(full: Mapping[str, Floats], pieces: Sequence[Piece]) -> dict[str, Floats]:
    """Return full-rate columns with the motion as recorded instead of smooth, where speed changes.

    What is linear in it is filtered once then, as the table's own columns are: the smooth motion
    has passed the band's filter already. The same columns where what the smooth one lacks is noise.
    """
    velocity, acceleration = full["velocity_rad_s"].copy(), full["acceleration_rad_s2"].copy()
    for piece in pieces:
        if piece.shows_changes:
            velocity[piece.full] = full["velocity_raw_rad_s"][piece.full]
            acceleration[piece.full] = slope(velocity[piece.full], piece.period_s)
    lacks = banded(acceleration - full["acceleration_rad_s2"], pieces)
    if not _stands_out(lacks, pieces):
        return dict(full)
    return dict(full) | {"velocity_rad_s": velocity, "acceleration_rad_s2": acceleration}


def _stands_out(lacks: Floats, pieces: Sequence[Piece]) -> bool:
    """Return whether there is far more of something, in all, than where it is quiet."""
    each = []
    for piece in pieces:
        own, length = lacks[piece.rows], max(2, round(_SPELL_S / (piece.period_s * piece.stride)))
        whole = own.shape[0] // length * length
        each.append(np.mean(own[:whole].reshape(-1, length) ** 2, axis=1))
    spells = np.concatenate(each)
    return bool(spells.size and np.mean(spells) > _FAR_MORE * np.quantile(spells, 0.25))


def without_overshoot(full: Mapping[str, Floats], pieces: Sequence[Piece]) -> dict[str, Floats]:
    """Return full-rate columns whose motion is a weighted mean of what was recorded around.

    The low-pass rings beside a steep flank, and makes torque of it that was never there; no mean
    is beyond a limit that all of its parts keep to. Hann's weights, over a period of the cutoff.
    """
    out = dict(full)
    names = ("velocity_rad_s", "acceleration_rad_s2", "direction")
    velocity, acceleration, direction = (np.empty_like(full[name]) for name in names)
    for piece in pieces:
        at, period_s = piece.full, piece.period_s
        reach = min(round(0.5 / (piece.cutoff_hz * period_s)), (at.stop - at.start - 1) // 2)
        weights = np.hanning(2 * reach + 3)[1:-1]
        weights /= weights.sum()

        def mean(values: Floats, reach: int = reach, weights: Floats = weights) -> Floats:
            return np.convolve(np.pad(values, reach, mode="edge"), weights, mode="valid")

        velocity[at] = mean(full["velocity_raw_rad_s"][at])
        acceleration[at] = slope(velocity[at], period_s)
        direction[at] = mean(full["direction"][at])
    return out | dict(zip(names, (velocity, acceleration, direction), strict=True))
