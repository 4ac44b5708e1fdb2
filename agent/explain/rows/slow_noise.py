"""Whether what is left is noise that is slow in part, and no slower than its fast part foretells.

Current sensors and amplifiers flicker: their noise has as much power in every octave, down to the
length of the recording (van der Ziel, Adv. Electron. Electron Phys. 49 (1979) 225). The floor is
measured within half a second, and so holds half of the octaves at best. What is left is then up to
1.3 times the floor, follows nothing that was recorded, and is no missing physics.

Within half a second flicker shows by its slope. White noise and flicker, ``a + b/f``, are fitted to
the spectrum there, and foretell by how much the means of half seconds differ that lie one to
sixteen seconds apart. Torque that somebody forgot is smooth, or stands in steps: its fast part
foretells far less of it than there is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.floor import steady_windows
from agent.explain.rows.half_seconds import MEAN_S, half_seconds
from agent.explain.rows.pieces import Piece
from agent.explain.rows.table import Table
from agent.explain.rows.unrepeated import has_the_shape_of_noise
from agent.identify.result import Floats

_FIRST = 3  # of a window's cosines: those before it are a trend's as well
_OF_BAND = 0.8  # of the filter's cutoff, up to where it lets pass all
_FEWEST = 200  # powers in the windows: fewer do not tell a slope
_APART = (1, 2, 4, 8, 16, 32)  # means
_FEWEST_PAIRS = 20
_SLACK = 0.1  # of what is foretold
_SURELY = 2.0  # standard errors of a mean square
_SLOWEST_HZ, _FASTEST_HZ, _STEPS = 1e-3, 25.0, 2000
_LOWEST_CORNER_HZ = 0.32  # 1/(2 pi 0.5 s)
_STARTS = ((0.0, -5.0), (-2.0, 0.0), (-5.0, 1.0))  # logarithms of white noise and flicker


@dataclass(frozen=True)
class _Spectrum:
    """White noise and slow one, N²m²/Hz, one-sided: ``white + slow/f``, or with a corner.

    With a corner, Hz, it is ``white + slow/(f² + corner²)``: noise that forgets itself within
    1/(2 pi corner), and may forget no later than half a second.
    """

    white: float
    slow: float
    corner_hz: float = 0.0

    def density(self, frequency_hz: Floats) -> Floats:
        """Return the power density, shape (k,)."""
        if not self.corner_hz:
            return np.asarray(self.white + self.slow / frequency_hz)
        return np.asarray(self.white + self.slow / (frequency_hz**2 + self.corner_hz**2))

    def difference_nm2(self, apart_s: float) -> float:
        """Return half the mean square by which means differ that begin so far apart."""
        f = np.geomspace(_SLOWEST_HZ, _FASTEST_HZ, _STEPS)
        mean = np.sinc(f * MEAN_S) ** 2 * (1.0 - np.cos(2.0 * np.pi * f * apart_s))
        return float(np.trapezoid(self.density(f) * mean, f))


def is_foretold_by_its_fast_part(table: Table, rows: NDArray[np.int64], left_nm: Floats) -> bool:
    """Return whether what is left is no slower than noise whose fast part is like its own.

    Parameters
    ----------
    table : Table
    rows : ndarray of int, shape (m,)
        Of the table.
    left_nm : ndarray, shape (m,)
        What a model leaves there.
    """
    left = np.full(table.used.shape[0], np.nan)
    left[rows] = left_nm
    frequency_hz, power = _within_windows(table, left)
    if power.shape[0] < _FEWEST:
        return False
    spectrum = _fitted(frequency_hz, power)
    if spectrum.corner_hz and not has_the_shape_of_noise(table, left):
        return False
    asked = False
    for means in _APART:
        squares = np.concatenate([_squares(left[p.rows], p, means) for p in table.pieces])
        if squares.shape[0] < _FEWEST_PAIRS:
            continue
        asked = True
        independent = squares.shape[0] / means
        most = 1.0 + _SLACK + _SURELY * math.sqrt(2.0 / independent)
        foretold = spectrum.difference_nm2(means * MEAN_S)
        if 0.5 * float(np.mean(squares)) > most * foretold:
            return False
    return asked


def _within_windows(table: Table, left: Floats) -> tuple[Floats, Floats]:
    """Return frequencies and power densities of the cosines of all windows, each shape (k,)."""
    from scipy.fft import dct

    frequencies: list[Floats] = [np.zeros(0)]
    powers: list[Floats] = [np.zeros(0)]
    pieces = iter(table.pieces)
    piece = next(pieces)
    for window, _ in steady_windows(table):
        while window.start >= piece.rows.stop:
            piece = next(pieces)
        own = left[window]
        if not np.isfinite(own).all():
            continue
        step_s, count = piece.period_s * piece.stride, own.shape[0]
        frequency = np.arange(count) / (2.0 * count * step_s)
        told = (np.arange(count) >= _FIRST) & (frequency <= _OF_BAND * piece.cutoff_hz)
        frequencies.append(frequency[told])
        powers.append(2.0 * step_s * dct(own, norm="ortho")[told] ** 2)
    return np.concatenate(frequencies), np.concatenate(powers)


def _fitted(frequency_hz: Floats, power: Floats) -> _Spectrum:
    """Return white noise and flicker, or with a corner, of the greatest likelihood (Whittle)."""
    from scipy.optimize import minimize

    scale = max(float(power.mean()), 1e-300)
    told = power / scale

    def spectrum(x: Floats) -> _Spectrum:
        corner_hz = 0.0 if x.shape[0] == 2 else _LOWEST_CORNER_HZ + math.exp(min(x[2], 5.0))
        return _Spectrum(math.exp(x[0]), math.exp(x[1]), corner_hz)

    def unlikely(x: Floats) -> float:
        expected = spectrum(x).density(frequency_hz)
        return float(np.sum(np.log(expected) + told / expected))

    starts = (*_STARTS, *((*start, 0.0) for start in _STARTS))
    found = [minimize(unlikely, start, method="Nelder-Mead") for start in starts]
    best = spectrum(min(found, key=lambda one: float(one.fun)).x)
    return replace(best, white=scale * best.white, slow=scale * best.slow)


def _squares(left: Floats, piece: Piece, apart: int) -> Floats:
    """Return the squared differences of a stretch's means of half a second, so many apart."""
    means = half_seconds(left, piece)
    difference = means[apart:] - means[:-apart]
    return np.asarray(difference[np.isfinite(difference)] ** 2)
