"""What has a memory: presliding, the arm behind a spring or a gap, late channels, clipped torque.

Hidden states are simulated at full rate behind the measured motor motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from agent.explain.form import Form, Point
from agent.explain.forms_sliding import stack
from agent.explain.hidden_arm import HiddenArm, inertia_of
from agent.explain.load_changes import arm_shares
from agent.explain.saturation import saturation_evidence
from agent.explain.scene import Scene, log_grid
from agent.explain.twin_law import best_entry
from agent.identify.result import Floats
from agent.physics.presliding import MaxwellSlip

_DELAYS_S = tuple(1e-3 * d for d in (-16, -8, -4, -2, -1, 1, 2, 4, 8, 16))
_NEAR = np.geomspace(0.4, 2.5, 7)  # of a found travel: what the twin's law may need
_SHORTEST_DELAY_S = 2e-4
_ARM_REACHES = (3e-5, 3e-4)  # rad of the arm: how far its own friction gives way before it slips
_WIDEST_ARM_GAP = 2e-3  # rad of the arm, half of a worn planetary gear's
_GAPS, _PLACES = 18, 2


def _presliding_grid(scene: Scene) -> Sequence[Point]:
    arm = log_grid(3e-5, 2e-2, 9)
    return tuple((reach * scene.table.gear_ratio,) for reach in arm)


def _presliding(scene: Scene, point: Point) -> Floats:
    """Return a rate-independent hysteresis of unit height, less the sign it settles to."""
    return stack(hysteresis(scene, point[0]) - scene.direction)


def hysteresis(scene: Scene, reach_rad: float) -> Floats:
    """Return Dahl's state on the measured motion, from -1 to 1, shape (N,).

    Between reversals ``z = s + (z0 - s) exp(-travel / reach)``: exact for any sampling.
    """
    out = np.zeros(scene.direction.shape[0])
    for at, period_s in scene.each_piece():
        velocity = scene.full("velocity_rad_s")[at]
        out[at] = _relaxed(velocity, period_s, reach_rad)
    return out


def _relaxed(velocity: Floats, period_s: float, reach_rad: float) -> Floats:
    sign = np.sign(velocity)
    starts = np.flatnonzero(np.diff(sign, prepend=sign[0]) != 0.0)
    edges = np.concatenate(([0], starts, [sign.shape[0]]))
    travel = np.cumsum(np.abs(velocity)) * period_s
    out = np.empty_like(velocity)
    state = 0.0
    for begin, end in pairwise(edges):
        if end <= begin:
            continue
        settled = sign[begin]
        way = travel[begin:end] - (travel[begin - 1] if begin else 0.0)
        part = settled + (state - settled) * np.exp(-way / reach_rad)
        out[begin:end] = part if settled else state
        state = float(out[end - 1])
    return out


def _presliding_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the spring that yields at the twin's own dry level, not at the form's height."""
    level = max(float(scene.theta[2]), 0.0)
    reaches = values["reach_rad"] * _NEAR
    entries = [{"stiffness_nm_per_rad": level / float(r)} for r in reaches if level > 0.0]
    return best_entry(scene, "presliding-hysteresis", entries)


def _slipping_grid(scene: Scene) -> Sequence[Point]:
    arm = log_grid(3e-5, 5e-2, 9)
    return tuple((travel * scene.table.gear_ratio, p) for travel in arm for p in (1.0, 2.0, 3.5))


def _slipping(scene: Scene, point: Point) -> Floats:
    """Return a chain of slipping springs of unit height, less the sign it settles to, (N, 1)."""
    from agent.physics.kernels import slipping

    stiffness, level = MaxwellSlip(point[0], max(point[1], 1.0)).elements()
    out = np.zeros(scene.direction.shape[0])
    for at, _ in scene.each_piece():
        time, velocity = scene.full("time_s")[at], scene.full("velocity_rad_s")[at]
        start = float(scene.direction[at][0])
        out[at] = slipping(time.copy(), velocity.copy(), stiffness, level, start)
    return stack(out - scene.direction)


