"""What the picture of a flexible joint needs besides its fit: spectra, and torque over time.

The measured frequency response is that of the motion to the motor torque, friction, gravity and
offset taken out with the fitted laws. No filter is applied: its noise is what was measured. Around
standstill, where no static law knows friction, what the fit leaves of the torque is bridged by a
straight line; a jump there would otherwise be spread over all frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.chain import Complexes, apparent_inertia
from agent.identify.flexible.preparation import Track, prepare, tracks_of
from agent.identify.flexible.result import FlexibleFit
from agent.identify.flexible.simulation import FlexibleJoint
from agent.identify.flexible.validation import predicted_torque
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.physics.friction import LAWS
from agent.physics.rigid_body import gravity_columns

_LINES = 120  # bands between the lowest and the highest frequency of an aperiodic recording
_SEGMENT_S = 8.0
_BEYOND = 1.6  # times the fit's cutoff: where its band ends is shown, too
_CLEAR = 0.25  # relative standard error up to which a line counts as measured
_NEIGHBOURS, _LEAST, _UNCLEAR = 2, 0.03, 2.0
_ANTIRESONANCES = 14.0  # how long a stretch is drawn: periods of the slowest antiresonance


@dataclass(frozen=True)
class Response:
    """The motor's acceleration per torque over frequency, as measured; arrays of shape (n,).

    Parameters
    ----------
    frequency_hz : ndarray
        Rising.
    acceleration_per_nm : ndarray of complex
        rad/s² per N m; the reciprocal of the apparent inertia ``sum conj(A) T / sum |A|^2``.
    relative_error : ndarray
        Standard error of the magnitude, as a share of it.
    excitation : ndarray
        ``sum |A|^2``. A triangle wave excites the odd lines and leaves little for the even ones.
    """

    frequency_hz: Floats
    acceleration_per_nm: Complexes
    relative_error: Floats
    excitation: Floats

    @property
    def excited(self) -> NDArray[np.bool_]:
        """Return which lines got 3 % of their neighbours' amplitude or more."""
        near = np.lib.stride_tricks.sliding_window_view(
            np.pad(self.excitation, _NEIGHBOURS, mode="edge"), 2 * _NEIGHBOURS + 1
        )
        return np.asarray(self.excitation >= _LEAST**2 * near.max(axis=1), dtype=np.bool_)

    @property
    def clear(self) -> NDArray[np.bool_]:
        """Return which lines were excited well enough to be measured."""
        return self.excited & (self.relative_error <= _CLEAR)

    def excited_hz(self) -> tuple[float, float]:
        """Return the band in which excited lines are clear, but for a few; NaN without one.

        Of all bands the one with the most clear lines, two of them lost for every one that is not.
        """
        lines = np.flatnonzero(self.excited)
        score = np.where(self.clear[lines], 1.0, -_UNCLEAR)
        sums = np.concatenate(([0.0], np.cumsum(score)))
        lowest = np.minimum.accumulate(sums)
        last = int(np.argmax(sums - lowest))
        if sums[last] <= lowest[last]:
            return math.nan, math.nan
        first = int(np.flatnonzero(sums[:last] == lowest[last])[-1])
        inside = self.frequency_hz[lines[first:last]]
        return float(inside[0]), float(inside[-1])


@dataclass(frozen=True)
class Stretch:
    """Some seconds of torque, measured and from both models, in the band of the fit; shape (n,)."""

    recording: str
    time_s: Floats
    measured_nm: Floats
    flexible_nm: Floats
    rigid_nm: Floats


def model_response(joint: FlexibleJoint, frequency_hz: Floats) -> Complexes:
    """Return a joint's acceleration per torque, rad/s² per N m, without friction, shape (n,)."""
    inertia = np.full(frequency_hz.shape, joint.motor_inertia_kg_m2, dtype=np.complex128)
    if joint.chain is not None:
        inertia += apparent_inertia(joint.chain, 2.0 * np.pi * frequency_hz)
    return np.asarray(1.0 / inertia, dtype=np.complex128)


