"""A gear whose spring is stiffer the more it is twisted, as a harmonic drive's is.

What the cube adds depends on how far the spring is wound up, and so on the weight that hangs on it:
the arm's share of the inertia is one of its numbers, where a linear spring needs none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np

from agent.explain.forms.arm import ARM_REACHES, spring_entry, stiffer_than_weight, swing_limits
from agent.explain.forms.downhill import downhill
from agent.explain.forms.form import Point, Proportional
from agent.explain.forms.gears import Gear
from agent.explain.forms.grid import log_grid
from agent.explain.forms.hidden_arm import HiddenArm, inertia_of
from agent.explain.rows.scene import Scene

_STIFFENED = (0.3, 2.0)  # times stiffer, at the twist of a linear spring under the hardest load
_MOST_STIFFENED = 100.0
_HARDEST_SHARE = 0.99  # of the samples are gentler
_ARM = 0.6  # of the inertia, at first
_TRIALS = 36
_FRICTIONS = (0.4, 0.8)  # of the joint's, the arm's, at first
_NUMBERS = ("antiresonance_hz", "damping_ratio", "stiffening_per_rad2", "arm_share")


def _grid(scene: Scene) -> Sequence[Point]:
    coarse = _coarse(scene)
    return (*coarse, *downhill(scene, _GEAR.column, coarse, _limits(scene), _TRIALS))


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


def _arm(point: Point) -> HiddenArm:
    hertz, damping, stiffening, share = point
    return HiddenArm(hertz, damping, inertia_share=share, stiffening_per_rad2=stiffening)


def _rubbing_grid(scene: Scene) -> Sequence[Point]:
    reach_rad = ARM_REACHES[0] * scene.table.gear_ratio
    return [(*p, share, reach_rad) for p, share in zip(_coarse(scene), cycle(_FRICTIONS))]


def _spring(scene: Scene, values: Mapping[str, float]) -> dict[str, float]:
    """Return a stiffening spring's numbers as the twin names them."""
    inertia = values["arm_inertia_kg_m2"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    cube = values["stiffening_per_rad2"] * spring["stiffness_nm_per_rad"]
    return {**spring, "cubic_stiffness_nm_per_rad3": max(cube, 0.0)}


_GEAR = Gear("one stiffening spring", _NUMBERS, _arm, _grid, _rubbing_grid, _limits, _step, _spring)
FORMS = _GEAR.forms
