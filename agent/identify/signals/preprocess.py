"""From recorded columns to filtered regressors: velocity, acceleration, direction, torque.

Order of operations, for every stretch on its own (thesis section 4.1.1):

1. velocity is the drive's own, or the central difference of the position;
2. direction is the thresholded sign (4.10) of a lightly low-passed velocity, with the threshold
   at four standard deviations of the noise that is left in it (`direction`);
3. torque, velocity, direction, gravity's sine and cosine and the constant pass the same zero-phase
   low-pass;
4. acceleration is the slope of the filtered velocity, and so filtered alike; by five points, as
   the central difference of (4.9) is too small by ``(w T)^2 / 6``: at 250 Hz and a cutoff of 9 Hz
   the inertia would be 0.1 % too large, which is most of its standard error. A velocity that was
   derived is so made anew from the filtered position.

Where the direction is unknown (standstill), friction is indeterminate: the share of such samples
is filtered alike, and what it touches is not used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.direction import SIGN_BAND, direction_in_time
from agent.identify.signals.lowpass import Cutoff, choose_cutoff, lowpass
from agent.identify.signals.sampling import Stretch, Timing, find_stretches
from agent.physics.derivative import slope
from agent.physics.rigid_body import PARAMETERS, regressor

SPEED_CHANGE = 0.2  # of the fastest: less, inside every stretch, excites no inertia
_ACCELERATION = PARAMETERS.index("inertia_kg_m2")
_VELOCITY = PARAMETERS.index("viscous_nm_s_per_rad")
_UNKNOWN_SHARE = 0.05
_SHORTEST_PERIODS = 2.0  # of the cutoff: shorter stretches are not filtered
_EDGE = 1.5  # of the cutoff's period: so long the filter remembers a ramp beside the end
_EDGE_SHARE, _EDGE_LEAST = 0.1, 0.5  # a short stretch gives a tenth, at least half a period


@dataclass(frozen=True)
class FilteredStretch:
    """One stretch, filtered: all arrays on its even grid of n samples.

    Parameters
    ----------
    stretch : Stretch
        Where it stands in the recording.
    regressor : ndarray, shape (n, 6)
        The columns of thesis (4.5), in the order of `physics.rigid_body.PARAMETERS`.
    torque_nm, velocity_rad_s : ndarray, shape (n,)
        Filtered alike.
    snap_rad_s4 : ndarray, shape (n,)
        Second derivative of the filtered acceleration.
    usable : ndarray of bool, shape (n,)
        False where the direction of motion is unknown, and at the stretch's ends.
    unfiltered_rad_s : ndarray, shape (n,)
        The velocity as it was.
    direction : ndarray of int8, shape (n,)
        Its thresholded sign, not filtered.
    """

    stretch: Stretch
    regressor: Floats
    torque_nm: Floats
    velocity_rad_s: Floats
    snap_rad_s4: Floats
    usable: NDArray[np.bool_]
    unfiltered_rad_s: Floats
    direction: NDArray[np.int8]


@dataclass(frozen=True)
class Motion:
    """A recording's motion before filtering, on its stretches' grids.

    Parameters
    ----------
    signals : Signals
        As recorded.
    timing : Timing
        Its stretches.
    velocity_rad_s : tuple of ndarray
        One array per stretch, on its grid; derived where the drive gave none.
    velocity_noise_rad_s : float
        Standard deviation of the velocity's white noise.
    velocity_derived : bool
        Whether the velocity was derived from the position.
    notes : tuple of str
        What was done to the data.
    """

    signals: Signals
    timing: Timing
    velocity_rad_s: tuple[Floats, ...]
    velocity_noise_rad_s: float
    velocity_derived: bool
    notes: tuple[str, ...]

    def own_velocity_rad_s(self) -> Floats:
        """Return the velocity at the recording's own samples, NaN outside every stretch."""
        out = np.full(self.signals.time_s.shape, np.nan)
        for stretch, velocity in zip(self.timing.stretches, self.velocity_rad_s, strict=True):
            out[stretch.index] = stretch.off_grid(self.signals, velocity)
        return out


def left_out_of(signals: Signals) -> tuple[str, ...]:
    """Return what is to be said of a recording's doubtful rows; nothing where it has none."""
    if not signals.left_out:
        return ()
    rows = "1 row" if signals.left_out == 1 else f"{signals.left_out} rows"
    return (
        f"{signals.name}: {rows} that may stand in another's place in time "
        "(a SYNC or an answer was held up) are left out",
    )


def read_motion(signals: Signals) -> Motion:
    """Find the stretches and the velocity of one recording."""
    timing = find_stretches(signals)
    derived = signals.velocity_rad_s is None
    velocities = []
    for stretch in timing.stretches:
        if signals.velocity_rad_s is not None:
            velocities.append(stretch.on_grid(signals, signals.velocity_rad_s))
        else:
            assert signals.position_rad is not None
            position = stretch.on_grid(signals, signals.position_rad)
            velocities.append(np.gradient(position, stretch.period_s))
    notes = list(left_out_of(signals))
    if derived:
        notes.append(f"{signals.name}: velocity was derived from position by central differences")
    jitter = f"jitter {1e3 * timing.jitter_s:.3g} ms"
    if any(stretch.uneven and stretch.resampled for stretch in timing.stretches):
        notes.append(
            f"{signals.name}: time is uneven ({jitter}); "
            "the signals were interpolated onto an even grid"
        )
    if any(stretch.uneven and not stretch.resampled for stretch in timing.stretches):
        notes.append(
            f"{signals.name}: the stamps are uneven ({jitter}), and the motion is smooth in even "
            "time alone; the rows were taken as sampled evenly"
        )
    return Motion(signals, timing, tuple(velocities), _noise(velocities), derived, tuple(notes))