def measured_response(fit: FlexibleFit, recordings: Sequence[Signals], period_s: float) -> Response:
    """Return the frequency response that recordings show.

    Parameters
    ----------
    fit : FlexibleFit
        A decidable one: its friction, gravity, offset and delay are taken out.
    recordings : sequence of Signals
        Sampled alike.
    period_s : float
        Where every one of them is a mean period laid end to end: how long the period is, so that
        the lines are exact. NaN for any others: they are cut into windowed segments of 8 s
        at most.
    """
    spectra = [_segments(fit, t, period_s) for s in recordings for t in tracks_of(s)]
    frequency = spectra[0][0]
    own = [(a, t) for f, a, t in spectra if f.shape == frequency.shape]
    motion = np.concatenate([a for a, _ in own])
    torque = np.concatenate([t for _, t in own])
    inside = (frequency > 0.0) & (frequency <= _BEYOND * fit.cutoff_hz)
    frequency, motion, torque = frequency[inside], motion[:, inside], torque[:, inside]
    bands = np.arange(frequency.size)
    if not math.isfinite(period_s):
        edges = np.geomspace(frequency[0], frequency[-1], _LINES + 1)
        bands = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, _LINES - 1)
    return _response(frequency, motion, torque, bands)


def _response(
    frequency: Floats, motion: Complexes, torque: Complexes, bands: NDArray[np.int64]
) -> Response:
    """Return the response band by band; spectra have shape (segments, lines)."""
    found = []
    for band in np.unique(bands):
        a, t = motion[:, bands == band].ravel(), torque[:, bands == band].ravel()
        power = np.abs(a) ** 2
        total = float(power.sum())
        inertia = complex(np.vdot(a, t) / max(total, 1e-300))
        if inertia == 0.0:
            continue
        left = float(np.sum(np.abs(t - inertia * a) ** 2)) / max(a.size - 1, 1)
        error = math.sqrt(0.5 * left / total) / abs(inertia)
        at = float(power.reshape(motion.shape[0], -1).sum(0) @ frequency[bands == band] / total)
        found.append((at, 1.0 / inertia, error if a.size > 1 else math.inf, total))
    return Response(
        np.array([line[0] for line in found]),
        np.array([line[1] for line in found]),
        np.array([line[2] for line in found]),
        np.array([line[3] for line in found]),
    )


