"""What a twin says of a recording's own motion: its torque, sample by sample, where it is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.identify.signals.arrays import Signals
from agent.identify.signals.direction import direction_of
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.preprocess import read_motion, shared_cutoff
from agent.identify.signals.sampling import Stretch
from agent.physics.derivative import slope
from agent.physics.effects.motion import Motion, path_rad
from agent.physics.twin import Twin

Floats = NDArray[np.float64]

_SHORTEST_PERIODS = 2.0  # of the cutoff: a shorter stretch has no acceleration to speak of
_BAND = 16  # bins of a spectrum that are judged together
_SHARE = 0.5  # of the torque's own noise: an error that hides in it
_SEEN = 0.01  # of the acceleration's range: a difference that a plot would show


def simulated_torque_nm(
    twin: Twin,
    signals: Signals,
    columns: Mapping[str, NDArray[Any]],
    started_at_unix_s: float | None = None,
    payload_kg: float | None = None,
) -> Floats:
    """Return the twin's torque at a recording's samples, stretch by stretch, shape (n,).

    Only the acceleration is low-passed: the torque that stands beside it is unfiltered, too. NaN
    in gaps, and where the acceleration leans on what was not recorded. At standstill, where the
    direction is unknown, friction counts as zero.

    Parameters
    ----------
    twin : Twin
    signals : Signals
        The recording's signals.
    columns : mapping of str to ndarray, shape (n,)
        The recording's columns; those of the motor's angle and of temperatures are used.
    started_at_unix_s : float, optional
        When the recording started, seconds since 1970-01-01 UTC.
    payload_kg : float, optional
        What the arm carries.

    Raises
    ------
    agent.physics.twin.TwinError
        The twin cannot be predicted from this recording.
    """
    motion = read_motion(signals)
    direction_hz = shared_cutoff([motion]).frequency_hz
    torque = np.full(signals.time_s.shape, np.nan)
    turned_rad, earlier = 0.0, None
    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
        period_s, noise_rad_s = stretch.period_s, motion.velocity_noise_rad_s
        path = turned_rad + path_rad(stretch.time_s, lowpass(velocity, period_s, direction_hz))
        turned_rad = float(path[-1])
        if velocity.shape[0] * period_s * direction_hz < _SHORTEST_PERIODS:
            continue
        cutoff_hz = _cutoff_hz(velocity, period_s, motion.velocity_derived, direction_hz)
        quiet_nm = _SHARE * _noise(stretch.on_grid(signals, signals.torque_nm))
        acceleration, known = _acceleration(
            velocity, period_s, cutoff_hz, quiet_nm, twin.inertia_kg_m2
        )
        direction = direction_of(velocity, period_s, direction_hz, noise_rad_s)

        def column(name: str, at: NDArray[np.int64] = stretch.index) -> Floats | None:
            return np.asarray(columns[name], dtype=np.float64)[at] if name in columns else None

        measured = Motion(
            stretch.off_grid(signals, velocity),
            stretch.off_grid(signals, acceleration),
            np.sign(np.round(stretch.off_grid(signals, direction))),
            column("position_rad"),
            signals.time_s[stretch.index],
            column("gearbox_temperature_degc"),
            column("motor_temperature_degc"),
            started_at_unix_s,
            turned_rad=stretch.off_grid(signals, path),
            payload_kg=payload_kg,
            before=earlier,
            position_arm_rad=_smooth_arm(twin, signals, stretch, cutoff_hz),
        )
        earlier = measured
        unknown = stretch.off_grid(signals, (~known).astype(np.float64)) > 0.0
        torque[stretch.index] = np.where(unknown, np.nan, twin.predict(measured))
    return torque


def _smooth_arm(twin: Twin, signals: Signals, stretch: Stretch, cutoff_hz: float) -> Floats | None:
    """Return the arm's angle, its way from the motor's as smooth as the motion is, shape (m,)."""
    arm, motor = signals.position_arm_rad, signals.position_rad
    if arm is None or motor is None:
        return None
    ahead = stretch.on_grid(signals, twin.gear_ratio * arm - motor)
    smooth = stretch.off_grid(signals, lowpass(ahead, stretch.period_s, cutoff_hz))
    return np.asarray((motor[stretch.index] + smooth) / twin.gear_ratio)


def _cutoff_hz(velocity: Floats, period_s: float, derived: bool, least_hz: float) -> float:
    """Return where the velocity's spectrum sinks into its noise, but at least some cutoff.

    Above it a low-pass takes away more noise than motion; below, more motion than noise: a soft
    arm's ringing is motion. The noise is read in the upper half of the band, where a joint does
    not move. It is white in a drive's own velocity, and in the position behind a derived one.

    Parameters
    ----------
    velocity : ndarray, shape (n,)
        Of one stretch, evenly sampled.
    period_s : float
    derived : bool
        Whether the velocity is the central difference of a position.
    least_hz : float
        The cutoff that the motion's energy asks for.
    """
    samples = velocity.shape[0]
    if samples < 8 * _BAND:
        return least_hz
    spectrum = np.fft.rfft((velocity - np.mean(velocity)) * np.hanning(samples))
    power, frequency = np.abs(spectrum) ** 2, np.fft.rfftfreq(samples)
    shape = np.sin(2.0 * np.pi * frequency) ** 2 if derived else np.ones_like(frequency)
    # A central difference knows nothing above half of the Nyquist frequency.
    top = 0.25 if derived else 0.5
    upper = (frequency > 0.5 * top) & (frequency < 0.95 * top)
    level = float(np.median(power[upper] / shape[upper])) / np.log(2.0)
    starts, end = [0], int(np.flatnonzero(upper)[-1])
    while starts[-1] + max(_BAND, starts[-1] // 8) < end:
        starts.append(starts[-1] + max(_BAND, starts[-1] // 8))
    power, shape = (np.add.reduceat(each[:end], starts) for each in (power, shape))
    clear = power > 2.0 * level * shape
    # One noisy band may lie in a hole of the motion's spectrum; two in a row are the end.
    ends = np.flatnonzero(~clear[:-1] & ~clear[1:])
    sinks_hz = float(frequency[starts[ends[0]]]) / period_s if ends.size else top / period_s
    return max(sinks_hz, least_hz)


def _acceleration(
    velocity: Floats, period_s: float, cutoff_hz: float, quiet_nm: float, inertia_kg_m2: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the acceleration, shape (n,), and where it is known.

    It is taken twice, with the velocity continued past its ends by its slope and by its mirror
    image. Where the two differ by a torque that can be seen, it depends on what was not recorded.
    """
    pad = min(velocity.shape[0] - 1, int(np.ceil(3.0 / (cutoff_hz * period_s))))
    sloped, mirrored = (
        slope(
            lowpass(np.pad(velocity, pad, "reflect", reflect_type=kind), period_s, cutoff_hz),
            period_s,
        )[pad : pad + velocity.shape[0]]
        for kind in ("odd", "even")
    )
    seen_nm = max(quiet_nm, _SEEN * inertia_kg_m2 * float(np.ptp(sloped)))
    return sloped, inertia_kg_m2 * np.abs(sloped - mirrored) <= seen_nm


def _noise(torque_nm: Floats) -> float:
    """Return the standard deviation of white noise, from the median of second differences."""
    curvature = np.abs(np.diff(torque_nm, n=2))
    return float(np.median(curvature) / (0.6745 * np.sqrt(6.0)))
