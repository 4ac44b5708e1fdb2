"""The motion at full rate, smooth and in step, gaps marked; and the band to compare in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from agent.explain.rows.driving import driving_velocity
from agent.explain.rows.held import Held, direction_in_passes
from agent.explain.rows.lag import Lag, earlier
from agent.explain.rows.pieces import Piece
from agent.explain.rows.run import CORNERS, OPTIONAL, Run
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.sampling import Stretch
from agent.physics.derivative import slope

WIDEST_SHARE = 0.1
"""Of the sampling rate: the widest band."""

_WIDEST_HZ, _NARROWEST_HZ = 40.0, 2.0
_CLEAN = 0.5  # of the torque's noise: so much of a derived acceleration's passes
_RECORDED = (
    "time_s",
    "elapsed_s",
    "position_rad",
    "held_rad_s",
    "step",
    "torque_nm",
    "run",
    "bridged",
)
_MOTION = (
    "velocity_rad_s",
    "velocity_raw_rad_s",
    "velocity_driving_rad_s",
    "acceleration_rad_s2",
    "direction",
)


def choose_band(motions: Sequence[Motion], inertia_kg_m2: float) -> float:
    """Return the widest low-pass in which torque noise prevails over the acceleration's noise, Hz.

    White noise of the velocity, differentiated and multiplied by the inertia, grows with the
    cutoff to the power 3/2; white noise of the torque with its root. At most 40 Hz. It is that of
    drive and encoder, and so one for all recordings; `band_of` fits it to a sampling rate. Where
    only the position was recorded it is its noise that is differentiated, twice.
    """
    balances = (max(balance, _NARROWEST_HZ) for balance in _balances(motions, inertia_kg_m2))
    return min([_WIDEST_HZ, *balances])


def shaken_by_noise(motions: Sequence[Motion], inertia_kg_m2: float, cutoff_hz: float) -> float:
    """Return how much noise there is below a cutoff, over that of the torque alone; at least 1.

    Parameters
    ----------
    motions : sequence of Motion
        All of velocities that were recorded, or all of velocities that were taken from the angle.
    inertia_kg_m2 : float
        By which the noise of the acceleration is one of torque.
    cutoff_hz : float
    """
    derived = any(motion.velocity_derived for motion in motions)
    shares = [cutoff_hz / max(b, 1e-9) for b in _balances(motions, inertia_kg_m2)]
    ratios = [_CLEAN * share**2 if derived else share for share in shares]
    return math.sqrt(1.0 + float(np.mean(np.square(ratios)))) if ratios else 1.0


def _balances(motions: Sequence[Motion], inertia_kg_m2: float) -> Iterator[float]:
    """Yield the cutoff of every stretch at which the motion's noise is as much as the torque's."""
    for motion in motions:
        for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
            if velocity.shape[0] < 16 or _NARROWEST_HZ * stretch.period_s > WIDEST_SHARE:
                continue  # sampled so slowly that the noise does not set its band
            torque = stretch.on_grid(motion.signals, motion.signals.torque_nm)
            torque_noise = float(np.sqrt(np.mean(np.diff(torque, n=2) ** 2) / 6.0))
            if motion.velocity_derived:
                yield _balance_of_steps(stretch, motion, torque_noise, inertia_kg_m2)
                continue
            # High-passed near Nyquist, where neither motion nor its harmonics are left.
            rough = np.diff(velocity, n=3)
            velocity_noise = float(np.sqrt(np.mean(rough**2) / 20.0))
            shaken = inertia_kg_m2 * velocity_noise * 2.0 * math.pi / math.sqrt(3.0)
            yield torque_noise / shaken if shaken > 0.0 else math.inf


def _balance_of_steps(
    stretch: Stretch, motion: Motion, torque_noise_nm: float, inertia_kg_m2: float
) -> float:
    """Return the cutoff up to which a position's noise, differentiated twice, is half of torque's.

    In rms, at the cutoff f: white noise d of the position makes ``(2 pi)^2 f^2 d / sqrt(5)`` times
    the root of what white torque noise makes. An encoder's steps are white at no single speed: with
    less than that factor of two, what they do at the worst is taken for an arm that swings.
    """
    assert motion.signals.position_rad is not None
    position = stretch.on_grid(motion.signals, motion.signals.position_rad)
    # Of fourth differences of white noise, the sum of squared binomials is 70.
    noise = float(np.sqrt(np.mean(np.diff(position, n=4) ** 2) / 70.0))
    shaken = inertia_kg_m2 * noise * (2.0 * math.pi) ** 2 / math.sqrt(5.0)
    return math.sqrt(_CLEAN * torque_noise_nm / shaken) if shaken > 0.0 else math.inf


def band_of(stretch: Stretch, cutoff_hz: float) -> float:
    """Return a stretch's own band: at most a tenth of its sampling rate, Hz."""
    return min(cutoff_hz, WIDEST_SHARE / stretch.period_s)


