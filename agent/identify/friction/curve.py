"""The friction curve: friction torque at each steady speed, with gravity removed (thesis 4.21).

Half the difference between a forward and a backward pass at one speed over one range of arm
positions is friction; half their sum is gravity and offset. Only the positions that both passes
cover are used. Where passes do not meet, gravity comes from the speeds whose passes do, else from
the rigid-body fit, or the speed is left out; either way a note says so. Without a recorded position
the passes are taken to cover the same range. How far a mean may be off is told by all passes
together (`pass_noise`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction.curve_point import (
    SAMPLES,
    CurvePoint,
    mean_speed,
    modelled_point,
    paired_point,
)
from agent.identify.friction.pass_blocks import TimedPass
from agent.identify.friction.pass_noise import PassNoise, Spread, noise_of
from agent.identify.friction.passes import Pass, PositionTorque, take_pass, with_correlation
from agent.identify.friction.warming import Warming, temperature_of, uneven_warmth, warming_of
from agent.identify.result import Floats, FrictionCurve
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.windows import SteadyWindow
from agent.identify.uncertainty import student_975
from agent.physics.rigid_body import gravity_columns

_SAME_SPEED = 0.035  # two passes of one step of the stair may differ by this much
_ENOUGH_MEETING = 3  # speeds whose passes meet, to learn gravity and offset from
_BEYOND = 0.02  # of the learned positions' range: a pass may reach that far out of it
_FROM_MEETING = (
    "no forward and backward pass cover the same positions; gravity and offset there come from the "
    "speeds whose passes do"
)
_FROM_BODY = (
    "no forward and backward pass cover the same positions; gravity and offset there come from the "
    "rigid-body fit"
)
_LEFT_OUT = (
    "the friction curve has no point: no forward and backward pass cover the same positions, and "
    "gravity is not known there"
)


@dataclass(frozen=True)
class SteadyMeans:
    """The mean torque of every speed and direction: what the curve was made of.

    Parameters
    ----------
    velocity_rad_s : ndarray, shape (k,)
        Signed.
    friction_nm : ndarray, shape (k,)
        Signed torque less gravity (position recorded) or less one common offset (not recorded).
    """

    velocity_rad_s: Floats
    friction_nm: Floats


@dataclass(frozen=True)
class CurveFit:
    """The friction curve and how it came about.

    `standard_error_nm`, shape (n,), belongs to the curve's points; `dof`, shape (n,), are its
    degrees of freedom. `noise` is how the points err together, where the passes tell;
    `shared_gravity` says that some stand on gravity from elsewhere, whose error they share;
    `warming` is how warm the oil may have been, where that was recorded.
    """

    curve: FrictionCurve
    standard_error_nm: Floats
    dof: Floats
    means: SteadyMeans
    notes: tuple[str, ...]
    noise: PassNoise | None = None
    shared_gravity: bool = False
    warming: Warming | None = None


def friction_curve(
    motions: Sequence[Motion],
    windows: Sequence[SteadyWindow],
    position_torque: PositionTorque | None = None,
    inertia_kg_m2: float = 0.0,
) -> CurveFit | None:
    """Return the friction curve of one axis, or None where no speed carries a point.

    Parameters
    ----------
    motions : sequence of Motion
        The recordings; `SteadyWindow.recording` counts into them.
    windows : sequence of SteadyWindow
        All their steady windows.
    position_torque : PositionTorque, optional
        For speeds whose passes do not meet.
    inertia_kg_m2 : float
        For windows in which the velocity still settles; 0 where it is not known.
    """
    velocities = [motion.own_velocity_rad_s() for motion in motions]
    passes = [
        take_pass(motions[w.recording], w, position_torque, velocities[w.recording], inertia_kg_m2)
        for w in windows
    ]
    found = [(p, w) for p, w in zip(passes, windows, strict=True) if p.torque_nm.size >= SAMPLES]
    by_speed = _by_speed([p for p, _ in found])
    noise = _noise(by_speed, found, motions)
    groups = with_correlation(by_speed)
    points: list[CurvePoint] = []
    kept: list[int] = []
    told: dict[str, list[float]] = {}
    for i, (point, note) in enumerate(_points(groups, position_torque)):
        if point is not None:
            points.append(point if noise is None else _widened(point, groups[i], noise.spreads[i]))
            kept.append(i)
        if note:
            told.setdefault(note, []).append(mean_speed(groups[i]))
    if not points:
        return None
    notes = [f"at {_speeds(speeds)} {note}" for note, speeds in told.items()]
    temperature = np.array([temperature_of(groups[i]) for i in kept])
    notes += uneven_warmth(temperature)
    fit = _assemble(points, notes, with_position=passes[0].position_rad is not None)
    shared = _FROM_MEETING in told or _FROM_BODY in told
    curve = replace(fit.curve, temperature_degc=temperature)
    warming = warming_of(motions, found, [by_speed[i] for i in kept], temperature)
    fit = replace(fit, curve=curve, shared_gravity=shared, warming=warming)
    return fit if noise is None else replace(fit, noise=noise.of(kept, fit.standard_error_nm))


def _points(
    groups: Sequence[Sequence[Pass]], position_torque: PositionTorque | None
) -> list[tuple[CurvePoint | None, str]]:
    """Return each speed's point, where it has one, and what is to be said of it.

    Where passes do not meet, gravity is taken from those that do. That from the regression is a
    last resort: it takes up whatever the rigid body lacks.
    """
    paired = [paired_point(group) for group in groups]
    learned = _learn(groups, paired)
    needy = sum(point is not None for point in paired) < _ENOUGH_MEETING
    out: list[tuple[CurvePoint | None, str]] = []
    for group, meeting in zip(groups, paired, strict=True):
        point, note = meeting, ""
        if point is None and learned is not None and learned.covers(group):
            point, note = modelled_point(group, learned.torque), _FROM_MEETING
        elif point is None and position_torque is not None and needy:
            point, note = modelled_point(group, position_torque), _FROM_BODY
        out.append((point, note if point is not None else _LEFT_OUT))
    return out


def _noise(
    by_speed: Sequence[Sequence[Pass]],
    found: Sequence[tuple[Pass, SteadyWindow]],
    motions: Sequence[Motion],
) -> PassNoise | None:
    """Return what the noise of all passes together does to every speed's friction."""
    group_of = {id(p): k for k, group in enumerate(by_speed) for p in group}
    timed = [
        TimedPass(
            p, w.recording, float(motions[w.recording].signals.time_s[w.start]), group_of[id(p)]
        )
        for p, w in found
    ]
    return noise_of(timed) if timed else None


