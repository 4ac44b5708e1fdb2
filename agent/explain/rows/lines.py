"""Lines in the spectrum of what is left: torque that swings at a frequency of its own, in time.

Mains, a neighbour that shakes the base, a loop on the verge of ringing: what the joint does at
that moment plays no part, so that no axis of the motion shows it. Below the comparison's band the
residual is searched, above it the measured torque itself, as no twin predicts anything there.

A line stands against its own neighbourhood. Each recording's power over the median of the bins
nearby, times log 2, is exponential with mean one where there is no line, whatever the spectrum's
colour; the sum over the recordings is gamma distributed (Welch, IEEE Trans. Audio Electroacoust. 15
(1967) 70). Where spectra are rougher than that, their own upper quantile nearby scales the sum
down. A wave of the position has a frequency, too, but another one at every speed; a cycle that
repeats evenly has lines which its motion shows as well. Neither is a line of time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.in_step import least
from agent.explain.rows.pieces import Piece
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass

_SHORTEST_S = 8.0  # stretches: a shorter one has lines as wide as anything else
_SAME_BAND = 0.99  # of the widest: stretches in a narrower one are not compared with the others
_LEAST_PERIODS = 8.0  # in a stretch: fewer are a trend
_GUARD = 6  # bins to either side of a line that are the line's own
_NEAR = 60  # bins to either side whose median is the background
_FAR = 180  # bins to either side whose upper quantile says how rough a spectrum is
_STRIDE = 15  # bins
_UPPER = 0.95
_FALSE = 0.01  # over all frequencies
_MATERIAL = 0.02  # of what is left
_MOST = 3
_SAME_SPEED = 0.1  # of the speed
_DRIVEN = 2.0  # times a line's torque: a motion that needs more is the drive's, not the line's
_AT_OTHER_SPEEDS = 0.3  # of the line's torque: what is there at two speeds alone is no line of time

Signal = Callable[[Piece], Floats]


@dataclass(frozen=True)
class Line:
    """One line of the spectrum.

    Parameters
    ----------
    frequency_hz, half_width_hz : float
    energy_nm2 : float
        Mean square of its torque over the recordings.
    share : float
        Of what is left, the part of the torque above the band counted in where the line lies there.
    p_value : float
        Of the greatest of as many frequencies as were looked at.
    in_band : bool
        Whether it lies in the band of the comparison.
    spectrum : tuple of ndarray, optional
        Frequencies around it, root mean square torque of a sine there, and that of its
        neighbourhood, each shape (f,).
    """

    frequency_hz: float
    half_width_hz: float
    energy_nm2: float
    share: float
    p_value: float
    in_band: bool
    spectrum: tuple[Floats, Floats, Floats] | None = field(default=None, compare=False, repr=False)

    @property
    def matters(self) -> bool:
        """Return whether it holds a material share of what is left."""
        return self.share > _MATERIAL

    @property
    def axis(self) -> str:
        """Return its axis as the deficiency map names it."""
        return f"frequency_hz {self.frequency_hz:.4g}"


@dataclass(frozen=True)
class _Spectra:
    """Power of some even stretches on common frequencies (f,), as mean squares: (r, f)."""

    hertz: Floats
    power: Floats

    @property
    def step_hz(self) -> float:
        return float(self.hertz[1] - self.hertz[0])


def lines_of(table: Table, left_nm: Floats) -> tuple[Line, ...]:
    """Return the lines of what is left, the strongest first.

    Parameters
    ----------
    table : Table
    left_nm : ndarray, shape (n,)
        What a model leaves at the table's rows.
    """
    pieces = [
        piece
        for piece in table.pieces
        if _seconds(piece) >= _SHORTEST_S
        and piece.cutoff_hz >= _SAME_BAND * table.cutoff_hz
        and table.used[piece.rows].any()
    ]
    if not pieces:
        return ()
    within = np.where(table.used, left_nm, 0.0)
    inside = _Sought(table, pieces, lambda p: within[p.rows], in_band=True)
    outside = _Sought(table, pieces, lambda p: _above_band(table, p), in_band=False)
    energy = inside.energy_nm2
    found = [
        *_lines(inside, energy),
        *_lines(outside, energy + outside.energy_nm2),
    ]
    return tuple(sorted(found, key=lambda line: -line.share)[:_MOST])


class _Sought:
    """One signal of some stretches, masked where the joint stands or turns round."""

    def __init__(
        self, table: Table, pieces: Sequence[Piece], signal: Signal, *, in_band: bool
    ) -> None:
        self.table, self.pieces, self.in_band = table, pieces, in_band
        self.signals = [signal(piece) for piece in pieces]
        self.speeds = [_at(table, "velocity_rad_s", piece, in_band=in_band) for piece in pieces]
        count = sum(_used(table, p, in_band=in_band).sum() for p in pieces)
        self.energy_nm2 = float(sum(s @ s for s in self.signals)) / max(float(count), 1.0)

    def period_s(self, piece: Piece) -> float:
        """Return how far the signal's samples are apart."""
        return piece.period_s * (piece.stride if self.in_band else 1)

    def band_hz(self) -> tuple[float, float]:
        """Return where lines are looked for: below the cutoff, or above it."""
        slowest = max(self.period_s(p) for p in self.pieces)
        lowest = _LEAST_PERIODS / min(_seconds(p) for p in self.pieces)
        cutoff = self.table.cutoff_hz
        return (lowest, min(cutoff, 0.45 / slowest)) if self.in_band else (cutoff, 0.49 / slowest)


