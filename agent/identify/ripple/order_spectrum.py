"""Torque over motor angle as a spectrum of orders, each with its local, coloured background.

An *order* is a number of periods per motor turn, whole or not. A pass at constant velocity is
averaged over equal steps of angle and transformed; the noise at an order is that of its neighbours
(`background`), so that colour of any shape sets its own threshold.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats
from agent.identify.ripple.background import background
from agent.physics.periodic import wave

_OVERSAMPLING = 8  # grid points between two orders that a pass can tell apart
_STEPS_PER_PERIOD = 4  # of the highest order
_TAKEN = 0.75  # of the distance of two orders: so near to one that is out, noise is out with it
_LEAST_HEAD = 8  # samples
_LOUDER = 2.5  # times what is left in the rest of the pass: a head that has not settled
_LEANS = 6.0  # times the scatter of parts as long, or 3 deviations: the trend is drawn out, too
_MOST_SAMPLES, _SAMPLES_PER_TURN = 2048, 128
TREND = 3  # level, slope and bow of torque along a pass: gravity, cables, warming


@dataclass(frozen=True)
class AnglePass:
    """The samples of one pass at constant velocity.

    Parameters
    ----------
    angle_rad : ndarray, shape (n,)
        Motor angle.
    signal : ndarray, shape (n,)
        What is looked at over it: torque in N m, or the position's stutter in rad.
    velocity_rad_s : float
        Mean velocity.
    absolute : bool
        Whether the angle was recorded; an integrated one starts at an unknown angle.
    name : str
        Of its recording.
    stutter_rad : ndarray, shape (n,), optional
        Recorded angle less its straight line over time.
    whole : AnglePass, optional
        The same pass with its first tenth, where the torque may not have settled.
    averaged : int
        How many neighbouring samples each of these is the mean of.
    """

    angle_rad: Floats
    signal: Floats
    velocity_rad_s: float
    absolute: bool
    name: str
    stutter_rad: Floats | None = None
    whole: AnglePass | None = None
    averaged: int = 1

    @property
    def turns(self) -> float:
        """Return how many motor turns it covers."""
        return float(np.ptp(self.angle_rad)) / (2.0 * math.pi)

    @property
    def step_rad(self) -> float:
        """Return the mean angle between samples."""
        return float(np.ptp(self.angle_rad)) / max(self.angle_rad.size - 1, 1)

    def compact(self) -> AnglePass:
        """Return the pass with neighbours averaged, where it has far more samples than needed."""
        block = self.angle_rad.size // int(max(_MOST_SAMPLES, _SAMPLES_PER_TURN * self.turns))
        return self if block < 2 else self.in_blocks(block)

    def in_blocks(self, block: int) -> AnglePass:
        """Return the means of so many samples each; what is left over is at the beginning."""
        count = self.angle_rad.size // block * block

        def averaged(x: Floats) -> Floats:
            return np.asarray(x[x.size - count :].reshape(-1, block).mean(axis=1))

        return replace(
            self,
            angle_rad=averaged(self.angle_rad),
            signal=averaged(self.signal),
            stutter_rad=None if self.stutter_rad is None else averaged(self.stutter_rad),
            whole=None if self.whole is None else self.whole.in_blocks(block),
            averaged=block * self.averaged,
        )

    def left(self, order: Floats | float) -> Floats:
        """Return how much of a wave of these orders is left in the means of neighbours.

        ``sin(m k d/2) / (m sin(k d/2))`` of m samples that are an angle d apart (Dirichlet's
        kernel): at four means a period a tenth is lost.
        """
        half = 0.5 * np.asarray(order, dtype=np.float64) * self.step_rad / self.averaged
        return np.asarray(np.sinc(self.averaged * half / np.pi) / np.sinc(half / np.pi))

    def settled(self, orders: Sequence[float]) -> AnglePass:
        """Return the whole pass where trend and orders of the rest carry its head, too; else this.

        What is left in the head must be no more than what is left in the rest, and must not lean
        to one side: a torque that still settles does.
        """
        if self.whole is None:
            return self
        head = self.whole.angle_rad.size - self.angle_rad.size
        if head < _LEAST_HEAD:
            return self
        columns = self.columns(orders)
        theta, *_ = np.linalg.lstsq(columns, self.signal, rcond=None)
        rest = self.signal - columns @ theta
        ahead = self.columns(orders, self.whole.angle_rad[:head])
        beyond = self.whole.signal[:head] - ahead @ theta
        blocks = rest[: rest.size // head * head].reshape(-1, head)
        scatter = float(np.sqrt(np.mean(np.mean(blocks, axis=1) ** 2)))
        calm = float(np.mean(beyond**2)) < _LOUDER * float(np.mean(rest**2))
        return self.whole if calm and abs(float(np.mean(beyond))) < _LEANS * scatter else self

    def of_motion(self) -> AnglePass | None:
        """Return the stutter over the angle that a steady motion would have; None without one.

        Over the angle itself a stutter of some periods' size would bend its own sine.
        """
        if self.stutter_rad is None:
            return None
        return replace(self, angle_rad=self.angle_rad - self.stutter_rad, signal=self.stutter_rad)

    def columns(self, orders: Sequence[float], angle_rad: Floats | None = None) -> Floats:
        """Return trend, then cosine and sine of every order, shape (n, 3 + 2 m).

        They are this pass's, at its own angles or at others.
        """
        at = self.angle_rad if angle_rad is None else angle_rad
        middle = 0.5 * (self.angle_rad.min() + self.angle_rad.max())
        x = (at - middle) / max(0.5 * float(np.ptp(self.angle_rad)), 1e-300)
        out = np.empty((x.size, TREND + 2 * len(orders)))
        out[:, :TREND] = np.stack((np.ones_like(x), x, x * x - 1.0 / 3.0), axis=-1)
        for i, order in enumerate(orders):
            left = float(self.left(order))
            out[:, TREND + 2 * i] = wave(left, 0.0, order, at)
            out[:, TREND + 2 * i + 1] = wave(0.0, left, order, at)
        return out

    def without(self, orders: Sequence[float]) -> tuple[AnglePass, Floats]:
        """Return the pass less its trend and these orders, and their (cos, sin), shape (m, 2)."""
        columns = self.columns(orders)
        basis, upper = np.linalg.qr(columns)
        share = basis.T @ self.signal
        theta = np.linalg.solve(upper, share)
        rest = replace(self, signal=self.signal - basis @ share)
        return rest, np.asarray(theta[TREND:], dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True)
class Spectrum:
    """Complex amplitudes of several passes on one grid of orders.

    Parameters
    ----------
    order : ndarray, shape (k,)
        Periods per motor turn.
    amplitude : ndarray of complex, shape (p, k)
        ``a - i b`` of ``a cos(order q) + b sin(order q)`` in each of p passes.
    variance : ndarray, shape (p, k)
        Of a and of b, from the background.
    """

    order: Floats
    amplitude: np.ndarray[tuple[int, int], np.dtype[np.complex128]]
    variance: Floats


@dataclass(frozen=True)
class Grid:
    """Which orders are looked at: steps of angle, length of the transform, lowest and highest.

    `apart` is the distance at which every pass can tell two orders from each other.
    """

    step_rad: float
    length: int
    lowest: float
    highest: float
    apart: float

    @property
    def independent(self) -> float:
        """Return how many orders the longest pass tells apart in this range."""
        return max(1.0, (self.highest - self.lowest) * self.length * self.step_rad / self._padding)

    @property
    def _padding(self) -> float:
        return 2.0 * math.pi * _OVERSAMPLING


def grid_for(passes: Sequence[AnglePass], highest: float | None) -> Grid:
    """Return the grid that all passes share.

    The lowest order has two periods in the shortest pass, the highest four samples a period in the
    coarsest, or what the caller asks for.
    """
    step = max(p.step_rad for p in passes)
    limit = 2.0 * math.pi / (_STEPS_PER_PERIOD * step)
    top = limit if highest is None else min(limit, highest)
    step = 2.0 * math.pi / (_STEPS_PER_PERIOD * top)
    turns = max(p.turns for p in passes)
    shortest = min(p.turns for p in passes)
    length = math.ceil(_OVERSAMPLING * 2.0 * math.pi * turns / step)
    return Grid(step, length, 2.0 / shortest, top, 1.0 / shortest)


def spectrum_of(passes: Sequence[AnglePass], grid: Grid, orders: Sequence[float] = ()) -> Spectrum:
    """Return the spectra of what trend and these orders leave of the passes."""
    step = 2.0 * math.pi / (grid.length * grid.step_rad)
    k = np.arange(grid.length // 2, dtype=np.float64) * step
    kept = (k >= grid.lowest) & (k <= grid.highest)
    order = np.asarray(k[kept])
    away = np.abs(order - np.array(orders)[:, np.newaxis]).min(axis=0, initial=math.inf)
    longest = max(p.turns for p in passes)
    amplitudes, variances = [], []
    for p in passes:
        even, start = _evenly(p.without(orders)[0], grid.step_rad)
        transform = np.fft.rfft(even, grid.length)[: k.size] * (2.0 / even.size)
        left = p.left(order)
        amplitudes.append((transform * np.exp(-1j * k * start))[kept] / left)
        per_order = round(max(_OVERSAMPLING * longest / p.turns, 1.0))
        power = np.abs(transform[kept]) ** 2
        noise = background(power, order, per_order, away < _TAKEN / p.turns)
        variances.append(0.5 * noise / left**2)
    variance = np.asarray(np.stack(variances), dtype=np.float64)
    return Spectrum(order, np.stack(amplitudes), variance)


def _evenly(p: AnglePass, step_rad: float) -> tuple[Floats, float]:
    """Return the mean torque in equal steps of angle, and the first step's centre."""
    first = float(p.angle_rad.min())
    bins = ((p.angle_rad - first) / step_rad).astype(np.int64)
    count = np.bincount(bins)
    total = np.bincount(bins, weights=p.signal)
    at = np.flatnonzero(count)
    means = np.interp(np.arange(count.size), at, total[at] / count[at])
    return np.asarray(means - means.mean(), dtype=np.float64), first + 0.5 * step_rad
