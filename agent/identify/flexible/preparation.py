"""From recordings to what the fit works on: filtered, thinned, and as spectra.

Torque, motion and every regressor pass one zero-phase low-pass, so that the torque balance holds
after it as before. Its cutoff stays below where noise of the measured position would pass for
acceleration. What is left is oversampled and is thinned without loss.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.lowpass import lowpass
from agent.identify.result import Floats
from agent.identify.sampling import find_stretches
from agent.identify.signals import Signals
from agent.physics.rigid_body import gravity_columns

Complexes = NDArray[np.complex128]

_NOISE_SHARE = 0.001  # of the acceleration's energy: biases the motor's inertia low by as much
_HIGHEST = 0.2  # cutoff, of the sampling rate
_THIN = 5.0  # samples kept in a period of the cutoff
_SIGN_SIGMAS = 4.0
_REVERSAL_PERIODS = 1.0  # of the cutoff, to either side of a reversal or standstill
_EDGE_PERIODS = 1.0  # of the cutoff: at its ends the filter sees its own extension
_SHORTEST_PERIODS = 20.0


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
    torque_rates : ndarray, shape (3, n)
        Its first three derivatives in time, by which a delay of the torque is undone.
    linear : ndarray, shape (n, 4)
        Columns that no parameter bends: acceleration, gravity's sine and cosine, and the constant.
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
    """

    period_s: float
    torque_nm: Floats
    torque_rates: Floats
    linear: Floats
    spectrum: Complexes
    omega_rad_s: Floats
    track: Track
    cutoff_hz: float
    stride: int
    usable: NDArray[np.bool_]
    direction: Floats

    @property
    def time_s(self) -> Floats:
        """Return the time from the stretch's beginning."""
        return np.asarray(np.arange(self.torque_nm.shape[0]) * self.period_s, dtype=np.float64)

    def filtered(self, rows: Floats) -> Floats:
        """Return rows of the track's samples, shape (c, full n), filtered and thinned, (c, n)."""
        return lowpass(rows, self.track.period_s, self.cutoff_hz)[..., :: self.stride]

    def through(self, response: Complexes) -> Floats:
        """Return the acceleration passed through a frequency response, shape (n,)."""
        out = np.fft.irfft(self.spectrum * response, n=self.torque_nm.shape[0])
        return np.asarray(out, dtype=np.float64)


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


def quietest_cutoff_hz(tracks: Sequence[Track]) -> float:
    """Return up to where the measured acceleration is motion and not noise.

    Noise of the measured channel is white in the position (or the velocity), and its level is
    read in the upper half of the band. The cutoff is the highest frequency up to which it makes
    less than 0.1 % of the acceleration's energy, and at most a fifth of the sampling rate.
    """
    lowest = min(_HIGHEST / track.period_s for track in tracks)
    for track in tracks:
        n = track.acceleration_rad_s2.shape[0]
        window = np.hanning(n + 2)[1:-1]
        power = np.abs(np.fft.rfft(track.acceleration_rad_s2 * window)) ** 2
        frequency = np.fft.rfftfreq(n, track.period_s)
        order = 2 if track.position_rad is not None else 1
        turn = 2.0 * np.pi * frequency * track.period_s
        shape = (2.0 - 2.0 * np.cos(turn)) ** 2 if order == 2 else np.sin(turn) ** 2
        upper = slice(n // 4, int(0.475 * n))
        ratio = power[upper] / np.maximum(shape[upper], 1e-9)
        level = float(np.median(ratio)) / np.log(2.0) if ratio.size else 0.0
        noise = np.cumsum(level * shape)
        quiet = noise <= _NOISE_SHARE * max(float(power.sum() - noise[-1]), 0.0)
        quiet[0] = True
        lowest = min(lowest, float(frequency[np.flatnonzero(quiet)[-1]]))
    return lowest


def prepare(track: Track, cutoff_hz: float) -> Prepared | None:
    """Return a track filtered and thinned; None where it is too short for the filter."""
    n = track.torque_nm.shape[0]
    if n * track.period_s * cutoff_hz < _SHORTEST_PERIODS:
        return None
    direction, unsure = _direction(track, cutoff_hz)
    stride = max(int(1.0 / (_THIN * cutoff_hz * track.period_s)), 1)
    angle = (
        np.zeros((2, n))
        if track.position_rad is None
        else gravity_columns(track.position_rad, track.gear_ratio).T
    )
    rows = np.vstack((track.torque_nm, track.acceleration_rad_s2, angle))
    full = lowpass(rows, track.period_s, cutoff_hz)
    rates = [full[0]]
    for _ in range(3):
        rates.append(np.gradient(rates[-1], track.period_s))
    torque, acceleration, sine, cosine = full[:, ::stride]
    period_s = stride * track.period_s
    omega = 2.0 * np.pi * np.fft.rfftfreq(acceleration.shape[0], period_s).astype(np.float64)
    spectrum = np.fft.rfft(acceleration) * _undone(track, omega)
    acceleration = np.fft.irfft(spectrum, n=acceleration.shape[0])
    edge = int(np.ceil(_EDGE_PERIODS / (cutoff_hz * period_s)))
    usable = ~unsure[::stride]
    usable[:edge] = usable[-edge:] = False
    return Prepared(
        period_s,
        torque,
        np.stack([r[::stride] for r in rates[1:]]),
        np.stack((acceleration, sine, cosine, np.ones_like(sine)), axis=-1),
        spectrum,
        omega,
        track,
        cutoff_hz,
        stride,
        usable,
        direction,
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


def _direction(track: Track, cutoff_hz: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the mean sign of the velocity over every sample, and near what it is not sure."""
    raw = track.velocity_rad_s
    noise = float(np.median(np.abs(raw - lowpass(raw, track.period_s, _HIGHEST / track.period_s))))
    noise /= 0.6745 * math.sqrt(1.0 - 2.0 * _HIGHEST)
    fastest = float(np.max(np.abs(raw), initial=0.0))
    # At a reversal friction jumps and the velocity has a kink, which every filter moves in time:
    # none is used where the velocity is clean against what it changes by from sample to sample.
    if _SIGN_SIGMAS * noise <= float(np.quantile(np.abs(np.diff(raw)), 0.75)):
        smooth, threshold = raw, max(_SIGN_SIGMAS * noise, 1e-5 * fastest)
    else:
        smooth = lowpass(raw, track.period_s, 2.0 * cutoff_hz)
        passed = math.sqrt(min(4.0 * cutoff_hz * track.period_s, 1.0))
        threshold = max(_SIGN_SIGMAS * noise * passed, 1e-5 * fastest)
    unsure = np.abs(smooth) <= threshold
    unsure[1:] |= smooth[1:] * smooth[:-1] <= 0.0
    # What a wrong moment of a reversal leaves, the filter spreads over its own memory.
    reach = max(int(_REVERSAL_PERIODS / (cutoff_hz * track.period_s)), 1)
    near = np.convolve(unsure, np.ones(2 * reach + 1), mode="same") > 0.5
    # The mean sign over a sample's period keeps a crossing's time finer than the samples do.
    slope = np.maximum(np.abs(np.gradient(smooth)), 1e-12 * fastest + 1e-300)
    return np.clip(2.0 * smooth / slope, -1.0, 1.0), near
