"""The arm behind a spring, simulated at full rate behind the measured motor motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from agent.explain.forms.downhill import downhill
from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.grid import log_grid
from agent.explain.forms.hidden_arm import HiddenArm, inertia_of
from agent.explain.forms.twin_law import best_entry, coulomb_nm
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.twin import TwinError

ARM_REACHES = (3e-5, 3e-4)  # rad of the arm: how far its own friction gives way before it slips
_RUBBING_TRIALS = 36
_OTHER_REACHES = (0.4, 0.6, 0.8, 1.25, 1.6, 2.5)  # than an arm's own friction gives way by
_STIFFEST = 3.0  # cutoffs: a spring whose swing is faster is as good as rigid in the band
_DAMPED = 1.0  # of critical: gears swing, they do not creep
_MOST_WOUND_UP = 0.1  # rad of the arm, under its weight: belts and soft gears give way by 0.02
ALL_FRICTION = 1.2  # the arm's share of what the refitted twin has, which may be a little low

_SWING_TRIALS, _DAMPED_AT_FIRST = 14, 0.05
_SAYS_MUCH = 0.1  # of what is left
_LITTLE = 0.1  # of the joint's friction, the arm's


_RUBBING = ("antiresonance_hz", "damping_ratio", "friction_share", "friction_reach_rad")

Limits = Sequence[tuple[float, float]]

_LIKELY: WeakKeyDictionary[Scene, tuple[Point, ...]] = WeakKeyDictionary()


def _swing_grid(scene: Scene) -> Sequence[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    frequencies = log_grid(max(1.0, highest / 15.0), highest, 8)
    return tuple((f, d) for f in frequencies for d in (0.03, 0.1, 0.3))


def swing_limits(scene: Scene) -> Limits:
    """Return between which a swing's frequency, Hz, and its damping ratio are looked for."""
    return ((0.1, _STIFFEST * scene.table.cutoff_hz), (1e-3, _DAMPED))


def likely_spring(scene: Scene) -> tuple[Point, ...]:
    """Return frequency, Hz, and damping ratio of the likeliest swing, one point.

    Nothing where no spring alone says much of what is left: searches that begin here are dear.
    """
    if scene not in _LIKELY:
        highest = 1.5 * scene.table.cutoff_hz
        frequencies = log_grid(max(1.0, highest / 15.0), highest, 16)
        coarse = [(hertz, _DAMPED_AT_FIRST) for hertz in frequencies]
        search = coarse, swing_limits(scene), _SWING_TRIALS
        _LIKELY[scene] = downhill(scene, _flexible, *search, worth=_SAYS_MUCH)[:1]
    return _LIKELY[scene]