def _slipping_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the chain that slips at the twin's own dry level, not at the form's height."""
    exponents = {max(values["shape_exponent"], 1.0), 2.0}
    entries = [
        {"sliding_travel_rad": float(travel), "shape_exponent": exponent}
        for travel in values["sliding_travel_rad"] * _NEAR
        for exponent in exponents
    ]
    return best_entry(scene, "presliding-hysteresis", entries)


def _delay_grid(scene: Scene) -> Sequence[Point]:
    del scene
    return tuple((d,) for d in _DELAYS_S)


def _delay(scene: Scene, point: Point) -> Floats:
    """Return the refitted torque, later by a trial delay, less itself, over the trial, (N, 1).

    Its coefficient is the torque's delay, below zero where the motion is the late one; the trial
    only bends the column, to the second order of how far it is from the delay.
    """
    trial_s = math.copysign(max(abs(point[0]), _SHORTEST_DELAY_S), point[0])
    out = np.zeros(scene.direction.shape[0])
    for at, _ in scene.each_piece():
        time, torque = scene.full("time_s")[at], scene.predicted_nm[at]
        out[at] = (np.interp(time - trial_s, time, torque) - torque) / trial_s
    return stack(out)


def _delay_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return ({"torque_delay_s": values["torque_delay_s"]},)


def _limit_grid(scene: Scene) -> Sequence[Point]:
    """Return the torque at which the drive clips, if there are signs of it."""
    evidence = saturation_evidence(scene.table)
    return () if evidence is None else ((evidence.limit_nm,),)


def _saturation(scene: Scene, point: Point) -> Floats:
    """Return what a limit takes from the refitted torque, shape (N, 1)."""
    torque = scene.predicted_nm
    return stack(np.clip(torque, -point[0], point[0]) - torque)


def _saturation_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return ({"limit_nm": values["limit_nm"]},)


def _swing_grid(scene: Scene) -> Sequence[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    frequencies = log_grid(max(1.0, highest / 15.0), highest, 8)
    return tuple((f, d) for f in frequencies for d in (0.03, 0.1, 0.3))


def _flexible(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind a spring, over its inertia, shape (N, 1)."""
    return stack(HiddenArm(*point).extra_rad_s2(scene))


