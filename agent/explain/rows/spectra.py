"""How much torque there is at every frequency, and how far that stands out of what is nearby.

A line stands against its own neighbourhood. Each recording's power over the median of the bins
nearby, times log 2, is exponential with mean one where there is no line, whatever the spectrum's
colour; the sum over the recordings is gamma distributed (Welch, IEEE Trans. Audio Electroacoust. 15
(1967) 70). Where spectra are rougher than that, their own upper quantile nearby scales the sum
down. At the lowest frequencies all that is nearby lies above: where noise falls with frequency, its
fall is drawn on from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.pieces import Piece
from agent.explain.rows.table import Table
from agent.identify.result import Floats

_LEAST_PERIODS = 8.0  # in a stretch: fewer are a trend
NEAR = 60
"""Bins to either side whose median is the background."""

FAR = 180
"""Bins to either side whose upper quantile says how rough a spectrum is."""

_STRIDE = 15  # bins
_UPPER = 0.95
_RATIO = 1.5  # of the frequencies at the ends of a window that tells how noise falls
_FEWEST = 6  # bins in it
_TERMS = 3

Signal = Callable[[Piece], Floats]


class Sought:
    """One signal of some stretches, masked where the joint stands or turns round."""

    def __init__(
        self, table: Table, pieces: Sequence[Piece], signal: Signal, *, in_band: bool
    ) -> None:
        self.table, self.pieces, self.in_band = table, pieces, in_band
        self.signals = [signal(piece) for piece in pieces]
        self.speeds = [_at(table, "velocity_rad_s", piece, in_band=in_band) for piece in pieces]
        count = sum(used_of(table, p, in_band=in_band).sum() for p in pieces)
        self.energy_nm2 = float(sum(s @ s for s in self.signals)) / max(float(count), 1.0)

    def period_s(self, piece: Piece) -> float:
        """Return how far the signal's samples are apart."""
        return piece.period_s * (piece.stride if self.in_band else 1)

    def band_hz(self) -> tuple[float, float]:
        """Return where lines are looked for: below the cutoff, or above it."""
        slowest = max(self.period_s(p) for p in self.pieces)
        lowest = _LEAST_PERIODS / min(seconds_of(p) for p in self.pieces)
        cutoff = self.table.cutoff_hz
        return (lowest, min(cutoff, 0.45 / slowest)) if self.in_band else (cutoff, 0.49 / slowest)


def seconds_of(piece: Piece) -> float:
    """Return how long a stretch is."""
    return float((piece.full.stop - piece.full.start) * piece.period_s)


def used_of(table: Table, piece: Piece, *, in_band: bool) -> NDArray[np.bool_]:
    """Return which samples of a stretch are used, at its rows or at full rate."""
    used = table.used[piece.rows]
    if in_band:
        return used
    return np.repeat(used, piece.stride)[: piece.full.stop - piece.full.start]


def _at(table: Table, name: str, piece: Piece, *, in_band: bool) -> Floats:
    return table.rows[name][piece.rows] if in_band else table.full[name][piece.full]


@dataclass(frozen=True)
class Spectra:
    """Power of some even stretches on common frequencies (f,), as mean squares: (r, f).

    `falls` where it may be noise that is slow in part, so that its background may fall steeply.
    """

    hertz: Floats
    power: Floats
    falls: bool = False

    @property
    def step_hz(self) -> float:
        """Return how far the frequencies are apart."""
        return float(self.hertz[1] - self.hertz[0])

    def standing(self) -> tuple[Floats, Floats]:
        """Return each bin's sum over the stretches and its chance without a line, (f,) each."""
        from scipy.special import gammaincc, gammainccinv

        stretches = self.power.shape[0]
        total = np.sum(self.power / np.maximum(self.background(), 1e-300), axis=0)
        expected = float(gammainccinv(stretches, 1.0 - _UPPER))
        rough = np.maximum(_nearby(total, FAR, _UPPER) / expected, 1.0)
        return total / rough, np.asarray(gammaincc(stretches, total / rough))

    def background(self) -> Floats:
        """Return what the median nearby says of the power without a line, shape (r, f)."""
        near = np.stack([_nearby(row, NEAR, 0.5) / math.log(2.0) for row in self.power])
        if not self.falls:
            return near
        return np.maximum(near, np.stack([_fall(self.hertz, row) for row in self.power]))

    def around(self, hertz: float) -> tuple[Floats, Floats, Floats]:
        """Return the spectrum from half to twice a frequency: the stretches' mean, as torque."""
        near = (self.hertz >= 0.5 * hertz) & (self.hertz <= 2.0 * hertz)
        return (
            self.hertz[near],
            np.sqrt(np.mean(self.power[:, near], axis=0)),
            np.sqrt(np.mean(self.background()[:, near], axis=0)),
        )


def spectra_of(sought: Sought, signals: Sequence[Floats], *, falls: bool = False) -> Spectra:
    """Return Hann-windowed power of every stretch on twice as many bins as the longest resolves."""
    longest_s = 2.0 * max(seconds_of(p) for p in sought.pieces)
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
    return Spectra(hertz, power, falls)


def _nearby(values: Floats, reach: int, quantile: float) -> Floats:
    """Return a quantile over the bins within `reach`, every `_STRIDE` bins, and between, (f,)."""
    count = values.shape[0]
    around = np.pad(values, reach, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * reach + 1)[::_STRIDE]
    at = np.arange(0, count, _STRIDE)
    return np.interp(np.arange(count), at, np.quantile(windows, quantile, axis=-1))


def _fall(hertz: Floats, power: Floats) -> Floats:
    """Return white noise, flicker and what falls with the square of the frequency, shape (f,).

    As they come closest to the medians of windows that are as wide as their frequency is high: a
    line is in few of a window's bins.
    """
    from scipy.optimize import nnls

    place = np.floor(np.log(hertz / hertz[0]) / math.log(_RATIO)).astype(np.int64)
    windows = [place == k for k in range(int(place[-1]) + 1)]
    windows = [window for window in windows if np.count_nonzero(window) >= _FEWEST]
    if len(windows) < _TERMS:
        return np.zeros_like(power)
    at = np.array([math.exp(float(np.mean(np.log(hertz[window])))) for window in windows])
    medians = np.array([float(np.median(power[window])) / math.log(2.0) for window in windows])
    known = medians > 0.0
    weight = np.sqrt([np.count_nonzero(window) for window in windows])[known]
    found, _ = nnls(_laws(at[known]) * (weight / medians[known])[:, np.newaxis], weight)
    return np.asarray(_laws(hertz) @ found)


def _laws(hertz: Floats) -> Floats:
    return np.stack([hertz ** -float(power) for power in range(_TERMS)], axis=-1)