def _seconds(piece: Piece) -> float:
    return float((piece.full.stop - piece.full.start) * piece.period_s)


def _used(table: Table, piece: Piece, *, in_band: bool) -> NDArray[np.bool_]:
    used = table.used[piece.rows]
    if in_band:
        return used
    return np.repeat(used, piece.stride)[: piece.full.stop - piece.full.start]


def _at(table: Table, name: str, piece: Piece, *, in_band: bool) -> Floats:
    return table.rows[name][piece.rows] if in_band else table.full[name][piece.full]


def _above_band(table: Table, piece: Piece) -> Floats:
    """Return the measured torque above the band of the comparison, 0 where rows are not used."""
    torque = table.full["torque_nm"][piece.full]
    high = torque - lowpass(torque, piece.period_s, piece.cutoff_hz)
    return np.where(_used(table, piece, in_band=False), high, 0.0)


def _spectra(sought: _Sought, signals: Sequence[Floats]) -> _Spectra:
    """Return Hann-windowed power of every stretch on twice as many bins as the longest resolves."""
    longest_s = 2.0 * max(_seconds(p) for p in sought.pieces)
    low, high = sought.band_hz()
    hertz = np.arange(math.ceil(low * longest_s), math.floor(high * longest_s) + 1) / longest_s
    power = np.empty((len(signals), hertz.shape[0]))
    for k, (piece, signal) in enumerate(zip(sought.pieces, signals, strict=True)):
        window = np.hanning(signal.shape[0] + 2)[1:-1]
        period = sought.period_s(piece)
        length = max(round(longest_s / period), signal.shape[0])
        wave = np.abs(np.fft.rfft((signal - signal.mean()) * window, length)) ** 2
        own = np.fft.rfftfreq(length, period)
        # Half of the squared amplitude of a sine: its mean square.
        power[k] = np.interp(hertz, own, wave) * 2.0 / float(window.sum()) ** 2
    return _Spectra(hertz, power)


def _lines(sought: _Sought, energy_nm2: float) -> list[Line]:
    """Return a signal's lines; `energy_nm2` is what their shares are of."""
    spectra = _spectra(sought, sought.signals)
    count = spectra.hertz.shape[0]
    if count <= 2 * _FAR or energy_nm2 <= 0.0:
        return []
    standing, p_values = _standing(spectra)
    if p_values.min() * count > _FALSE:
        return []
    moved = _moved(sought, spectra)
    out: list[Line] = []
    free = np.ones(count, dtype=np.bool_)
    for _ in range(_MOST):
        best = int(np.argmax(np.where(free, standing, -np.inf)))
        near = slice(max(best - _GUARD, 0), best + _GUARD + 1)
        if not free[best] or p_values[best] * count > _FALSE:
            break
        free[near] = False
        if moved[near].min() * count <= _FALSE or not _at_other_speeds(sought, spectra.hertz[best]):
            continue
        energy, width = _extent(spectra, best)
        hertz = float(spectra.hertz[best])
        share = min(energy / energy_nm2, 1.0)
        p = min(float(p_values[best]) * count, 1.0)
        around = _around(spectra, hertz)
        out.append(Line(hertz, width, energy, share, p, sought.in_band, around))
        reach = math.ceil(width / spectra.step_hz)
        free[max(best - reach, 0) : best + reach + 1] = False
    return out


def _standing(spectra: _Spectra) -> tuple[Floats, Floats]:
    """Return each bin's sum over the stretches, and how likely it is without a line, (f,) each."""
    from scipy.special import gammaincc, gammainccinv

    stretches = spectra.power.shape[0]
    total = np.sum(spectra.power / np.maximum(_background(spectra), 1e-300), axis=0)
    expected = float(gammainccinv(stretches, 1.0 - _UPPER))
    rough = np.maximum(_nearby(total, _FAR, _UPPER) / expected, 1.0)
    return total / rough, np.asarray(gammaincc(stretches, total / rough))


