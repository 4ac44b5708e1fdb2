"""Which way the motor goes, and where nobody knows: at rest, and in the samples of a reversal."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass

HIGHEST = 0.2
"""Cutoff of a low-pass as a share of the sampling rate, at most."""

_SIGN_SIGMAS = 4.0
_BRIEF = 6  # samples: a reversal that takes longer is a rest
_REVERSAL_PERIODS = 2.0  # of the cutoff, to either side of a reversal or standstill


def direction_of(
    raw: Floats, period_s: float, cutoff_hz: float
) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the direction of motion in every sample, and where nobody knows it.

    Parameters
    ----------
    raw : ndarray, shape (n,)
        Measured velocity, rad/s.
    period_s : float
        Time between its samples.
    cutoff_hz : float
        Where the fit's band ends.

    Returns
    -------
    direction : ndarray, shape (n,)
        Mean sign of the velocity over the sample.
    unsure : ndarray of bool, shape (n,)
        Where it is not known: at rest and in the samples of a reversal.
    turned : ndarray of bool, shape (n,)
        Those of the unsure samples in which the motor turns back without a rest.
    """
    noise = float(np.median(np.abs(raw - lowpass(raw, period_s, HIGHEST / period_s))))
    noise /= 0.6745 * math.sqrt(1.0 - 2.0 * HIGHEST)
    fastest = float(np.max(np.abs(raw), initial=0.0))
    # At a reversal friction jumps and the velocity has a kink, which every filter moves in time:
    # none is used where the velocity is clean against what it changes by from sample to sample.
    if _SIGN_SIGMAS * noise <= float(np.quantile(np.abs(np.diff(raw)), 0.75)):
        smooth, threshold = raw, max(_SIGN_SIGMAS * noise, 1e-5 * fastest)
    else:
        smooth = lowpass(raw, period_s, 2.0 * cutoff_hz)
        passed = math.sqrt(min(4.0 * cutoff_hz * period_s, 1.0))
        threshold = max(_SIGN_SIGMAS * noise * passed, 1e-5 * fastest)
    unsure = np.abs(smooth) <= threshold
    crossed = smooth[1:] * smooth[:-1] <= 0.0
    unsure[1:] |= crossed
    unsure[:-1] |= crossed
    # The mean sign over a sample's period keeps a crossing's time finer than the samples do.
    slope = np.maximum(np.abs(np.gradient(smooth)), 1e-12 * fastest + 1e-300)
    return np.clip(2.0 * smooth / slope, -1.0, 1.0), unsure, _turned(unsure, smooth)


def _turned(unsure: NDArray[np.bool_], velocity: Floats) -> NDArray[np.bool_]:
    """Return which of the unsure samples are those of a reversal without a rest."""
    out = np.zeros_like(unsure)
    edges = np.flatnonzero(np.diff(unsure.astype(np.int8), prepend=0, append=0))
    for begin, end in edges.reshape(-1, 2).tolist():
        inside = begin > 0 and end < unsure.shape[0]
        if inside and end - begin <= _BRIEF and velocity[begin - 1] * velocity[end] < 0.0:
            out[begin:end] = True
    return out


def near(unsure: NDArray[np.bool_], period_s: float, cutoff_hz: float) -> NDArray[np.bool_]:
    """Return the samples over which the filter spreads what unsure ones leave."""
    reach = max(int(_REVERSAL_PERIODS / (cutoff_hz * period_s)), 1)
    return np.asarray(np.convolve(unsure, np.ones(2 * reach + 1), mode="same") > 0.5)
