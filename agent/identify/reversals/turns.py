"""Where the motion turns round, and the samples about every turn that an estimator uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.reversals.driving import driving_velocity
from agent.identify.reversals.smoothing import cutoff_for, resolution, swings
from agent.identify.signals.arrays import Signals
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.sampling import Stretch, find_stretches

_LEAST_SIDE = 8  # samples before and after a turn
_MOST_SIDE = 1000
_HYSTERESIS = 8.0  # standard errors of the position that a way back has to exceed
_HYSTERESIS_SHARE = 2e-4  # of the whole travel
_NO_MOTION = 6.0  # standard errors that a signal which stands ranges over, smoothed
_STANDING = 3e-3  # of the fastest speed: below, friction may be anything
_TURNING = 0.8  # of the neighbouring legs' peak speed: where the turn begins and ends
_PRELIMINARY = 0.05  # of the sampling rate: cutoff of the filter that finds the turns


@dataclass(frozen=True)
class Turn:
    """One reversal of a track: samples `start` to `stop`, extreme position at `at`.

    `samples` counts those between four fifths of the speed before and after it.
    """

    start: int
    at: int
    stop: int
    forward_before: bool
    samples: int


@dataclass(frozen=True)
class Track:
    """One stretch without gaps, on its even grid; arrays of shape (n,), motor side.

    Parameters
    ----------
    recording : int
        Which recording it belongs to.
    time_s, position_rad, velocity_rad_s, acceleration_rad_s2, torque_nm : ndarray
        Motion behind a low-pass, without acceleration where it keeps its speed; torque as recorded.
    driving_rad_s : ndarray
        Velocity that drives friction with memory: a turn that is rounded off would be remembered
        as a rounder one. Between turns it never goes back: see `driving`.
    measured_rad : ndarray
        Motor angle as recorded.
    lead_rad : ndarray or None
        Motor angle less gear ratio times arm angle, as recorded; None without the arm's encoder.
    turns : tuple of Turn
        In order of time.
    resolution_rad : float
        Finest travel that these samples tell apart: the encoder's step.
    step_rad, place_error_rad : float
        The encoder's step, 0 where noise hides it, and the standard error of an extreme position:
        that of a step, alike wherever the joint turns round at the same one; or the noise.
    cutoff_hz : float
        Of the low-pass, which torque and a law's columns pass, too, before they are compared.
    """

    recording: int
    time_s: Floats
    position_rad: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    driving_rad_s: Floats
    torque_nm: Floats
    measured_rad: Floats
    lead_rad: Floats | None
    turns: tuple[Turn, ...]
    resolution_rad: float
    step_rad: float
    place_error_rad: float
    cutoff_hz: float

    @property
    def period_s(self) -> float:
        """Return the time between samples."""
        return float(self.time_s[1] - self.time_s[0])

    def filtered(self, columns: Floats) -> Floats:
        """Return columns, shape (n, k) or (n,), behind the regression's low-pass."""
        return lowpass(columns.T, self.period_s, self.cutoff_hz).T

    @property
    def travel_rad(self) -> Floats:
        """Return the signed travel of the step that ends at each sample, shape (n,)."""
        step = np.diff(self.time_s, prepend=self.time_s[:1])
        velocity = self.driving_rad_s
        mean = 0.5 * (velocity + np.concatenate((velocity[:1], velocity[:-1])))
        return np.asarray(step * mean)


@dataclass(frozen=True)
class Motion:
    """The tracks of all recordings that move, in which directions, and the slowest sampling."""

    tracks: tuple[Track, ...]
    moved: tuple[bool, bool]
    rate_hz: float

    @property
    def turns(self) -> int:
        """Return the number of reversals."""
        return sum(len(track.turns) for track in self.tracks)


def read_tracks(recordings: Sequence[Signals]) -> Motion:
    """Return every stretch with its smoothed motion and its reversals.

    Parameters
    ----------
    recordings : sequence of Signals
        With positions. An integrated velocity does not do: where the joint turns round, its noise
        is as large as itself, and what follows from its size is taken for friction.
    """
    tracks: list[Track] = []
    forward = backward = False
    rate_hz = math.inf
    for number, signals in enumerate(recordings):
        for stretch in find_stretches(signals).stretches:
            rate_hz = min(rate_hz, 1.0 / stretch.period_s)
            track = _track(number, signals, stretch)
            if track is None:
                continue
            fastest = float(np.abs(track.velocity_rad_s).max())
            forward |= bool(np.any(track.velocity_rad_s > 0.1 * fastest))
            backward |= bool(np.any(track.velocity_rad_s < -0.1 * fastest))
            tracks.append(track)
    return Motion(tuple(tracks), (forward, backward), rate_hz)


