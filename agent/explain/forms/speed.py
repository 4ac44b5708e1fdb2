"""Friction over speed, direction and load: what bends, falls, differs or grows while sliding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.grid import log_grid
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.friction import boundary_share
from agent.physics.friction_oil import cross_nm, eyring_nm, power_law_nm
from agent.physics.friction_static import DirectionDependent, powered_nm

_ARM_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the inertia, behind the gear
_LOAD_FALLS = (1.0, 2.0)  # exponents
_STEEP_FALLS = (0.7, 4.0)
_ARM_FRICTION = (0.0, 0.15, 0.3, 0.45)  # of the dry friction, behind the gear
_WHOLE = ((0.5, 0.3, 0.5), (0.5, 0.3, 1.0), (1.0, 0.3, 1.0), (1.0, 1.0, 1.0))
_ALL = 1.2  # of what the refitted twin has, which may be a little low
_MOST_UNDER_LOAD = 0.6  # with more a gear passes on less than half: sqrt((1 - k)/(1 + k))
_POWERS, _HARDEST_SHARE = (0.6, 1.5, 2.0, 3.0), 0.95  # of the samples bear less
_ALL_OF_IT = 1.25  # times what friction is there: so much both directions may differ by, twice
_LEVELS_DIFFER, _SLOPES_DIFFER = DirectionDependent(1.0, 0.0), DirectionDependent(0.0, 1.0)


def _stribeck_grid(scene: Scene) -> Sequence[Point]:
    speeds = log_grid(0.5 * scene.slowest, 0.5 * scene.fastest, 12)
    return tuple((v, e) for v in speeds for e in (0.7, 1.0, 1.4, 2.0))


def _stribeck_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (0.1 * scene.slowest, scene.fastest), (0.3, 4.0)


def _stribeck(scene: Scene, point: Point) -> Floats:
    return stack(scene.direction * boundary_share(scene.speed, *point))


def _bend_grid(scene: Scene) -> Sequence[Point]:
    del scene
    return tuple((e,) for e in (0.3, 0.45, 0.6, 0.75, 1.4, 1.7, 2.0, 2.5, 3.0))


def _bend_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return the exponents of a bend: near 0 the power law is Coulomb friction by another name."""
    del scene
    return ((0.2, 4.0),)


def _bend(scene: Scene, point: Point) -> Floats:
    velocity = scene.full("velocity_rad_s")
    return stack(power_law_nm(scene.direction, velocity, scene.fastest, *point))


def _bend_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    return ({**values, "reference_velocity_rad_s": scene.fastest},)


def _shear_grid(scene: Scene) -> Sequence[Point]:
    """Return where a bend by shear begins: from the slowest speed, where it is a level, on."""
    low = max(2.0 * scene.slowest, 0.02 * scene.fastest)
    return tuple((v,) for v in log_grid(low, 0.6 * scene.fastest, 5))


def _shear_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return bends that are told from a level below, and from a viscous line above."""
    return ((scene.slowest, scene.fastest),)


def _eyring(scene: Scene, point: Point) -> Floats:
    return stack(eyring_nm(scene.direction, scene.full("velocity_rad_s"), *point))


def _cross(scene: Scene, point: Point) -> Floats:
    return stack(cross_nm(scene.direction, scene.full("velocity_rad_s"), *point))


def _offset(scene: Scene, point: Point) -> Floats:
    del point
    return stack(np.ones_like(scene.direction))


def _asymmetric_coulomb(scene: Scene, point: Point) -> Floats:
    del point
    return stack(_LEVELS_DIFFER.torque_nm(scene.full("velocity_rad_s"), scene.direction))


def _asymmetric_viscous(scene: Scene, point: Point) -> Floats:
    del point
    # Where the joint stands its noise has no direction.
    moving = np.abs(scene.direction)
    velocity = scene.full("velocity_rad_s")
    return stack(_SLOPES_DIFFER.torque_nm(velocity, scene.direction) * moving)


def _asymmetric_both(scene: Scene, point: Point) -> Floats:
    return np.concatenate(
        (_asymmetric_coulomb(scene, point), _asymmetric_viscous(scene, point)), axis=1
    )


def brakes_both_ways(scene: Scene, point: Point, coefficients: Floats) -> bool:
    """Return whether friction that differs so much still brakes where it is less.

    Else it would drive the joint: what differs so between the directions is no friction.
    """
    del point
    _, viscous, coulomb = np.maximum(scene.theta[:3], scene.as_given[:3])
    usual = float(np.median(np.abs(scene.table.rows["velocity_rad_s"][scene.table.sliding])))
    level = max(float(coulomb), 0.0) + max(float(viscous), 0.0) * usual
    return bool(abs(float(coefficients[0])) <= 2.0 * _ALL_OF_IT * level)


def _load(scene: Scene, point: Point) -> Floats:
    return stack(scene.direction * np.abs(borne_nm(scene, point[0], point[1])))


def _load_with_oil(scene: Scene, point: Point) -> Floats:
    """Return friction under a load that has viscous friction in it, to the motor's whole torque."""
    return stack(scene.direction * np.abs(borne_nm(scene, *point)))