def recorded_columns(
    runs: Sequence[Run], pieces: Sequence[Piece], passes: Sequence[Held]
) -> dict[str, Floats]:
    """Return what was recorded beside the velocity at full rate, each shape (N,)."""
    full = _empty(_RECORDED, pieces)
    optional = [name for name in OPTIONAL if any(name in run.columns for run in runs)]
    # What was never recorded takes no memory.
    nothing = np.broadcast_to(np.nan, (pieces[-1].full.stop,))
    full |= _empty(optional, pieces) | dict.fromkeys(set(OPTIONAL) - set(optional), nothing)
    full[CORNERS] = np.zeros(pieces[-1].full.stop)
    known = [run.started_s for run in runs if math.isfinite(run.started_s)]
    origin_s = min(known) if len(known) == len(runs) else math.nan
    first_step = 0.0
    for piece, held in zip(pieces, passes, strict=True):
        run, stretch, at = runs[piece.run], piece.stretch, piece.full
        signals = run.signals
        if signals.position_rad is not None:
            full["position_rad"][at] = stretch.on_grid(signals, signals.position_rad)
        full["time_s"][at] = stretch.time_s
        started = run.started_s - origin_s if math.isfinite(origin_s) else math.nan
        full["elapsed_s"][at] = stretch.time_s + (started if len(runs) > 1 else 0.0)
        full["held_rad_s"][at], full["step"][at] = held.velocity_rad_s, first_step + held.step
        first_step += float(held.step.max()) + 1.0
        full["torque_nm"][at] = stretch.on_grid(signals, signals.torque_nm)
        full["run"][at] = piece.run
        full["bridged"][at] = _bridged(stretch, signals.time_s, piece.cutoff_hz)
        for name, values in run.columns.items():
            full[name][at] = filled(stretch.on_grid(signals, values))
    return full


def motion_columns(
    motions: Sequence[Motion],
    pieces: Sequence[Piece],
    velocities: Sequence[Floats],
    passes: Sequence[Held],
    position_rad: Floats,
    lags: Sequence[Lag],
    corners_rad_s2: Floats,
    *,
    align: bool,
) -> dict[str, Floats]:
    """Return the smooth motion at full rate and the position in step with it, each shape (N,).

    And by what the acceleration is off beside corners: what it is there does not depend on whether
    the velocity is brought in step.

    Parameters
    ----------
    motions : sequence of Motion
        By run.
    pieces : sequence of Piece
    velocities : sequence of ndarray
        As reported, by piece.
    passes : sequence of Held
        By piece.
    position_rad : ndarray, shape (N,)
        NaN where not recorded.
    lags : sequence of Lag
        By piece, as `lags_of` gives them.
    corners_rad_s2 : ndarray, shape (N,)
        Beside the slope of the velocity as reported.
    align : bool
        Whether the velocity is brought in step with the position, and not the position with it.
    """
    full = _empty(_MOTION, pieces) | {"position_rad": position_rad.copy()}
    full[CORNERS] = corners_rad_s2.copy()
    driven = any(piece.shows_changes for piece in pieces)
    for piece, reported, held, lag in zip(pieces, velocities, passes, lags, strict=True):
        velocity, cutoff_hz, at = reported, piece.cutoff_hz, piece.full
        position = position_rad[at]
        if align:
            velocity = lag.undone(velocity, piece.period_s, cutoff_hz)
            step = slope(reported, piece.period_s) - slope(velocity, piece.period_s)
            full[CORNERS][at] += np.where(corners_rad_s2[at] != 0.0, step, 0.0)
        elif lag.late_s != 0.0 and not motions[piece.run].velocity_derived:
            # Torque is in step with the velocity: so must be the angle that waves go by.
            full["position_rad"][at] = earlier(position, -lag.late_s, piece.period_s)
        # Two points would miss 7 % at a tenth of the rate, which looks like a spring.
        derived = motions[piece.run].velocity_derived
        raw = slope(position, piece.period_s) if derived else velocity
        smooth = lowpass(raw, piece.period_s, cutoff_hz)
        full["velocity_raw_rad_s"][at] = raw
        signals = motions[piece.run].signals
        full["velocity_driving_rad_s"][at] = (
            raw
            if derived
            else driving_velocity(signals, piece.stretch, reported, lag, cutoff_hz, align=align)
        )
        full["velocity_rad_s"][at] = smooth
        # Between slow samples a change of speed is over: what is left to see is the filter's.
        still = piece.slow or not driven
        full["acceleration_rad_s2"][at] = 0.0 if still else slope(smooth, piece.period_s)
        full["direction"][at] = direction_in_passes(
            velocity, held, piece.period_s, cutoff_hz, motions[piece.run].velocity_noise_rad_s
        )
    return full


def _empty(names: Iterable[str], pieces: Sequence[Piece]) -> dict[str, Floats]:
    return {name: np.full(pieces[-1].full.stop, np.nan) for name in names}


def _bridged(stretch: Stretch, time_s: Floats, cutoff_hz: float) -> Floats:
    """Return 1 where a grid point lies between samples too far apart for the band."""
    own = time_s[stretch.index]
    after = np.clip(np.searchsorted(own, stretch.time_s, side="right"), 1, own.shape[0] - 1)
    far_s = max(1.5 * stretch.period_s, 1.5 * WIDEST_SHARE / cutoff_hz)
    return (own[after] - own[after - 1] > far_s).astype(np.float64)


def filled(values: Floats) -> Floats:
    """Return values with single gaps bridged; all NaN stays all NaN."""
    bad = ~np.isfinite(values)
    if bad.all() or not bad.any():
        return values
    at = np.arange(values.shape[0])
    return np.interp(at, at[~bad], values[~bad])