def _background(spectra: _Spectra) -> Floats:
    """Return what the median nearby says of each stretch's power without a line, shape (r, f)."""
    return np.stack([_nearby(row, _NEAR, 0.5) / math.log(2.0) for row in spectra.power])


def _nearby(values: Floats, reach: int, quantile: float) -> Floats:
    """Return a quantile over the bins within `reach`, every `_STRIDE` bins, and between, (f,)."""
    count = values.shape[0]
    around = np.pad(values, reach, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * reach + 1)[::_STRIDE]
    at = np.arange(0, count, _STRIDE)
    return np.interp(np.arange(count), at, np.quantile(windows, quantile, axis=-1))


def _moved(sought: _Sought, spectra: _Spectra) -> Floats:
    """Return how likely each bin of the motion is without a line there, shape (f,).

    The velocity's, and that of its direction. What shakes the joint moves it: where the velocity
    swings by no more than such a torque makes the inertia swing, it is no line of the cycle's.
    """
    swing = _spectra(sought, [speed - speed.mean() for speed in sought.speeds])
    turn = _spectra(
        sought,
        [
            np.sign(speed) * _used(sought.table, piece, in_band=sought.in_band)
            for piece, speed in zip(sought.pieces, sought.speeds, strict=True)
        ],
    )
    inertia = _inertia(sought.table)
    needed = np.mean(swing.power, axis=0) * (2.0 * np.pi * swing.hertz * inertia) ** 2
    driven = needed > _DRIVEN**2 * np.mean(spectra.power, axis=0)
    return np.minimum(np.where(driven, _standing(swing)[1], 1.0), _standing(turn)[1])


def _inertia(table: Table) -> float:
    """Return the inertia that the recordings show beside the plain structure, kg m2."""
    found = least(table.base[table.used], table.measured_nm[table.used])
    return max(float(found[BASE.index("inertia_kg_m2")]), 0.0)


def _at_other_speeds(sought: _Sought, hertz: float) -> bool:
    """Return whether a line keeps frequency and phase beside the two speeds that show it most."""
    used = [_used(sought.table, p, in_band=sought.in_band) for p in sought.pieces]
    speed = np.abs(np.concatenate(sought.speeds))[np.concatenate(used)]
    slow = max(float(np.quantile(speed, 0.02)), 1e-3 * float(speed.max()), 1e-300)
    kind = np.log(np.maximum(speed / slow, 1.0)) / _SAME_SPEED
    along = []
    for piece, signal, mask in zip(sought.pieces, sought.signals, used, strict=True):
        wave = np.exp(-2j * np.pi * hertz * sought.period_s(piece) * np.arange(signal.shape[0]))
        turned = (signal * wave)[mask]
        along.append((turned * np.conj(turned.mean() if turned.size else 0.0)).real)
    shown = np.bincount(kind.astype(np.int64), np.concatenate(along))
    there = np.bincount(kind.astype(np.int64)).astype(np.float64)
    whole = float(shown.sum()) / float(there.sum())
    for _ in range(2):
        # A speed that is held wavers over the border between two classes.
        most = int(np.argmax(shown))
        near = slice(max(most - 1, 0), most + 2)
        shown[near] = there[near] = 0.0
    left = float(there.sum())
    return left > 0.0 and float(shown.sum()) / left >= _AT_OTHER_SPEEDS * whole


def _around(spectra: _Spectra, hertz: float) -> tuple[Floats, Floats, Floats]:
    """Return the spectrum from half to twice a frequency: mean over the stretches, as torque."""
    near = (spectra.hertz >= 0.5 * hertz) & (spectra.hertz <= 2.0 * hertz)
    return (
        spectra.hertz[near],
        np.sqrt(np.mean(spectra.power[:, near], axis=0)),
        np.sqrt(np.mean(_background(spectra)[:, near], axis=0)),
    )


def _extent(spectra: _Spectra, best: int) -> tuple[float, float]:
    """Return a line's mean square, sidebands counted in, and half of its width, Hz."""
    reach = _NEAR
    low, high = max(best - reach, 0), min(best + reach + 1, spectra.hertz.shape[0])
    background = _background(spectra)[:, low:high]
    excess = np.mean(spectra.power[:, low:high] - background, axis=0)
    level = np.mean(background, axis=0)
    high_bins = excess > 4.0 * level
    high_bins[best - low] = True
    # A sine's energy is spread over 1.5 bins of a Hann window, of which padding makes three.
    energy = float(excess[high_bins].sum()) / 3.0
    away = np.abs(np.flatnonzero(high_bins) - (best - low))
    width = max(float(away.max()), 2.0) * spectra.step_hz
    return max(energy, 0.0), width
