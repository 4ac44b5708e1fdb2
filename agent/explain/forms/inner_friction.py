"""A gear that holds a part of its twist, as the flexspline of a harmonic drive does.

Its spring is stiffer right after every turn of the twist, and what it holds then is lost: the swing
dies away by as much each time instead of by the same share, and is faster the smaller it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from agent.explain.forms.arm import (
    ARM_REACHES,
    Limits,
    likely_spring,
    spring_entry,
    stiffer_than_weight,
    swing_limits,
)
from agent.explain.forms.downhill import downhill
from agent.explain.forms.form import Point, Proportional
from agent.explain.forms.gears import Gear
from agent.explain.forms.hidden_arm import HiddenArm
from agent.explain.rows.scene import Scene
from agent.physics.twin import TwinError

_HELD = 0.5  # of the spring's own stiffness, at first: harmonic drives hold a tenth to the half
_TRAVELS = ((0.2, 0.2), (0.6, 0.5), (2.0, 0.8))  # of a hard twist; how much it stiffens the swing
_HARD_SHARE = 0.95  # of the samples are gentler
_TRIALS = 30
_MOST_HELD = 10.0  # of the spring's own stiffness: harder, it is the gear's spring itself
_FURTHEST = 4.0  # twists under a hard load: inner friction that gives way no sooner is a spring
_FRICTIONS = (0.15, 0.5)  # of the joint's, the arm's, at first
_NUMBERS = ("antiresonance_hz", "damping_ratio", "held_share", "hysteresis_travel_rad")


def _grid(scene: Scene) -> Sequence[Point]:
    coarse = _coarse(scene)
    return (*coarse, *downhill(scene, _GEAR.column, coarse, _limits(scene), _TRIALS))


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


def _arm(point: Point) -> HiddenArm:
    hertz, damping, share, travel = point
    holds = share * (2.0 * math.pi * hertz) ** 2 * travel
    return HiddenArm(hertz, damping, holds_rad_s2=holds, travel_rad=travel)


def _rubbing_grid(scene: Scene) -> Sequence[Point]:
    reach_rad = ARM_REACHES[0] * scene.table.gear_ratio
    coarse = [(*point, share, reach_rad) for point in _coarse(scene) for share in _FRICTIONS]
    return (*coarse, *downhill(scene, _GEAR.rubbing, coarse, _GEAR.rubbing_limits(scene), _TRIALS))


def _spring(scene: Scene, values: Mapping[str, float]) -> dict[str, float]:
    """Return a spring's numbers, and those of its inner friction, as the twin names them."""
    inertia, travel = values["arm_inertia_kg_m2"], values["hysteresis_travel_rad"]
    if travel > _FURTHEST * _hard_twist_rad(scene, values["antiresonance_hz"]):
        raise TwinError("what the gear holds gives way nowhere in this motion")
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    held_nm = values["held_share"] * spring["stiffness_nm_per_rad"] * travel
    return {**spring, "hysteresis_nm": held_nm, "hysteresis_travel_rad": travel}


_GEAR = Gear(
    "one spring with inner friction", _NUMBERS, _arm, _grid, _rubbing_grid, _limits, _step, _spring
)
FORMS = _GEAR.forms