def _flexible(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind a spring, over its inertia, shape (N, 1)."""
    return stack(HiddenArm(*point).extra_rad_s2(scene))


def _rubbing_grid(scene: Scene) -> Sequence[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    frequencies = log_grid(max(1.0, highest / 15.0), highest, 7)
    reaches = [arm * scene.table.gear_ratio for arm in ARM_REACHES]
    coarse: list[Point] = [
        (f, (0.06, 0.2)[(i + j + k) % 2], s, r)
        for i, f in enumerate(frequencies)
        for j, s in enumerate((0.4, 1.0))
        for k, r in enumerate(reaches)
    ]
    coarse += [(*spring, _LITTLE, reaches[0]) for spring in likely_spring(scene)]
    # A soft arm's resonance is narrower than the grid, and its four numbers hang together.
    limits = _rubbing_limits(scene)
    return (*coarse, *downhill(scene, _rubbing, coarse, limits, _RUBBING_TRIALS))


def _rubbing_limits(scene: Scene) -> Limits:
    return (*swing_limits(scene), *friction_limits(scene))


def friction_limits(scene: Scene) -> Limits:
    """Return between which an arm's share of the friction and its reach, rad, are looked for."""
    widest = 100.0 * ARM_REACHES[-1] * scene.table.gear_ratio
    return ((0.0, ALL_FRICTION), (1e-9, widest))


def _rubbing(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm with dry friction behind a spring, over its inertia, (N, 1)."""
    frequency_hz, damping, share, reach = point
    arm = HiddenArm(frequency_hz, damping, share * slowing_rad_s2(scene), reach)
    return stack(arm.extra_rad_s2(scene))


def other_reaches(scene: Scene, point: Point, far: bool) -> Sequence[Point]:
    """Return the same arm with friction that gives way by less, and by more.

    An arm that swings sticks once more or less as that changes: the error has several valleys.
    """
    del far
    *arm, reach = point
    low, high = friction_limits(scene)[1]
    others = (factor * reach for factor in _OTHER_REACHES)
    return tuple((*arm, other) for other in others if low <= other <= high)


def slowing_rad_s2(scene: Scene) -> float:
    """Return how fast dry friction alone would slow the joint, rad/s2."""
    return max(float(scene.theta[2]), 0.0) / inertia_of(scene)


def _same_friction(before: Scene, now: Scene, point: Point) -> Point:
    """Return the point at which an arm has the friction that it had beside other numbers."""
    return (*point[:2], same_friction(before, now, point[2]), *point[3:])


def same_friction(before: Scene, now: Scene, share: float) -> float:
    """Return the share of the joint's friction that a share was beside other numbers."""
    ratio = slowing_rad_s2(before) / max(slowing_rad_s2(now), 1e-300)
    return min(ratio * share, ALL_FRICTION)


def _flexible_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    inertia = values["arm_inertia_kg_m2"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    return (spring,)


def _rubbing_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    inertia = values["arm_inertia_kg_m2"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    point = tuple(values[name] for name in _RUBBING)
    says = inertia * _rubbing(scene, point)[:, 0]
    rubs = {**spring, **friction_entry(scene, values)}
    return best_entry(scene, "joint-flexibility", [rubs, spring], says)


def friction_entry(scene: Scene, values: Mapping[str, float]) -> dict[str, float]:
    """Return the friction of an arm behind a spring as the twin names it."""
    share = max(values["friction_share"], 0.0) * values["arm_inertia_kg_m2"] / inertia_of(scene)
    return {
        "arm_coulomb_nm": share * coulomb_nm(scene),
        "arm_yield_rad": values["friction_reach_rad"],
    }


def spring_entry(inertia: float, frequency_hz: float, damping: float) -> dict[str, float]:
    """Return a spring's numbers as the twin names them."""
    omega = 2.0 * math.pi * frequency_hz
    return {
        "arm_inertia_kg_m2": inertia,
        "stiffness_nm_per_rad": inertia * omega**2,
        "damping_nm_s_per_rad": 2.0 * damping * inertia * omega,
    }


def stiffer_than_weight(scene: Scene, spring: Mapping[str, float]) -> None:
    """Refuse a spring that the arm's weight would wind up by what no gear gives way.

    What swings so softly is another axis that its own drive holds, or a tool; the arm, with all of
    its weight on such a spring, would hang at another angle than the recordings say.
    """
    twist_arm_rad = _wound_up_arm_rad(scene, spring["stiffness_nm_per_rad"])
    if not twist_arm_rad < _MOST_WOUND_UP:
        raise TwinError(f"a spring that the arm's weight winds up by {twist_arm_rad:.2g} rad")


def _wound_up_arm_rad(scene: Scene, stiffness_nm_per_rad: float) -> float:
    """Return by how much the arm's weight would wind up a spring, rad of the arm."""
    weight_nm = float(np.hypot(*scene.theta[3:5]))
    return weight_nm / max(stiffness_nm_per_rad, 1e-300) / scene.table.gear_ratio


def bears_the_weight(scene: Scene, point: Point, coefficients: Floats) -> bool:
    """Return whether a spring is one that the arm's weight may hang on, its inertia (1,)."""
    stiffness = float(coefficients[0]) * (2.0 * math.pi * point[0]) ** 2
    return _wound_up_arm_rad(scene, stiffness) < _MOST_WOUND_UP


FORMS: tuple[Form, ...] = (
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
        borne=bears_the_weight,
        limits=swing_limits,
    ),
    Form(
        "joint-flexibility",
        "one spring, and an arm with friction",
        ("arm_inertia_kg_m2",),
        _rubbing,
        _RUBBING,
        _rubbing_grid,
        (1,),
        at_edges=True,
        to_twin=_rubbing_twin,
        borne=bears_the_weight,
        limits=_rubbing_limits,
        rests_on_numbers=True,
        same_beside=_same_friction,
        elsewhere=other_reaches,
    ),
)