def _rubbing_grid(scene: Scene) -> Sequence[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    frequencies = log_grid(max(1.0, highest / 15.0), highest, 7)
    reaches = [arm * scene.table.gear_ratio for arm in _ARM_REACHES]
    return tuple(
        (f, (0.06, 0.2)[(i + j + k) % 2], s, r)
        for i, f in enumerate(frequencies)
        for j, s in enumerate((0.4, 1.0))
        for k, r in enumerate(reaches)
    )


def _rubbing(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm with dry friction behind a spring, over its inertia, (N, 1)."""
    frequency_hz, damping, share, reach = point
    arm = HiddenArm(frequency_hz, damping, share * _slowing(scene), reach)
    return stack(arm.extra_rad_s2(scene))


def _slowing(scene: Scene) -> float:
    """Return how fast dry friction alone would slow the joint, rad/s2."""
    return max(float(scene.theta[2]), 0.0) / inertia_of(scene)


def _flexible_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return (
        _spring_entry(
            values["arm_inertia_kg_m2"], values["antiresonance_hz"], values["damping_ratio"]
        ),
    )


def _rubbing_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    inertia = values["arm_inertia_kg_m2"]
    spring = _spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    friction = {
        "arm_coulomb_nm": max(values["friction_share"], 0.0) * _slowing(scene) * inertia,
        "arm_yield_rad": values["friction_reach_rad"],
    }
    return best_entry(scene, "joint-flexibility", [{**spring, **friction}, spring])


def _spring_entry(inertia: float, frequency_hz: float, damping: float) -> dict[str, float]:
    """Return a spring's numbers as the twin names them."""
    omega = 2.0 * math.pi * frequency_hz
    return {
        "arm_inertia_kg_m2": inertia,
        "stiffness_nm_per_rad": inertia * omega**2,
        "damping_nm_s_per_rad": 2.0 * damping * inertia * omega,
    }


def _gap_grid(scene: Scene) -> Sequence[Point]:
    """Return gaps of all sizes at the arm's likeliest shares of inertia and friction."""
    cutoff, gear = scene.table.cutoff_hz, scene.table.gear_ratio
    # A gap that is crossed faster than the band can follow leaves no trace.
    smallest = 0.1 * _slowing(scene) / (2.0 * math.pi * cutoff) ** 2
    gaps = log_grid(smallest, _WIDEST_ARM_GAP * gear, _GAPS)
    return tuple(
        (gap, share, friction, (0.7, 1.3)[k % 2] * cutoff, (0.2, 0.4)[(i + k) % 2])
        for i, (share, friction) in enumerate(arm_shares(scene, _PLACES))
        for k, gap in enumerate(gaps)
    )


def _gap(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind a gap, less that of a tight gear, over its inertia."""
    half_gap, inertia_share, friction_share, hz, damping = point
    friction = max(friction_share, 0.0) * _slowing(scene) / inertia_share
    arm = HiddenArm(
        hz, damping, friction, _ARM_REACHES[0] * scene.table.gear_ratio, half_gap, inertia_share
    )
    return stack(arm.extra_rad_s2(scene))


def _gap_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    inertia = values["arm_share"] * inertia_of(scene)
    spring = _spring_entry(inertia, values["contact_hz"], values["damping_ratio"])
    gap = {
        "half_gap_rad": values["half_gap_rad"],
        "arm_coulomb_nm": max(values["arm_friction_share"] * float(scene.theta[2]), 0.0),
        "arm_yield_rad": _ARM_REACHES[0] * scene.table.gear_ratio,
    }
    return best_entry(scene, "backlash", [{**gap, **spring}])


FORMS: tuple[Form, ...] = (
    Form(
        "presliding-hysteresis",
        "Dahl",
        ("height_nm",),
        _presliding,
        ("reach_rad",),
        _presliding_grid,
        (1,),
        at_edges=True,
        to_twin=_presliding_twin,
    ),
    Form(
        "presliding-hysteresis",
        "Maxwell slip",
        ("height_nm",),
        _slipping,
        ("sliding_travel_rad", "shape_exponent"),
        _slipping_grid,
        (1,),
        at_edges=True,
        to_twin=_slipping_twin,
    ),
    Form(
        "measurement-delay",
        "torque late or early",
        ("torque_delay_s",),
        _delay,
        ("trial_s",),
        _delay_grid,
        at_edges=True,
        to_twin=_delay_twin,
    ),
    Form(
        "torque-saturation",
        "clipped",
        ("share",),
        _saturation,
        ("limit_nm",),
        _limit_grid,
        (1,),
        refine=False,
        to_twin=_saturation_twin,
    ),
    Form(
        "joint-flexibility",
        "one spring",
        ("arm_inertia_kg_m2",),
        _flexible,
        ("antiresonance_hz", "damping_ratio"),
        _swing_grid,
        (1,),
        at_edges=True,
        to_twin=_flexible_twin,
    ),
    Form(
        "joint-flexibility",
        "one spring, and an arm with friction",
        ("arm_inertia_kg_m2",),
        _rubbing,
        ("antiresonance_hz", "damping_ratio", "friction_share", "friction_reach_rad"),
        _rubbing_grid,
        (1,),
        at_edges=True,
        to_twin=_rubbing_twin,
    ),
    Form(
        "backlash",
        "gap",
        ("arm_inertia_kg_m2",),
        _gap,
        ("half_gap_rad", "arm_share", "arm_friction_share", "contact_hz", "damping_ratio"),
        _gap_grid,
        (1,),
        needs=("position_rad",),
        at_edges=True,
        to_twin=_gap_twin,
    ),
)
