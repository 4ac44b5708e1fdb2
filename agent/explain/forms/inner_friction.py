"""A gear that holds a part of its twist, as the flexspline of a harmonic drive does.

Its spring is stiffer right after every turn of the twist, and what it holds then is lost: the swing
dies away by as much each time instead of by the same share, and is faster the smaller it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.arm import (
    ARM_REACHES,
    Limits,
    bears_the_weight,
    friction_entry,
    friction_limits,
    likely_spring,
    other_reaches,
    same_friction,
    slowing_rad_s2,
    spring_entry,
    stiffer_than_weight,
    swing_limits,
)
from agent.explain.forms.downhill import downhill
from agent.explain.forms.form import Form, Point, Proportional, stack
from agent.explain.forms.hidden_arm import HiddenArm
from agent.explain.forms.twin_law import best_entry
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_HELD = 0.5  # of the spring's own stiffness, at first: harmonic drives hold a tenth to the half
_TRAVELS = ((0.2, 0.2), (0.6, 0.5), (2.0, 0.8))  # of a hard twist; how much it stiffens the swing
_HARD_SHARE = 0.95  # of the samples are gentler
_TRIALS = 30
_MOST_HELD = 10.0  # of the spring's own stiffness: harder, it is the gear's spring itself
_FURTHEST = 30.0  # twists under a hard load: inner friction that gives way no sooner is a spring
_FRICTIONS = (0.15, 0.5)  # of the joint's, the arm's, at first
_NUMBERS = ("antiresonance_hz", "damping_ratio", "held_share", "hysteresis_travel_rad")
_RUBBING = (*_NUMBERS, "friction_share", "friction_reach_rad")


def _grid(scene: Scene) -> Sequence[Point]:
    coarse = _coarse(scene)
    return (*coarse, *downhill(scene, _column, coarse, _limits(scene), _TRIALS))


def _coarse(scene: Scene) -> list[Point]:
    """Return the likeliest spring without inner friction as it might be with it."""
    return [
        (hertz / math.sqrt(1.0 + gives * _HELD), damping, _HELD, travel * twist)
        for hertz, damping in likely_spring(scene)
        for twist in (_hard_twist_rad(scene, hertz),)
        for travel, gives in _TRAVELS
    ]


def _hard_twist_rad(scene: Scene, frequency_hz: float) -> float:
    """Return by how much a hard load twists such a spring, seen from the motor."""
    hard = float(np.quantile(np.abs(scene.stiff_rad_s2), _HARD_SHARE))
    return max(hard, 1e-300) / (2.0 * math.pi * frequency_hz) ** 2


def _limits(scene: Scene) -> Limits:
    swing, damping = swing_limits(scene)
    widest = _FURTHEST * _hard_twist_rad(scene, swing[0])
    return (swing, damping, (0.0, _MOST_HELD), (1e-9, widest))


def _step(scene: Scene) -> Point:
    del scene
    return tuple(Proportional(share) for share in (0.2, 0.5, 0.3, 0.3))


def _column(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind such a spring, over its inertia, shape (N, 1)."""
    hertz, damping, share, travel = point
    holds = share * (2.0 * math.pi * hertz) ** 2 * travel
    arm = HiddenArm(hertz, damping, holds_rad_s2=holds, travel_rad=travel)
    return stack(arm.extra_rad_s2(scene))


def _rubbing_grid(scene: Scene) -> Sequence[Point]:
    reach_rad = ARM_REACHES[0] * scene.table.gear_ratio
    coarse = [(*point, share, reach_rad) for point in _coarse(scene) for share in _FRICTIONS]
    return (*coarse, *downhill(scene, _rubbing, coarse, _rubbing_limits(scene), _TRIALS))


def _rubbing_limits(scene: Scene) -> Limits:
    return (*_limits(scene), *friction_limits(scene))


def _rubbing_step(scene: Scene) -> Point:
    return (*_step(scene), Proportional(0.2), Proportional(0.5))


def _rubbing(scene: Scene, point: Point) -> Floats:
    """Return the torque of such an arm with dry friction of its own, over its inertia, (N, 1)."""
    hertz, damping, share, travel, friction, reach = point
    holds = share * (2.0 * math.pi * hertz) ** 2 * travel
    friction_rad_s2 = friction * slowing_rad_s2(scene)
    arm = HiddenArm(hertz, damping, friction_rad_s2, reach, holds_rad_s2=holds, travel_rad=travel)
    return stack(arm.extra_rad_s2(scene))


def _same_friction(before: Scene, now: Scene, point: Point) -> Point:
    """Return the point at which an arm has the friction that it had beside other numbers."""
    return (*point[:4], same_friction(before, now, point[4]), point[5])


def _twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    says = values["arm_inertia_kg_m2"] * _column(scene, tuple(values[n] for n in _NUMBERS))[:, 0]
    return best_entry(scene, "joint-flexibility", [_spring(scene, values)], says)


def _rubbing_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    holds = _spring(scene, values)
    says = values["arm_inertia_kg_m2"] * _rubbing(scene, tuple(values[n] for n in _RUBBING))[:, 0]
    rubs = {**holds, **friction_entry(scene, values)}
    return best_entry(scene, "joint-flexibility", [rubs, holds], says)


def _spring(scene: Scene, values: Mapping[str, float]) -> dict[str, float]:
    """Return a spring's numbers, and those of its inner friction, as the twin names them."""
    inertia, travel = values["arm_inertia_kg_m2"], values["hysteresis_travel_rad"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    held_nm = values["held_share"] * spring["stiffness_nm_per_rad"] * travel
    return {**spring, "hysteresis_nm": held_nm, "hysteresis_travel_rad": travel}


FORMS: tuple[Form, ...] = (
    Form(
        "joint-flexibility",
        "one spring with inner friction",
        ("arm_inertia_kg_m2",),
        _column,
        _NUMBERS,
        _grid,
        (1,),
        at_edges=True,
        step=_step,
        to_twin=_twin,
        borne=bears_the_weight,
        limits=_limits,
        refines=("one spring",),
    ),
    Form(
        "joint-flexibility",
        "one spring with inner friction, and an arm with friction",
        ("arm_inertia_kg_m2",),
        _rubbing,
        _RUBBING,
        _rubbing_grid,
        (1,),
        at_edges=True,
        step=_rubbing_step,
        to_twin=_rubbing_twin,
        borne=bears_the_weight,
        limits=_rubbing_limits,
        refines=(
            "one spring",
            "one spring, and an arm with friction",
            "one spring with inner friction",
        ),
        rests_on_numbers=True,
        same_beside=_same_friction,
        elsewhere=other_reaches,
    ),
)
