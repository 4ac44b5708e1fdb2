"""From recordings to what the fit works on: filtered, thinned, and as spectra.

Torque, motion and every regressor pass one zero-phase low-pass, so that the torque balance holds
after it as before. Its cutoff is `noise`'s to say. What is left is oversampled and is thinned
without loss.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.direction import direction_of, near
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.sampling import find_stretches
from agent.physics.rigid_body import gravity_columns

Complexes = NDArray[np.complex128]

_THIN = 5.0  # samples kept in a period of the cutoff
_EDGE_PERIODS = 1.0  # of the cutoff: at its ends the filter sees its own extension
_SHORTEST_PERIODS = 20.0
_TAPS = 8  # of the interpolation that undoes a delay


@dataclass(frozen=True)
class Track:
    """One stretch of motion at its full rate, before the filter; arrays of shape (n,)."""

    name: str
    period_s: float
    torque_nm: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    position_rad: Floats | None
    gear_ratio: float


@dataclass(frozen=True)
class Prepared:
    """One stretch, filtered and thinned: all arrays of shape (n,) unless said.

    Parameters
    ----------
    period_s : float
        Between thinned samples.
    torque_nm : ndarray
        What the model explains.
    angles : ndarray, shape (2, full n)
        Sine and cosine of the arm's angle, filtered.
    spectrum, omega_rad_s : ndarray, shape (n // 2 + 1,)
        Of the acceleration.
    track : Track
        Where it comes from.
    cutoff_hz : float
        The filter that friction's columns have to pass, too.
    stride : int
        How many samples of the track one of these stands for.
    usable : ndarray of bool
        False about standstill and reversals, where no static law knows friction, and at the ends.
    direction : ndarray, shape (full n,)
        Sign of the track's velocity; between -1 and 1 in the very sample of a reversal.
    moving : ndarray of bool
        Like `usable`, but true about reversals that do not rest.
    reversal : ndarray of int, shape (r,)
        Samples of the track in which the motor turns back without a rest.
    blows : ndarray, shape (b, n)
        Torques of unknown size beside the model's: see `through_reversals`.
    """

    period_s: float
    torque_nm: Floats
    angles: Floats
    spectrum: Complexes
    omega_rad_s: Floats
    track: Track
    cutoff_hz: float
    stride: int
    usable: NDArray[np.bool_]
    direction: Floats
    moving: NDArray[np.bool_]
    reversal: NDArray[np.int64]
    blows: Floats

    @property
    def time_s(self) -> Floats:
        """Return the time from the stretch's beginning."""
        return np.asarray(np.arange(self.torque_nm.shape[0]) * self.period_s, dtype=np.float64)

    def through_reversals(self) -> Prepared:
        """Return the stretch with its reversals in.

        When exactly the motor turned back is known no better than the samples say: friction's jump
        of two Coulomb levels, half a millisecond late, leaves several times the torque's noise. In
        the samples of a reversal the torque is therefore left unknown, each of them a blow that
        passes the filter; all others count.
        """
        blows = np.zeros((self.reversal.shape[0], self.direction.shape[0]))
        blows[np.arange(self.reversal.shape[0]), self.reversal] = 1.0
        return replace(self, usable=self.moving, blows=self.thinned(self.filtered(blows)))

    def filtered(self, rows: Floats) -> Floats:
        """Return rows of the track's samples filtered, not thinned, shape (c, full n)."""
        return lowpass(rows, self.track.period_s, self.cutoff_hz)

    def thinned(self, rows: Floats, delay_s: float = 0.0) -> Floats:
        """Return filtered rows, shape (c, full n), as they were `delay_s` earlier, shape (c, n)."""
        return _earlier(rows, delay_s / self.track.period_s, self.stride)

    def through(self, response: Complexes, delay_s: float = 0.0) -> Floats:
        """Return the acceleration passed through a frequency response and delayed, shape (n,)."""
        late = response * np.exp(-1j * delay_s * self.omega_rad_s)
        out = np.fft.irfft(self.spectrum * late, n=self.torque_nm.shape[0])
        return np.asarray(out, dtype=np.float64)

    def passed(self, values: Floats, response: Complexes) -> Floats:
        """Return thinned values, shape (n,), passed through a frequency response."""
        out = np.fft.irfft(np.fft.rfft(values) * response, n=values.shape[0])
        return np.asarray(out, dtype=np.float64)


def _earlier(rows: Floats, samples: float, stride: int) -> Floats:
    """Return every `stride`-th sample of rows as they were a number of samples earlier.

    Lagrange's polynomial through the eight samples around that moment: exact to 1e-4 below a fifth
    of the sampling rate, where the low-pass ends.
    """
    whole = math.floor(samples)
    share = samples - whole
    nodes = np.arange(-(_TAPS // 2) + 1, _TAPS // 2 + 1)
    weights = [
        math.prod((share - m) / (k - m) for m in nodes.tolist() if m != k) for k in nodes.tolist()
    ]
    reach = abs(whole) + _TAPS
    wide = np.pad(rows, ((0, 0), (reach, reach)), mode="edge")
    n = rows.shape[1]
    out = np.zeros((rows.shape[0], -(-n // stride)))
    for k, weight in zip(nodes.tolist(), weights, strict=True):
        begin = reach - whole - k
        out += weight * wide[:, begin : begin + n : stride]
    return out


def tracks_of(signals: Signals) -> list[Track]:
    """Return a recording's stretches with velocity and acceleration.

    Where there is a position it is differentiated: a drive's own velocity has passed a filter,
    whose lag would be taken for damping.
    """
    out = []
    for stretch in find_stretches(signals).stretches:
        position: Floats | None = None
        if signals.position_rad is not None:
            position = stretch.on_grid(signals, signals.position_rad)
            velocity = np.asarray(np.gradient(position, stretch.period_s), dtype=np.float64)
            acceleration = _second(position, stretch.period_s)
        else:
            assert signals.velocity_rad_s is not None
            velocity = stretch.on_grid(signals, signals.velocity_rad_s)
            acceleration = np.asarray(np.gradient(velocity, stretch.period_s), dtype=np.float64)
        out.append(
            Track(
                signals.name,
                stretch.period_s,
                stretch.on_grid(signals, signals.torque_nm),
                velocity,
                acceleration,
                position,
                signals.gear_ratio,
            )
        )
    return out


def _second(values: Floats, period_s: float) -> Floats:
    """Return the second difference, its ends repeated."""
    inner = np.diff(values, n=2) / period_s**2
    return np.concatenate((inner[:1], inner, inner[-1:])).astype(np.float64)


def prepare(track: Track, cutoff_hz: float) -> Prepared | None:
    """Return a track filtered and thinned; None where it is too short for the filter."""
    n = track.torque_nm.shape[0]
    if n * track.period_s * cutoff_hz < _SHORTEST_PERIODS:
        return None
    direction, unsure, turned = direction_of(track.velocity_rad_s, track.period_s, cutoff_hz)
    stride = max(int(1.0 / (_THIN * cutoff_hz * track.period_s)), 1)
    angle = (
        np.zeros((2, n))
        if track.position_rad is None
        else gravity_columns(track.position_rad, track.gear_ratio).T
    )
    rows = np.vstack((track.torque_nm, track.acceleration_rad_s2, angle))
    full = lowpass(rows, track.period_s, cutoff_hz)
    torque, acceleration = full[:2, ::stride]
    period_s = stride * track.period_s
    omega = 2.0 * np.pi * np.fft.rfftfreq(acceleration.shape[0], period_s).astype(np.float64)
    edge = int(np.ceil(_EDGE_PERIODS / (cutoff_hz * period_s)))
    usable, moving = (
        ~near(rests, track.period_s, cutoff_hz)[::stride] for rests in (unsure, unsure & ~turned)
    )
    usable[:edge] = usable[-edge:] = moving[:edge] = moving[-edge:] = False
    return Prepared(
        period_s,
        torque,
        full[2:],
        np.fft.rfft(acceleration) * _undone(track, omega),
        omega,
        track,
        cutoff_hz,
        stride,
        usable,
        direction,
        moving,
        np.flatnonzero(turned),
        np.zeros((0, torque.shape[0])),
    )


def _undone(track: Track, omega_rad_s: Floats) -> Floats:
    """Return what the differences that made the acceleration have to be multiplied with.

    The second difference of a position damps a frequency by ``(sin(wT/2)/(wT/2))^2``, the central
    difference of a velocity by ``sin(wT)/(wT)``: 1 % at an eighteenth of the sampling rate.
    """
    turn = omega_rad_s * track.period_s / np.pi
    if track.position_rad is not None:
        return np.asarray(np.sinc(0.5 * turn) ** -2, dtype=np.float64)
    return np.asarray(1.0 / np.sinc(np.minimum(turn, 0.9)), dtype=np.float64)
