"""A gear whose spring is stiffer the more it is twisted, as a harmonic drive's is.

What the cube adds depends on how far the spring is wound up, and so on the weight that hangs on it:
the arm's share of the inertia is one of its numbers, where a linear spring needs none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.arm import (
    bears_the_weight,
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
_NUMBERS = ("antiresonance_hz", "damping_ratio", "stiffening_per_rad2", "arm_share")


def _grid(scene: Scene) -> Sequence[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    coarse = [
        (hertz, (0.05, 0.15)[i % 2], times / _linear_twist_rad(scene, hertz) ** 2, _ARM)
        for i, hertz in enumerate(log_grid(max(1.0, highest / 15.0), highest, 7))
        for times in _STIFFENED
    ]
    return (*coarse, *downhill(scene, _column, coarse, _limits(scene), _TRIALS))


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


def _twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    inertia = values["arm_inertia_kg_m2"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    cube = values["stiffening_per_rad2"] * spring["stiffness_nm_per_rad"]
    says = inertia * _column(scene, tuple(values[name] for name in _NUMBERS))[:, 0]
    stiffening = {**spring, "cubic_stiffness_nm_per_rad3": max(cube, 0.0)}
    return best_entry(scene, "joint-flexibility", [stiffening], says)


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
)