def _segments(
    fit: FlexibleFit, track: Track, period_s: float
) -> tuple[Floats, Complexes, Complexes]:
    """Return frequencies, and spectra of acceleration and torque, shape (segments, lines)."""
    step = track.period_s
    torque_nm = _torque_of_inertia(fit, track)
    if math.isfinite(period_s):
        # Across the seam: differences at the very ends of the track see only one side.
        size = round(period_s / step)
        starts, window = [(track.torque_nm.shape[0] - size) // 2], np.ones(size)
    else:
        # Five segments or more, half overlapping: their scatter is the error.
        size = min(round(_SEGMENT_S / step), max(track.torque_nm.shape[0] // 3, 2))
        starts = list(range(0, track.torque_nm.shape[0] - size + 1, max(size // 2, 1)))
        window = np.hanning(size + 2)[1:-1]
    frequency = np.fft.rfftfreq(size, step).astype(np.float64)
    turn = 2.0 * np.pi * frequency
    index = np.array(starts)[:, np.newaxis] + np.arange(size)
    motion = np.fft.rfft(track.acceleration_rad_s2[index] * window) / _damped(track, turn)
    return frequency, motion, np.fft.rfft(torque_nm[index] * window)


def _damped(track: Track, omega_rad_s: Floats) -> Floats:
    """Return by what the differences that made the acceleration have damped it."""
    turn = omega_rad_s * track.period_s / np.pi
    if track.position_rad is not None:
        return np.asarray(np.sinc(0.5 * turn) ** 2, dtype=np.float64)
    return np.asarray(np.sinc(np.minimum(turn, 0.9)), dtype=np.float64)


def _torque_of_inertia(fit: FlexibleFit, track: Track) -> Floats:
    """Return the torque that moves motor and arm, its delay undone, shape (n,)."""
    joint = fit.joint
    assert joint is not None
    law = LAWS[fit.friction]
    friction = law.torque(
        track.velocity_rad_s, {name: getattr(joint, name) for name in law.parameters}
    )
    samples = np.arange(track.torque_nm.size)
    delay = fit.parameters["torque_delay_s"].value / track.period_s
    rest = np.interp(samples + delay, samples, track.torque_nm) - friction - joint.torque_offset_nm
    if track.position_rad is not None:
        levels = np.array([joint.gravity_sin_nm, joint.gravity_cos_nm])
        rest -= gravity_columns(track.position_rad, track.gear_ratio) @ levels
    omega = 2.0 * np.pi * np.fft.rfftfreq(samples.size, track.period_s).astype(np.float64)
    spectrum = np.fft.rfft(track.acceleration_rad_s2) / _damped(track, omega)
    model = model_response(joint, omega / (2.0 * np.pi))
    expected = np.fft.irfft(spectrum / model, n=samples.size)
    ready = prepare(track, fit.cutoff_hz)
    if ready is None or not ready.usable.any():
        return np.asarray(rest, dtype=np.float64)
    known = np.repeat(ready.usable, ready.stride)[: samples.size]
    # The bridge rests on means: a single sample's noise would go across the whole gap.
    width = np.ones(max(round(1.0 / (fit.cutoff_hz * track.period_s)), 1))
    left = np.where(known, rest - expected, 0.0)
    mean = np.convolve(left, width, "same") / np.maximum(np.convolve(known, width, "same"), 1.0)
    left[~known] = np.interp(samples[~known], samples[known], mean[known])
    return np.asarray(expected + left, dtype=np.float64)


def telling_stretch(fit: FlexibleFit, recording: Signals, length_s: float = math.nan) -> Stretch:
    """Return the seconds of a recording in which both models differ most.

    Samples about standstill, where no static law of friction holds, are NaN.

    Parameters
    ----------
    fit : FlexibleFit
        A decidable one.
    recording : Signals
    length_s : float
        How long; NaN takes fourteen periods of the slowest antiresonance.

    Raises
    ------
    ValueError
        The recording is too short for the filter, or never moves.
    """
    assert fit.joint is not None
    assert fit.joint.chain is not None
    assert fit.rigid is not None
    if not math.isfinite(length_s):
        length_s = (
            _ANTIRESONANCES * 2.0 * math.pi / float(fit.joint.chain.antiresonances_rad_s()[0])
        )
    best: Stretch | None = None
    most = -1.0
    for p in (prepare(t, fit.cutoff_hz) for t in tracks_of(recording)):
        if p is None or not p.usable.any():
            continue
        torque, by_joint = predicted_torque((p,), fit, fit.joint)
        measured, flexible = _spread(torque, p.usable), _spread(by_joint, p.usable)
        rigid = _spread(predicted_torque((p,), fit, fit.rigid)[1], p.usable)
        size = min(max(round(length_s / p.period_s), 2), p.torque_nm.size)
        sums = np.concatenate(([0.0], np.nancumsum((flexible - rigid) ** 2)))
        gains = sums[size:] - sums[:-size]
        first = int(np.argmax(gains))
        if gains[first] > most:
            most = float(gains[first])
            time_s = np.arange(size, dtype=np.float64) * float(p.period_s)
            rows = (row[first : first + size] for row in (measured, flexible, rigid))
            best = Stretch(recording.name, time_s, *rows)
    if best is None:
        raise ValueError(f"{recording.name}: too short, or never moving, to be drawn")
    return best


def _spread(values: Floats, usable: NDArray[np.bool_]) -> Floats:
    """Return values at the usable samples, NaN at the others, shape (n,)."""
    out = np.full(usable.shape, np.nan)
    out[usable] = values
    return out
