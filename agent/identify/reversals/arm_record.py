"""What a simulated arm is held against: both encoders and the torque, with what counts of them."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.reversals.smoothing import resolution, swings, white_noise
from agent.identify.reversals.turns import Track
from agent.identify.signals.lowpass import lowpass

_DRIVE = 0.15  # of the sampling rate: cutoff of the motion that first drives the arm
_WAY = 0.4  # of that cutoff: of the motion whose direction dry friction has
_ABOUT = 8  # samples to either side within which a motor that stands would have moved
_STANDS = 6.0  # encoder's steps
_NOISY = 20.0  # standard errors of an encoder without steps
_ENDS = 10  # samples that a derivative does not reach
_FINEST = 1e-3  # of the torque: no sensor reads it finer


@dataclass(frozen=True)
class ArmRecord:
    """One track with the arm's encoder; arrays of shape (n,), motor side.

    Parameters
    ----------
    period_s : float
        Time between samples.
    motor_rad, arm_rad, torque_nm : ndarray
        As recorded; the arm's angle times the gear ratio.
    smooth_rad : ndarray
        Motor's angle behind a low-pass.
    way : ndarray
        Direction in which the motor turns, -1, 0 or 1.
    slides : ndarray of bool
        Where the motor moves, so that its dry friction is known.
    swings : ndarray of bool
        Where it does not keep a steady speed, so that its acceleration is more than its encoder's
        error.
    turn : ndarray of int
        Number of the nearest reversal.
    places : tuple of int
        Sample at which each of its reversals happens.
    motor_error_rad, arm_error_rad, torque_error_nm : float
        Standard deviations of a sample.
    arm_step_rad : float
        An arm that moves less than half of it in a sample reads one step over and over.
    hardest_rad_s2 : float
        The motor's largest acceleration.
    """

    period_s: float
    motor_rad: Floats
    arm_rad: Floats
    torque_nm: Floats
    smooth_rad: Floats
    way: Floats
    slides: NDArray[np.bool_]
    swings: NDArray[np.bool_]
    turn: NDArray[np.intp]
    places: tuple[int, ...]
    motor_error_rad: float
    arm_error_rad: float
    torque_error_nm: float
    arm_step_rad: float
    hardest_rad_s2: float

    @property
    def size(self) -> int:
        """Return the number of samples."""
        return int(self.motor_rad.size)

    def read(self, rate_rad_s: Floats) -> NDArray[np.bool_]:
        """Tell which samples of an arm with these velocities are worth reading, shape (n,)."""
        moves = np.abs(rate_rad_s) * self.period_s > 0.5 * self.arm_step_rad
        moves[:_ENDS] = moves[-_ENDS:] = False
        return np.asarray(moves)


def record_of(track: Track, first_turn: int) -> ArmRecord | None:
    """Return a track as it is simulated; None without turns, or without noise to weigh it by."""
    if track.lead_rad is None or not track.turns:
        return None
    motor, arm = track.measured_rad, track.measured_rad - track.lead_rad
    step, error = resolution(motor)
    arm_step, arm_error = resolution(arm)
    finest = _FINEST * float(np.std(track.torque_nm))
    if min(error, arm_error, finest) <= 0.0:
        return None
    rate_hz = 1.0 / track.period_s
    smooth = lowpass(motor, track.period_s, _DRIVE * rate_hz)
    way = np.sign(np.gradient(lowpass(motor, track.period_s, _WAY * _DRIVE * rate_hz)))
    slides = ~_stands(motor, max(_STANDS * step, _NOISY * error))
    slides[:_ENDS] = slides[-_ENDS:] = False
    places = [turn.at for turn in track.turns]
    halves = [(a + b) // 2 for a, b in itertools.pairwise(places)]
    return ArmRecord(
        period_s=track.period_s,
        motor_rad=motor,
        arm_rad=arm,
        torque_nm=track.torque_nm,
        smooth_rad=smooth,
        way=way,
        slides=slides,
        swings=swings(motor, track.period_s, error),
        turn=first_turn + np.searchsorted(halves, np.arange(motor.size), side="right"),
        places=tuple(places),
        motor_error_rad=error,
        arm_error_rad=arm_error,
        torque_error_nm=max(white_noise(track.torque_nm), finest),
        arm_step_rad=arm_step,
        hardest_rad_s2=float(np.abs(track.acceleration_rad_s2).max()),
    )


def _stands(position: Floats, least_rad: float) -> NDArray[np.bool_]:
    """Tell where the encoder hardly moves, and a little before and after that."""
    from scipy.ndimage import maximum_filter1d

    moved = np.full(position.size, np.inf)
    moved[_ABOUT:-_ABOUT] = np.abs(position[2 * _ABOUT :] - position[: -2 * _ABOUT])
    stands = np.asarray(moved < least_rad, dtype=np.uint8)
    return np.asarray(maximum_filter1d(stands, 2 * _ABOUT + 1) > 0)
