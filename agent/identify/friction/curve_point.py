"""One speed of the friction curve from its passes: which of them meet, and what they make (4.21).

Half the difference of a forward and a backward pass is friction, half their sum gravity and offset,
but only over the positions that both have covered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.friction.passes import Mean, Pass, PositionTorque, mean_of, pool, satterthwaite
from agent.identify.uncertainty import variance_of_mean

SAMPLES = 8  # a pass of fewer carries no mean
_OVERLAP = 0.3  # of the shorter pass: less common range is not the same place


@dataclass(frozen=True)
class CurvePoint:
    """One speed of the curve."""

    speed_rad_s: float
    friction: Mean
    gravity_nm: float
    forward: tuple[float, float] | None  # velocity and torque less nothing
    backward: tuple[float, float] | None


def paired_point(group: Sequence[Pass]) -> CurvePoint | None:
    """Return the point that forward and backward passes of one speed make, if they meet."""
    forward = [p for p in group if p.velocity_rad_s > 0.0]
    backward = [p for p in group if p.velocity_rad_s < 0.0]
    if not forward or not backward:
        return None
    if any(p.position_rad is None for p in group):
        return _point(group, [(forward, backward)])
    lower = max(p.range_rad[0] for p in group)
    upper = min(p.range_rad[1] for p in group)
    if upper - lower >= _OVERLAP * min(p.range_rad[1] - p.range_rad[0] for p in group):
        cut = [[p.within(lower, upper) for p in side] for side in (forward, backward)]
        return _point(group, [(cut[0], cut[1])])
    return _point(group, _meeting(forward, backward))


def _meeting(
    forward: Sequence[Pass], backward: Sequence[Pass]
) -> list[tuple[list[Pass], list[Pass]]]:
    """Pair off passes that cover the same place, longest common range first."""
    options = []
    for i, f in enumerate(forward):
        for j, b in enumerate(backward):
            lower = max(f.range_rad[0], b.range_rad[0])
            upper = min(f.range_rad[1], b.range_rad[1])
            shorter = min(np.ptp(f.range_rad), np.ptp(b.range_rad))
            if upper - lower >= _OVERLAP * shorter > 0.0:
                options.append((upper - lower, i, j, lower, upper))
    taken_f: set[int] = set()
    taken_b: set[int] = set()
    pairs = []
    for _, i, j, lower, upper in sorted(options, reverse=True):
        if i not in taken_f and j not in taken_b:
            taken_f.add(i)
            taken_b.add(j)
            pairs.append(([forward[i].within(lower, upper)], [backward[j].within(lower, upper)]))
    return pairs


def _point(
    group: Sequence[Pass], pairs: Sequence[tuple[Sequence[Pass], Sequence[Pass]]]
) -> CurvePoint | None:
    """Average (4.21) over places, each with forward and backward passes."""
    halves, gravities, forwards, backwards = [], [], [], []
    for forward, backward in pairs:
        ahead = pool([mean_of(p) for p in forward if p.torque_nm.size >= SAMPLES])
        back = pool([mean_of(p) for p in backward if p.torque_nm.size >= SAMPLES])
        if ahead is None or back is None:
            continue
        variance = (ahead.variance + back.variance) / 4.0
        dof = satterthwaite([(ahead.variance, ahead.dof), (back.variance, back.dof)])
        halves.append(
            Mean((ahead.value - back.value) / 2.0, variance, dof, ahead.samples + back.samples)
        )
        gravities.append((ahead.value + back.value) / 2.0)
        forwards.append(ahead.value)
        backwards.append(back.value)
    friction = pool(halves)
    if friction is None:
        return None
    v_forward = float(np.mean([p.velocity_rad_s for p in group if p.velocity_rad_s > 0.0]))
    v_backward = float(np.mean([p.velocity_rad_s for p in group if p.velocity_rad_s < 0.0]))
    return CurvePoint(
        speed_rad_s=(v_forward - v_backward) / 2.0,
        friction=friction,
        gravity_nm=float(np.mean(gravities)),
        forward=(v_forward, float(np.mean(forwards))),
        backward=(v_backward, float(np.mean(backwards))),
    )


def modelled_point(group: Sequence[Pass], position_torque: PositionTorque) -> CurvePoint | None:
    """Return a point whose gravity comes from the model, from passes that do not meet."""
    means, gravities = [], []
    for p in group:
        gravity = position_torque.at(p.position_rad, p.gear_ratio)
        sign = float(np.sign(p.velocity_rad_s))
        values = np.asarray(sign * (p.torque_nm - gravity), dtype=np.float64)
        variance, dof = variance_of_mean(values, p.correlation_samples)
        means.append(Mean(float(values.mean()), variance, dof, values.size))
        gravities.append(float(np.mean(gravity)))
    friction = pool(means)
    if friction is None:
        return None
    speed = mean_speed(group)
    gravity_nm = float(np.mean(gravities))
    sides = {float(np.sign(p.velocity_rad_s)) for p in group}
    return CurvePoint(
        speed_rad_s=speed,
        friction=friction,
        gravity_nm=gravity_nm,
        forward=(speed, gravity_nm + friction.value) if 1.0 in sides else None,
        backward=(-speed, gravity_nm - friction.value) if -1.0 in sides else None,
    )


def mean_speed(group: Sequence[Pass]) -> float:
    """Return the mean speed of passes of both directions, rad/s."""
    return float(np.mean([abs(p.velocity_rad_s) for p in group]))
