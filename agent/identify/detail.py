"""What pictures need beside the numbers: filtered arrays on the recording's own samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats, RigidBodyFit
from agent.identify.rigid.body import weights
from agent.identify.signals.preprocess import Motion, filter_motion
from agent.identify.signals.windows import SteadyWindow


@dataclass(frozen=True)
class RecordingDetail:
    """What a picture of one recording needs, on the recording's own n samples.

    Parameters
    ----------
    windows : tuple of SteadyWindow
        The steady windows that were found.
    velocity_rad_s : ndarray, shape (n,)
        The velocity that was worked with, low-passed; NaN where a sample is in no stretch.
    torque_nm, torque_predicted_nm : ndarray, shape (n,)
        Measured torque, low-passed, and what the rigid body predicts for it; NaN likewise.
    compared : ndarray of bool, shape (n,)
        The samples over which the two are compared.
    """

    windows: tuple[SteadyWindow, ...]
    velocity_rad_s: Floats
    torque_nm: Floats
    torque_predicted_nm: Floats | None
    compared: NDArray[np.bool_]


def detail_of(
    motion: Motion,
    windows: Sequence[SteadyWindow],
    cutoff_hz: float | None,
    body: RigidBodyFit | None,
) -> RecordingDetail:
    """Bring the filtered arrays back onto the recording's own samples."""
    signals = motion.signals
    shape = signals.time_s.shape
    velocity, torque = motion.own_velocity_rad_s(), np.full(shape, np.nan)
    predicted = None if body is None else np.full(shape, np.nan)
    compared = np.zeros(shape, dtype=np.bool_)
    for s in motion.timing.stretches:
        torque[s.index] = signals.torque_nm[s.index]
    for f in filter_motion(motion, cutoff_hz) if cutoff_hz is not None else ():
        index, stretch = f.stretch.index, f.stretch
        velocity[index] = stretch.off_grid(signals, f.velocity_rad_s)
        torque[index] = stretch.off_grid(signals, f.torque_nm)
        compared[index] = stretch.off_grid(signals, f.usable.astype(np.float64)) > 0.5
        if predicted is not None and body is not None:
            predicted[index] = stretch.off_grid(signals, f.regressor @ weights(body))
    return RecordingDetail(tuple(windows), velocity, torque, predicted, compared)