def borne_nm(scene: Scene, arm: float, dry: float = 0.0, oil: float = 0.0) -> Floats:
    """Return what the gear bears, shape (n,): weight, and shares of inertia and friction."""
    load = scene.load_nm(arm) + dry * max(float(scene.theta[2]), 0.0) * scene.direction
    if not oil:
        return np.asarray(load)
    return np.asarray(load + oil * max(float(scene.theta[1]), 0.0) * scene.full("velocity_rad_s"))


def _load_with_oil_grid(scene: Scene) -> Sequence[Point]:
    del scene
    return _WHOLE


def _load_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return how much of inertia and dry friction may be behind the gear: all of it."""
    del scene
    return (0.0, _ALL), (0.0, _ALL)


def _load_with_oil_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*_load_limits(scene), (0.0, _ALL))


def _load_boundary(scene: Scene, point: Point) -> Floats:
    load = _load(scene, (point[0], 0.0))[:, 0]
    return stack(load, load * boundary_share(scene.speed, *point[1:]))


def _load_while_slow(scene: Scene, point: Point) -> Floats:
    return _load_boundary(scene, point)[:, 1:]


def _load_grid(scene: Scene) -> Sequence[Point]:
    del scene
    return tuple((share, friction) for share in _ARM_SHARES for friction in _ARM_FRICTION)


def _load_boundary_grid(scene: Scene) -> Sequence[Point]:
    speeds = log_grid(scene.slowest, 0.5 * scene.fastest, 4)
    shares = _ARM_SHARES[::2]
    return tuple((share, v, e) for share in shares for v in speeds for e in _LOAD_FALLS)


def _load_boundary_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (0.0, _ALL), *_stribeck_limits(scene)


def _load_while_slow_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return limits of a fall to nothing: one as slow as small exponents would leave a part."""
    return *_load_boundary_limits(scene)[:2], _STEEP_FALLS


def _load_powered(scene: Scene, point: Point) -> Floats:
    """Return friction that grows with a power of the load, in proportion at a hard one."""
    share, power = point
    load = scene.load_nm(share)
    return stack(scene.direction * powered_nm(load, power, _hard_load_nm(scene, share)))


def _hard_load_nm(scene: Scene, share: float) -> float:
    """Return the load that only few samples exceed, N m."""
    hard = float(np.quantile(np.abs(scene.load_nm(share)), _HARDEST_SHARE))
    return max(hard, 1e-12)


def _load_powered_grid(scene: Scene) -> Sequence[Point]:
    del scene
    return tuple((share, power) for share in _ARM_SHARES[::2] for power in _POWERS)


def _load_powered_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return powers that are told from Coulomb's level below, and from a limit above."""
    del scene
    return (0.0, _ALL), (0.3, 5.0)


def _load_powered_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    (entry,) = _load_twin(scene, values)
    return ({**entry, "reference_load_nm": _hard_load_nm(scene, values["arm_share"])},)


