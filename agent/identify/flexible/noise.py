"""How loud motion and torque are measured, and up to which cutoff the motion is more than noise."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.identify.flexible.direction import HIGHEST
from agent.identify.flexible.preparation import Track
from agent.identify.result import Floats

_NOISE_SHARE = 0.001  # of the acceleration's energy: biases the motor's inertia low by as much


def quietest_cutoff_hz(tracks: Sequence[Track]) -> float:
    """Return up to where the measured acceleration is motion and not noise.

    The highest frequency up to which noise of the measured channel makes less than 0.1 % of the
    acceleration's energy, and at most a fifth of the sampling rate.
    """
    lowest = min(HIGHEST / track.period_s for track in tracks)
    for track in tracks:
        frequency, power, shape = _acceleration_spectrum(track)
        noise = np.cumsum(_floor(power, shape) * shape)
        quiet = noise <= _NOISE_SHARE * max(float(power.sum() - noise[-1]), 0.0)
        quiet[0] = True
        lowest = min(lowest, float(frequency[np.flatnonzero(quiet)[-1]]))
    return lowest


def even_cutoff_hz(tracks: Sequence[Track], inertia_kg_m2: float) -> float:
    """Return where noise of the motion, as torque on an inertia, is as strong as the torque's own.

    Above it the acceleration adds more noise to what is left than it tells of the motor's inertia.

    Parameters
    ----------
    tracks : sequence of Track
    inertia_kg_m2 : float
        What moves at high frequency: the motor's.
    """
    lowest = math.inf
    for track in tracks:
        torque = torque_noise_nm(track)
        motion = inertia_kg_m2 * motion_noise(track)
        if motion > 0.0:
            order = motion_order(track)
            lowest = min(lowest, (torque / motion) ** (1.0 / order) / (2.0 * math.pi))
    return lowest


def motion_order(track: Track) -> int:
    """Return how often the measured channel is differentiated: 2 for a position, 1 for a speed."""
    return 1 if track.position_rad is None else 2


def motion_noise(track: Track) -> float:
    """Return the standard deviation of white noise in the measured channel, rad or rad/s.

    Its level is read in the upper half of the band, where nothing moves.
    """
    _, power, shape = _acceleration_spectrum(track)
    window = _window(track.acceleration_rad_s2.shape[0])
    level = _floor(power, shape) / float(window @ window)
    return math.sqrt(level) * track.period_s ** motion_order(track)


def torque_noise_nm(track: Track) -> float:
    """Return the standard deviation of white noise in the torque, read as `motion_noise` is."""
    window = _window(track.torque_nm.shape[0])
    power = np.abs(np.fft.rfft(track.torque_nm * window)) ** 2
    return math.sqrt(_floor(power, np.ones_like(power)) / float(window @ window))


def _acceleration_spectrum(track: Track) -> tuple[Floats, Floats, Floats]:
    """Return frequency, energy of the acceleration, and the shape of white channel noise in it."""
    n = track.acceleration_rad_s2.shape[0]
    power = np.abs(np.fft.rfft(track.acceleration_rad_s2 * _window(n))) ** 2
    frequency = np.fft.rfftfreq(n, track.period_s).astype(np.float64)
    turn = 2.0 * np.pi * frequency * track.period_s
    shape = (2.0 - 2.0 * np.cos(turn)) ** 2 if motion_order(track) == 2 else np.sin(turn) ** 2
    return frequency, np.asarray(power, dtype=np.float64), np.asarray(shape, dtype=np.float64)


def _window(samples: int) -> Floats:
    return np.asarray(np.hanning(samples + 2)[1:-1], dtype=np.float64)


def _floor(power: Floats, shape: Floats) -> float:
    """Return the level of noise of a known spectral shape, from the upper half of the band.

    The mean of an exponentially distributed power is its median over log 2, and the median does
    not see a line in the band.
    """
    half = power.shape[0] // 2
    upper = slice(half, int(0.95 * power.shape[0]))
    ratio = power[upper] / np.maximum(shape[upper], 1e-9)
    return float(np.median(ratio)) / math.log(2.0) if ratio.size else 0.0