def _widened(point: CurvePoint, group: Sequence[Pass], spread: Spread) -> CurvePoint:
    """Return the point with the error that all passes' noise gives it.

    Where the passes share a part of their positions only, fewer samples make the error larger.
    """
    used = max(point.friction.samples, 1)
    share = max(sum(p.torque_nm.size for p in group) / used, 1.0)
    variance = share * spread.standard_error_nm**2
    return replace(point, friction=replace(point.friction, variance=variance, dof=spread.dof))


@dataclass(frozen=True)
class _Learned:
    """Gravity and offset as the speeds show them whose passes meet, and where they were shown."""

    torque: PositionTorque
    lowest_rad: float
    highest_rad: float

    def covers(self, group: Sequence[Pass]) -> bool:
        """Tell whether every pass stays within the positions that were learned from."""
        slack = _BEYOND * (self.highest_rad - self.lowest_rad)
        ends = [p.range_rad for p in group]
        return all(
            low >= self.lowest_rad - slack and high <= self.highest_rad + slack
            for low, high in ends
        )


def _learn(
    groups: Sequence[Sequence[Pass]], points: Sequence[CurvePoint | None]
) -> _Learned | None:
    """Fit gravity and offset to what friction leaves of the torque where passes meet.

    On a short stroke sine, cosine and offset cannot be told apart; their sum can, within the
    positions that were covered, and only the sum is used.
    """
    known = [
        (p, point)
        for group, point in zip(groups, points, strict=True)
        if point is not None
        for p in group
        if p.position_rad is not None
    ]
    if sum(point is not None for point in points) < _ENOUGH_MEETING or not known:
        return None
    columns, left = [], []
    for p, point in known:
        assert p.position_rad is not None
        gravity = gravity_columns(p.position_rad, p.gear_ratio)
        columns.append(np.column_stack((gravity, np.ones(p.torque_nm.size))) / p.torque_nm.size)
        friction = np.sign(p.velocity_rad_s) * point.friction.value
        left.append((p.torque_nm - friction) / p.torque_nm.size)
    fitted = np.linalg.lstsq(np.concatenate(columns), np.concatenate(left), rcond=1e-6)[0]
    ends = [p.range_rad for p, _ in known]
    return _Learned(
        PositionTorque(*fitted.tolist()), min(e[0] for e in ends), max(e[1] for e in ends)
    )


def _by_speed(passes: Sequence[Pass]) -> list[list[Pass]]:
    """Group passes whose speeds agree within 3.5 % or their errors, slowest group first."""
    groups: list[list[Pass]] = []
    for p in sorted(passes, key=lambda p: abs(p.velocity_rad_s)):
        if groups:
            first = groups[-1][0]
            slower = abs(first.velocity_rad_s)
            chance = 2.5 * np.hypot(first.velocity_error_rad_s, p.velocity_error_rad_s)
            if abs(p.velocity_rad_s) - slower <= max(_SAME_SPEED * slower, chance):
                groups[-1].append(p)
                continue
        groups.append([p])
    return groups


def _assemble(points: Sequence[CurvePoint], notes: list[str], *, with_position: bool) -> CurveFit:
    """Put the points side by side, slowest first."""
    if not with_position:
        notes.append(
            "no position was recorded: forward and backward passes are taken to cover the same "
            "range of the arm"
        )
    common = float(np.mean([p.gravity_nm for p in points]))
    velocity, friction = [], []
    for p in points:
        gravity = p.gravity_nm if with_position else common
        for side in (p.forward, p.backward):
            if side is not None:
                velocity.append(side[0])
                friction.append(side[1] - gravity)
    order = np.argsort(velocity)
    error = np.sqrt([p.friction.variance for p in points])
    dof = np.array([p.friction.dof for p in points])
    value = np.array([p.friction.value for p in points])
    reach = error * np.array([student_975(d) for d in dof])
    samples: NDArray[np.int64] = np.array([p.friction.samples for p in points], dtype=np.int64)
    curve = FrictionCurve(
        velocity_rad_s=np.array([p.speed_rad_s for p in points]),
        friction_nm=value,
        ci95_nm=np.stack((value - reach, value + reach), axis=-1),
        gravity_nm=np.array([p.gravity_nm for p in points]),
        samples=samples,
    )
    means = SteadyMeans(np.array(velocity)[order], np.array(friction)[order])
    return CurveFit(curve, error, dof, means, tuple(notes))


def _speeds(values: Sequence[float]) -> str:
    """Return speeds in words: at most four, then a count."""
    shown = ", ".join(f"{v:.3g}" for v in values[:4])
    more = f" and {len(values) - 4} more" if len(values) > 4 else ""
    return f"{shown}{more} rad/s"
