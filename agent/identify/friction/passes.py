"""One steady window's samples and their mean torque, with an error that counts correlation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.windows import SteadyWindow
from agent.identify.uncertainty import correlation_time, variance_of_mean
from agent.physics.rigid_body import gravity_columns

_MANY_CORRELATION_TIMES = 20.0
_TREND_PIECES = 6


@dataclass(frozen=True)
class PositionTorque:
    """The torque that depends on position only, as the rigid body found it.

    ``gravity_sin_nm sin(q/N) + gravity_cos_nm cos(q/N) + torque_offset_nm``.
    """

    gravity_sin_nm: float
    gravity_cos_nm: float
    torque_offset_nm: float

    def at(self, position_rad: Floats | None, gear_ratio: float) -> Floats | float:
        """Return the torque in N m at motor angles of shape (n,); the offset without them."""
        if position_rad is None:
            return self.torque_offset_nm
        weights = np.array([self.gravity_sin_nm, self.gravity_cos_nm])
        torque = gravity_columns(position_rad, gear_ratio) @ weights + self.torque_offset_nm
        return np.asarray(torque, dtype=np.float64)


@dataclass(frozen=True)
class Pass:
    """One steady window's samples.

    `smooth_nm` is the part of the torque that changes along the positions and is known: it is no
    noise. `correlation_samples` is how far the noise remembers. `temperature_degc` is the gearbox's
    mean, NaN where it was not recorded.
    """

    velocity_rad_s: float
    velocity_error_rad_s: float
    torque_nm: Floats
    position_rad: Floats | None
    smooth_nm: Floats
    gear_ratio: float
    period_s: float
    correlation_samples: float = 1.0
    temperature_degc: float = math.nan

    @property
    def range_rad(self) -> tuple[float, float]:
        """Return the lowest and highest motor position; only where a position was recorded."""
        assert self.position_rad is not None
        return float(self.position_rad.min()), float(self.position_rad.max())

    def within(self, lower: float, upper: float) -> Pass:
        """Return the part of the pass between two motor positions."""
        assert self.position_rad is not None
        inside = (self.position_rad >= lower) & (self.position_rad <= upper)
        return replace(
            self,
            torque_nm=self.torque_nm[inside],
            position_rad=self.position_rad[inside],
            smooth_nm=self.smooth_nm[inside],
        )


@dataclass(frozen=True)
class Mean:
    """A mean with its variance, degrees of freedom and count of samples."""

    value: float
    variance: float
    dof: float
    samples: int


def take_pass(
    motion: Motion,
    window: SteadyWindow,
    known: PositionTorque | None,
    velocity_rad_s: Floats,
    inertia_kg_m2: float,
) -> Pass:
    """Take a window's valid samples out of its recording.

    Parameters
    ----------
    motion, window
        The recording, and which part of it.
    known : PositionTorque or None
        Gravity, where it has been identified.
    velocity_rad_s : ndarray, shape (n,)
        Of the whole recording, on its own samples.
    inertia_kg_m2 : float
        What a velocity that still settles costs is no friction; 0 where it is not known.
    """
    signals = motion.signals
    index = np.arange(window.start, window.stop)
    index = index[signals.valid[window.start : window.stop] & np.isfinite(velocity_rad_s[index])]
    position = None if signals.position_rad is None else signals.position_rad[index]
    torque = signals.torque_nm[index]
    if inertia_kg_m2 > 0.0 and index.size >= 2 * _TREND_PIECES:
        torque = torque - inertia_kg_m2 * _settling(velocity_rad_s[index], signals.time_s[index])
    if position is None or np.ptp(position) == 0.0:
        smooth = np.zeros_like(torque)
    elif known is not None and (known.gravity_sin_nm or known.gravity_cos_nm):
        smooth = np.asarray(known.at(position, signals.gear_ratio), dtype=np.float64)
    else:
        # Gravity is not known: its slope along the pass stands in.
        x = position - position.mean()
        smooth = x * float(x @ torque / (x @ x))
    return Pass(
        window.velocity_rad_s,
        window.velocity_error_rad_s,
        torque,
        position,
        smooth,
        signals.gear_ratio,
        float(np.median(np.diff(signals.time_s[index]))) if index.size > 1 else 1.0,
        temperature_degc=_mean_temperature(signals.gearbox_temperature_degc, index),
    )


def _mean_temperature(temperature_degc: Floats | None, index: NDArray[np.intp]) -> float:
    """Return the mean of the samples that have a temperature; NaN for none."""
    known = np.empty(0) if temperature_degc is None else temperature_degc[index]
    known = known[np.isfinite(known)]
    return float(known.mean()) if known.size else math.nan


def _settling(velocity_rad_s: Floats, time_s: Floats) -> Floats:
    """Return the slow acceleration within a window, in rad/s^2, shape (n,).

    Slopes between the means of a few equal pieces: what a loop that still settles leaves, without
    the arm's ringing and without the noise.
    """
    pieces = np.array_split(np.arange(velocity_rad_s.shape[0]), _TREND_PIECES)
    at_s = np.array([time_s[i].mean() for i in pieces])
    level = np.array([velocity_rad_s[i].mean() for i in pieces])
    slope = np.diff(level) / np.diff(at_s)
    return np.interp(time_s, 0.5 * (at_s[1:] + at_s[:-1]), slope)


def with_correlation(groups: Sequence[Sequence[Pass]]) -> list[list[Pass]]:
    """Give every pass the correlation time of its noise.

    A speed whose passes last for many correlation times knows it by itself, and ripple makes it
    differ from speed to speed. Shorter passes take the median over all speeds where it is longer.
    """
    own_s = [
        correlation_time([p.torque_nm - p.smooth_nm for p in group]) * group[0].period_s
        for group in groups
    ]
    typical_s = float(np.median(own_s)) if own_s else 0.0
    out = []
    for group, own in zip(groups, own_s, strict=True):
        seconds = own
        shortest_s = min(p.torque_nm.size * p.period_s for p in group)
        if shortest_s < _MANY_CORRELATION_TIMES * max(own, typical_s):
            seconds = max(own, typical_s)
        out.append([replace(p, correlation_samples=seconds / p.period_s) for p in group])
    return out


def mean_of(p: Pass) -> Mean:
    """Return a pass's mean torque at the middle of its positions.

    The torque's known change along the positions is no noise, and makes passes comparable whose
    samples lie unevenly over the same range.
    """
    variance, dof = variance_of_mean(p.torque_nm - p.smooth_nm, p.correlation_samples)
    value = float(p.torque_nm.mean())
    if p.position_rad is not None and np.ptp(p.position_rad) > 0.0:
        grid = np.linspace(*p.range_rad, 33)
        order = np.argsort(p.position_rad)
        even = np.interp(grid, p.position_rad[order], p.smooth_nm[order])
        value += float(even.mean() - p.smooth_nm.mean())
    return Mean(value, variance, dof, p.torque_nm.size)


def pool(means: Sequence[Mean]) -> Mean | None:
    """Average means of equal weight; scatter between them counts where it is the larger."""
    if not means:
        return None
    count = len(means)
    values = np.array([m.value for m in means])
    inside = float(sum(m.variance for m in means)) / count**2
    dof = satterthwaite([(m.variance, m.dof) for m in means])
    if count > 1:
        between = float(np.var(values, ddof=1)) / count
        if between > inside:
            inside, dof = between, count - 1.0
    return Mean(float(values.mean()), inside, dof, sum(m.samples for m in means))


def satterthwaite(parts: Sequence[tuple[float, float]]) -> float:
    """Return the degrees of freedom of a sum of variances (Welch and Satterthwaite)."""
    total = sum(variance for variance, _ in parts)
    below = sum(variance**2 / max(dof, 1.0) for variance, dof in parts)
    return total**2 / below if below > 0.0 else float(sum(dof for _, dof in parts))
