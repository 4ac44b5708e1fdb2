"""A gear whose spring is stiffer the more it is twisted, as a harmonic drive's is.

What the cube adds depends on how far the spring is wound up, and so on the weight that hangs on it:
the arm's share of the inertia is one of its numbers, where a linear spring needs none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from agent.explain.forms.arm import (
    ARM_REACHES,
    bears_the_weight,
    friction_entry,
    friction_limits,
    other_reaches,
    same_friction,
    slowing_rad_s2,
    spring_entry,
    stiffer_than_weight,
    swing_limits,
)
from agent.explain.forms.downhill import downhill
from agent.explain.forms.form import Form, Point, Proportional, stack
from agent.explain.forms.hidden_arm import HiddenArm, inertia_of
from agent.explain.forms.twin_law import best_entry
from agent.explain.rows.scene import Scene, log_grid
from agent.identify.result import Floats

_STIFFENED = (0.3, 2.0)  # times stiffer, at the twist of a linear spring under the hardest load
_MOST_STIFFENED = 100.0
_HARDEST_SHARE = 0.99  # of the samples are gentler
_ARM = 0.6  # of the inertia, at first
_TRIALS = 36
_FRICTIONS = (0.4, 0.8)  # of the joint's, the arm's, at first
_NUMBERS = ("antiresonance_hz", "damping_ratio", "stiffening_per_rad2", "arm_share")
_RUBBING = (*_NUMBERS, "friction_share", "friction_reach_rad")


def _grid(scene: Scene) -> Sequence[Point]:
    coarse = _coarse(scene)
    return (*coarse, *downhill(scene, _column, coarse, _limits(scene), _TRIALS))


def _coarse(scene: Scene) -> list[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    return [
        (hertz, (0.05, 0.15)[i % 2], times / _linear_twist_rad(scene, hertz) ** 2, _ARM)
        for i, hertz in enumerate(log_grid(max(1.0, highest / 15.0), highest, 7))
        for times in _STIFFENED
    ]


def _linear_twist_rad(scene: Scene, frequency_hz: float) -> float:
    """Return by how much the hardest load would twist a linear spring, seen from the motor."""
    load = np.abs(scene.stiff_rad_s2 + scene.weight_nm / (_ARM * inertia_of(scene)))
    hardest = float(np.quantile(load, _HARDEST_SHARE))
    return max(hardest, 1e-300) / (2.0 * np.pi * frequency_hz) ** 2


def _limits(scene: Scene) -> Sequence[tuple[float, float]]:
    swing, damping = swing_limits(scene)
    softest = _linear_twist_rad(scene, swing[1])
    return (swing, damping, (0.0, _MOST_STIFFENED / softest**2), (0.02, 1.0))


def _step(scene: Scene) -> Point:
    # Without a weight nothing hangs on the spring whose own inertia would tell.
    bears = bool(np.any(scene.weight_nm))
    share = Proportional(0.1) if bears else 0.0
    return Proportional(0.2), Proportional(0.5), Proportional(0.5), share


def _column(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind a stiffening spring, over its inertia, shape (N, 1)."""
    hertz, damping, stiffening, share = point
    arm = HiddenArm(hertz, damping, inertia_share=share, stiffening_per_rad2=stiffening)
    return stack(arm.extra_rad_s2(scene))


def _rubbing_grid(scene: Scene) -> Sequence[Point]:
    reach_rad = ARM_REACHES[0] * scene.table.gear_ratio
    return [(*p, share, reach_rad) for p, share in zip(_coarse(scene), cycle(_FRICTIONS))]


def _rubbing_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*_limits(scene), *friction_limits(scene))


def _rubbing_step(scene: Scene) -> Point:
    return (*_step(scene), Proportional(0.2), Proportional(0.5))


def _rubbing(scene: Scene, point: Point) -> Floats:
    """Return the torque of such an arm with dry friction of its own, over its inertia, (N, 1)."""
    hertz, damping, stiffening, share, friction, reach = point
    arm = HiddenArm(
        hertz,
        damping,
        friction * slowing_rad_s2(scene),
        reach,
        inertia_share=share,
        stiffening_per_rad2=stiffening,
    )
    return stack(arm.extra_rad_s2(scene))


def _same_friction(before: Scene, now: Scene, point: Point) -> Point:
    """Return the point at which an arm has the friction that it had beside other numbers."""
    return (*point[:4], same_friction(before, now, point[4]), point[5])


def _rubbing_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    stiffens = _spring(scene, values)
    says = values["arm_inertia_kg_m2"] * _rubbing(scene, tuple(values[n] for n in _RUBBING))[:, 0]
    rubs = {**stiffens, **friction_entry(scene, values)}
    return best_entry(scene, "joint-flexibility", [rubs, stiffens], says)


def _twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    says = values["arm_inertia_kg_m2"] * _column(scene, tuple(values[n] for n in _NUMBERS))[:, 0]
    return best_entry(scene, "joint-flexibility", [_spring(scene, values)], says)


def _spring(scene: Scene, values: Mapping[str, float]) -> dict[str, float]:
    """Return a stiffening spring's numbers as the twin names them."""
    inertia = values["arm_inertia_kg_m2"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    cube = values["stiffening_per_rad2"] * spring["stiffness_nm_per_rad"]
    return {**spring, "cubic_stiffness_nm_per_rad3": max(cube, 0.0)}


FORMS: tuple[Form, ...] = (
    Form(
        "joint-flexibility",
        "one stiffening spring",
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
        "one stiffening spring, and an arm with friction",
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
        refines=("one spring", "one spring, and an arm with friction", "one stiffening spring"),
        rests_on_numbers=True,
        same_beside=_same_friction,
        elsewhere=other_reaches,
    ),
)