def shared_cutoff(motions: Sequence[Motion]) -> Cutoff:
    """Choose one cutoff for all recordings of an axis.

    Where the velocity never changes inside a stretch there is no acceleration to choose from, and
    a fifth of the slowest sampling rate is taken.
    """
    velocities = [v for motion in motions for v in motion.velocity_rad_s]
    fastest = max((float(np.abs(v).max()) for v in velocities), default=0.0)
    if not any(float(np.ptp(v)) > SPEED_CHANGE * fastest for v in velocities):
        periods = [s.period_s for motion in motions for s in motion.timing.stretches]
        return Cutoff(0.2 / max(periods, default=1.0), 0.0, 0.0)
    derived = all(motion.velocity_derived for motion in motions)
    channels: list[tuple[Floats, float]] = []
    for motion in motions:
        for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
            position = motion.signals.position_rad
            if derived and position is not None:
                channels.append((stretch.on_grid(motion.signals, position), stretch.period_s))
            else:
                channels.append((velocity, stretch.period_s))
    return choose_cutoff(channels, differences=2 if derived else 1)


def filter_motion(
    motion: Motion, cutoff_hz: float, slowest_rad_s: float = 0.0
) -> tuple[FilteredStretch, ...]:
    """Return every stretch that is long enough to be filtered, filtered.

    Parameters
    ----------
    motion : Motion
        One recording.
    cutoff_hz : float
        The low-pass's cutoff.
    slowest_rad_s : float
        What is slower is not usable, as if it stood.
    """
    out = []
    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
        if velocity.shape[0] * stretch.period_s * cutoff_hz >= _SHORTEST_PERIODS:
            out.append(_filter_stretch(motion, stretch, velocity, cutoff_hz, slowest_rad_s))
    return tuple(out)


def _filter_stretch(
    motion: Motion, stretch: Stretch, velocity: Floats, cutoff_hz: float, slowest_rad_s: float
) -> FilteredStretch:
    """Build the regressor of one stretch and pass everything through the same filter."""
    signals = motion.signals
    direction = direction_in_time(
        velocity, stretch.period_s, cutoff_hz, motion.velocity_noise_rad_s
    )
    unknown = direction == 0.0
    if slowest_rad_s > 0.0:
        smooth = lowpass(velocity, stretch.period_s, SIGN_BAND * cutoff_hz)
        unknown |= np.abs(smooth) < slowest_rad_s
    position = signals.position_rad
    place = None if position is None else stretch.on_grid(signals, position)
    from_place = place if motion.velocity_derived else None
    torque = stretch.on_grid(signals, signals.torque_nm)
    # Not one name too many: of a long recording each of these is a third of the memory.
    filtered = lowpass(
        np.vstack(
            (
                regressor(
                    place,
                    velocity if from_place is None else from_place,
                    np.zeros_like(velocity),
                    direction,
                    signals.gear_ratio,
                ).T,
                torque,
                unknown,
            )
        ),
        stretch.period_s,
        cutoff_hz,
    )
    if from_place is not None:
        filtered[_VELOCITY] = slope(filtered[_VELOCITY], stretch.period_s)
    velocity_filtered = filtered[_VELOCITY]
    # Differentiated after the filter, which is the same inside a stretch, but does not fold the
    # noise of the very first and last acceleration into the filter's extension.
    filtered[_ACCELERATION] = slope(velocity_filtered, stretch.period_s)
    usable = (filtered[-1] < _UNKNOWN_SHARE) & ~unknown
    # At the ends the filter sees its own extension, which is no motion.
    cycle = 1.0 / (cutoff_hz * stretch.period_s)
    periods = min(_EDGE, max(_EDGE_SHARE * velocity.shape[0] / cycle, _EDGE_LEAST))
    edge = int(np.ceil(periods * cycle))
    usable[:edge] = usable[-edge:] = False
    return FilteredStretch(
        stretch=stretch,
        regressor=filtered[: len(PARAMETERS)].T,
        torque_nm=filtered[-2],
        velocity_rad_s=velocity_filtered,
        snap_rad_s4=_second_derivative(filtered[_ACCELERATION], stretch.period_s),
        usable=usable,
        unfiltered_rad_s=velocity,
        direction=direction.astype(np.int8),
    )


def _second_derivative(values: Floats, period_s: float) -> Floats:
    """Return the second derivative of evenly sampled values, shape (n,)."""
    return slope(slope(values, period_s), period_s)


def _noise(velocities: Sequence[Floats]) -> float:
    """Return the standard deviation of white noise in the velocity, from second differences.

    The median makes it blind to the ramps. Quantised velocity can have a median of zero: then the
    uniform error of its smallest step, step/sqrt(12), stands in.
    """
    curvature = [np.diff(v, n=2) for v in velocities if v.size > 2]
    if not curvature:
        return 0.0
    robust = float(np.median(np.abs(np.concatenate(curvature)))) / (0.6745 * math.sqrt(6.0))
    if robust > 0.0:
        return robust
    steps = np.concatenate([np.abs(np.diff(v)) for v in velocities])
    steps = steps[steps > 0.0]
    if not steps.size:
        return 0.0
    # A set-point in the velocity's place has steps, but they are the stair's, not a resolution.
    fastest = max(float(np.max(np.abs(v), initial=0.0)) for v in velocities)
    return min(float(steps.min()), 0.01 * fastest) / math.sqrt(12.0)