def _load_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return friction under load with what loads the gear as numbers instead of shares."""
    numbers = {"load_coefficient": 0.0, **values}
    inertia = numbers.pop("arm_share") * float(scene.theta[0])
    friction = numbers.pop("arm_friction_share", 0.0) * max(float(scene.theta[2]), 0.0)
    entry = {**numbers, "arm_inertia_kg_m2": inertia, "arm_coulomb_nm": friction}
    if "arm_viscous_share" in entry:
        oil = entry.pop("arm_viscous_share") * max(float(scene.theta[1]), 0.0)
        entry["arm_viscous_nm_s_per_rad"] = oil
    return (entry,)


FORMS: tuple[Form, ...] = (
    Form(
        "stribeck",
        "exponential fall",
        ("static_extra_nm",),
        _stribeck,
        ("stribeck_velocity_rad_s", "exponent"),
        _stribeck_grid,
        (1,),
        limits=_stribeck_limits,
    ),
    Form(
        "viscous-nonlinear",
        "power law",
        ("power_nm",),
        _bend,
        ("exponent",),
        _bend_grid,
        limits=_bend_limits,
        to_twin=_bend_twin,
    ),
    Form(
        "viscous-nonlinear",
        "shear thinning without a plateau",
        ("shear_nm",),
        _eyring,
        ("shear_velocity_rad_s",),
        _shear_grid,
        (1,),
        limits=_shear_limits,
    ),
    Form(
        "viscous-nonlinear",
        "shear thinning with a plateau",
        ("plateau_nm",),
        _cross,
        ("plateau_velocity_rad_s",),
        _shear_grid,
        (1,),
        limits=_shear_limits,
    ),
    Form("torque-offset", "constant", ("torque_offset_nm",), _offset),
    Form(
        "direction-asymmetry",
        "Coulomb",
        ("coulomb_difference_nm",),
        _asymmetric_coulomb,
        borne=brakes_both_ways,
    ),
    Form(
        "direction-asymmetry",
        "viscous",
        ("viscous_difference_nm_s_per_rad",),
        _asymmetric_viscous,
    ),
    Form(
        "direction-asymmetry",
        "Coulomb and viscous",
        ("coulomb_difference_nm", "viscous_difference_nm_s_per_rad"),
        _asymmetric_both,
        borne=brakes_both_ways,
    ),
    Form(
        "load-dependent-friction",
        "proportional",
        ("load_coefficient",),
        _load,
        ("arm_share", "arm_friction_share"),
        _load_grid,
        (1,),
        highest=(_MOST_UNDER_LOAD,),
        limits=_load_limits,
        in_one_product=True,
        needs=("position_rad",),
        to_twin=_load_twin,
        rests_on_numbers=True,
    ),
    Form(
        "load-dependent-friction",
        "proportional, with viscous friction in the load",
        ("load_coefficient",),
        _load_with_oil,
        ("arm_share", "arm_friction_share", "arm_viscous_share"),
        _load_with_oil_grid,
        (1,),
        highest=(_MOST_UNDER_LOAD,),
        limits=_load_with_oil_limits,
        in_one_product=True,
        needs=("position_rad",),
        to_twin=_load_twin,
        refines=("proportional",),
        rests_on_numbers=True,
    ),
    Form(
        "load-dependent-friction",
        "with a power of the load",
        ("load_coefficient",),
        _load_powered,
        ("arm_share", "load_power"),
        _load_powered_grid,
        (1,),
        highest=(_MOST_UNDER_LOAD,),
        limits=_load_powered_limits,
        needs=("position_rad",),
        to_twin=_load_powered_twin,
        refines=("proportional",),
        only_clearly=True,
        rests_on_numbers=True,
    ),
    Form(
        "load-dependent-friction",
        "while slow alone",
        ("load_boundary_coefficient",),
        _load_while_slow,
        ("arm_share", "load_velocity_rad_s", "exponent"),
        _load_boundary_grid,
        (1,),
        highest=(_MOST_UNDER_LOAD,),
        limits=_load_while_slow_limits,
        needs=("position_rad",),
        to_twin=_load_twin,
        refines=("proportional",),
        rests_on_numbers=True,
    ),
    Form(
        "load-dependent-friction",
        "with boundary part",
        ("load_coefficient", "load_boundary_coefficient"),
        _load_boundary,
        ("arm_share", "load_velocity_rad_s", "exponent"),
        _load_boundary_grid,
        (1, 1),
        highest=(_MOST_UNDER_LOAD, _MOST_UNDER_LOAD),
        limits=_load_boundary_limits,
        needs=("position_rad",),
        to_twin=_load_twin,
        refines=("proportional", "while slow alone"),
        rests_on_numbers=True,
    ),
)