def _track(number: int, signals: Signals, stretch: Stretch) -> Track | None:
    """Return one stretch, or None where nothing moves."""
    period_s = stretch.period_s
    if signals.position_rad is None:
        raise ValueError(f"expected position_rad in {signals.name}, got none")
    raw = stretch.on_grid(signals, signals.position_rad)
    step, error = resolution(raw)
    first = lowpass(raw, period_s, _PRELIMINARY / period_s)
    if float(np.ptp(first)) <= _NO_MOTION * error or float(np.ptp(first)) == 0.0:
        return None
    extremes = _extremes(raw, max(_HYSTERESIS * error, _HYSTERESIS_SHARE * float(np.ptp(raw))))
    cutoff = cutoff_for(raw, period_s, error, np.array(extremes, dtype=np.intp))
    smooth = lowpass(raw, period_s, cutoff)
    velocity = np.gradient(smooth, period_s)
    arm, lead = signals.position_arm_rad, None
    if arm is not None:
        lead = stretch.on_grid(signals, signals.position_rad - signals.gear_ratio * arm)
    return Track(
        recording=number,
        time_s=stretch.time_s,
        position_rad=smooth,
        velocity_rad_s=velocity,
        acceleration_rad_s2=np.gradient(velocity, period_s) * swings(raw, period_s, error),
        driving_rad_s=driving_velocity(
            raw, velocity, extremes, period_s=period_s, cutoff_hz=cutoff, step_rad=step
        ),
        torque_nm=stretch.on_grid(signals, signals.torque_nm),
        measured_rad=raw,
        lead_rad=lead,
        turns=_turns(smooth, velocity, extremes),
        resolution_rad=max(step, error),
        step_rad=step,
        place_error_rad=error,
        cutoff_hz=cutoff,
    )


def _extremes(position: Floats, hysteresis_rad: float) -> list[int]:
    """Return where the position turns round and then goes back by more than the hysteresis."""
    found: list[int] = []
    high = low = 0
    heading = 0
    values = position.tolist()
    for i, value in enumerate(values):
        if value > values[high]:
            high = i
        if value < values[low]:
            low = i
        if heading >= 0 and values[high] - value > hysteresis_rad:
            if heading > 0:
                found.append(high)
            heading, low = -1, i
        elif heading <= 0 and value - values[low] > hysteresis_rad:
            if heading < 0:
                found.append(low)
            heading, high = 1, i
    return found


def _turns(position: Floats, velocity: Floats, extremes: Sequence[int]) -> tuple[Turn, ...]:
    """Return the extremes with the samples around them, to half the way to their neighbours."""
    ends = [0, *extremes, position.size - 1]
    out = []
    for i, at in enumerate(extremes, start=1):
        before, after = ends[i - 1], ends[i + 1]
        # How the first leg set out is not known: a law's memory of it is gone by its end.
        start = at if i == 1 else max((before + at) // 2, at - _MOST_SIDE)
        stop = min((at + after) // 2 + 1, at + _MOST_SIDE)
        if min(at - before, stop - at) < _LEAST_SIDE:
            continue
        forward = bool(position[at] > position[before])
        slow = min(
            float(np.abs(velocity[before:at]).max()), float(np.abs(velocity[at:after]).max())
        )
        fast = np.abs(velocity[before : after + 1]) >= _TURNING * slow
        centre = at - before
        left, right = np.flatnonzero(fast[:centre]), np.flatnonzero(fast[centre:])
        samples = int(right[0] + centre - left[-1]) if left.size and right.size else 0
        out.append(Turn(start, at, stop, forward, samples))
    return tuple(out)


def standing(track: Track) -> NDArray[np.bool_]:
    """Tell which samples stand, shape (n,): there friction is whatever holds the joint."""
    speed = np.abs(track.velocity_rad_s)
    return np.asarray(speed < _STANDING * float(speed.max()))
