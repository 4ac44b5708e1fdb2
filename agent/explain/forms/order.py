"""What shakes with the motor's turn: the gear's wobble, the resolver's error."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.grid import log_grid
from agent.explain.forms.hidden_arm import HiddenArm, inertia_of
from agent.explain.forms.orders import (
    ORDER,
    half_a_line,
    highest_order,
    order_limits,
    strong_orders,
)
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.periodic import wave_rates

_BORNE = 2  # orders that the weight shows, beside those that shake
_POSITION = ("position_rad",)
_GEAR_DAMPING = 0.2  # of the arm's swing on the gear, friction counted in: where the search begins
_DAMPINGS = (0.02, 0.5)
SHARE = "arm_inertia_share"
_SPRING = ("antiresonance_hz", "damping_ratio", SHARE)
_RUBS = "arm_friction_share"  # of the dry friction: bearing and seal of the arm
_AS_PRODUCT = (
    "known only times the arm's inertia, taken as a share of the joint's: the less of it is the "
    "arm's, the larger is the angle"
)
_ARM_SHARE = 0.5  # of the inertia, behind the gear: where the search begins
ARM_SHARES = (0.1, 0.9)
_ARM_FRICTION = 0.3  # of the dry friction, behind the gear: where the search begins
_FRICTIONS = (0.0, 1.0)


def goes_by_order(form: Form) -> bool:
    """Return whether a form is a wave behind a stiff gear, at any order that `at_order` says."""
    return form.refine and form.nonlinear in ((ORDER,), (ORDER, _RUBS))


def at_order(form: Form, order: float) -> Point:
    """Return the point of such a form at an order, its other number where the search begins."""
    return (order, _ARM_FRICTION) if _RUBS in form.nonlinear else (order,)


def _second_derivatives(scene: Scene, order: float) -> Floats:
    """Return the second time derivatives of cos(k q) and sin(k q) along the motion, (N, 2)."""
    cos, sin = scene.wave(order).T
    motion = scene.full("velocity_rad_s"), scene.full("acceleration_rad_s2")
    return stack(*wave_rates(order, cos, sin, *motion))


def waves_of(scene: Scene, order: float) -> Floats:
    """Return waves of torque and of acceleration at an order, whatever makes them, (N, 4)."""
    return np.concatenate((scene.wave(order), _second_derivatives(scene, order)), axis=1)


def _slopes(scene: Scene, order: float) -> Floats:
    """Return the derivatives of cos(k q) and sin(k q) by the angle, shape (N, 2)."""
    cos, sin = scene.wave(order).T
    return stack(-order * sin, order * cos)


def _swings(scene: Scene, order: float, hertz: float, damping: float) -> Floats:
    """Return `_second_derivatives` as an arm passes them on through the gear's spring, (N, 2)."""
    arm, velocity, across = HiddenArm(hertz, damping), scene.full("velocity_rad_s"), scene.bridged
    no_pull = np.zeros(across.size)
    out = []
    for way, slope in zip(scene.wave(order).T, _slopes(scene, order).T, strict=True):
        motion = replace(scene.sprung_arm, velocity_rad_s=across.over(slope * velocity, way))
        out.append(across.recorded(arm.shaft_rad_s2(motion, no_pull)))
    return stack(*out)


def _geared(scene: Scene, order: float, arm_share: float, friction_share: float) -> Floats:
    """Return what a wobbling ratio makes of the arm's load, over the arm's inertia, (N, 2).

    The motor bears ``1 + e'(q)`` times what the gear carries, as work in is work out. Slow and
    under gravity that is most of what a wobble does, and no error of the measured angle does it.
    How much of the dry friction is the arm's differs from joint to joint, and is as much as that.
    """
    inertia, dry = arm_share * inertia_of(scene), friction_share * float(scene.theta[2])
    load = scene.weight_nm + dry * scene.direction
    borne = scene.full("acceleration_rad_s2") + load / inertia
    return np.asarray(_slopes(scene, order) * borne[:, np.newaxis])


def _wobbling_orders(scene: Scene) -> Sequence[Point]:
    return tuple((order, _ARM_FRICTION) for order in _shaking_orders(scene))


def _shaking_orders(scene: Scene) -> tuple[float, ...]:
    """Return the orders that shake most, those that the weight shows, and the strongest's overtone.

    A strong order's line over the stroke has peaks beside it that hide a weaker one. Where a joint
    moves slowly under gravity, most of what a wobble does is the weight that it bears.
    """
    shaking = strong_orders(scene, "inertia")
    borne = (order for order in strong_orders(scene, "load") if order not in shaking)
    orders = (*shaking, *itertools.islice(borne, _BORNE))
    overtones = [2.0 * order for order in orders[:1] if 2.0 * order < highest_order(scene)]
    return tuple(dict.fromkeys((*orders, *overtones)))


def _kinematic(scene: Scene, point: Point) -> Floats:
    order, friction = point
    return _second_derivatives(scene, order) + _geared(scene, order, _ARM_SHARE, friction)


def _stiff_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*order_limits(scene), _FRICTIONS)


def _stiff_step(scene: Scene) -> Point:
    return (*half_a_line(scene), 0.2)


def _wobble_grid(scene: Scene) -> Sequence[Point]:
    """Return the strong orders with springs from soft to as good as rigid in the band."""
    cutoff = scene.table.cutoff_hz
    springs = log_grid(0.4 * cutoff, 3.0 * cutoff, 5)
    orders = _shaking_orders(scene)
    begin = (_GEAR_DAMPING, _ARM_SHARE, _ARM_FRICTION)
    return tuple((order, hz, *begin) for order in orders for hz in springs)


def _wobble(scene: Scene, point: Point) -> Floats:
    """Return what reaches the motor through the gear's spring when the ratio wobbles, (N, 2).

    The spring is driven by ``q + e(q)``: below the arm's resonance as through a stiff gear, near it
    more, above it ever less. Per radian of the wobble, as the weight shows it whatever the inertia.
    """
    order, hertz, damping, share, friction = point
    per_inertia = _swings(scene, order, hertz, damping) + _geared(scene, order, share, friction)
    return share * inertia_of(scene) * per_inertia


def _wobble_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*_spring_limits(scene), _FRICTIONS)


def _wobble_step(scene: Scene) -> Point:
    return (*_spring_step(scene), 0.2)


def _spring_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return how far order, spring and arm are followed: stiffer is rigid in the band."""
    cutoff = scene.table.cutoff_hz
    return (*order_limits(scene), (0.2 * cutoff, 8.0 * cutoff), _DAMPINGS, ARM_SHARES)


def _spring_step(scene: Scene) -> Point:
    """Return how far spring and arm are moved; the order stays, or it would make up for them."""
    return (0.0, 0.3 * scene.table.cutoff_hz, 0.1, 0.2)


def _kinematic_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Split into an error of the angle and the inertia behind it; only the product is known."""
    inertia = _ARM_SHARE * inertia_of(scene)
    return (
        {
            "cos_rad": values["cos_kg_m2_rad"] / inertia,
            "sin_rad": values["sin_kg_m2_rad"] / inertia,
            "order_per_motor_rev": values["order_per_motor_rev"],
            "arm_inertia_kg_m2": inertia,
            "arm_coulomb_nm": values[_RUBS] * max(float(scene.theta[2]), 0.0),
        },
    )


def _wobble_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the wobble with the arm behind it, and the spring through which that is shaken."""
    own = {name: value for name, value in values.items() if name not in (SHARE, _RUBS)}
    arm = {
        "arm_inertia_kg_m2": values[SHARE] * inertia_of(scene),
        "arm_coulomb_nm": values[_RUBS] * max(float(scene.theta[2]), 0.0),
    }
    return ({**own, **arm},)


def _whole_orders(scene: Scene) -> Sequence[Point]:
    """Return the whole orders in whose line over the stroke a strong one lies.

    Passes are at different speeds and places, and a peak is anywhere in its line; one beside the
    whole order left the wobble without the rival that has the same column.
    """
    width = 2.0 * half_a_line(scene)[0]
    near = [(o, float(round(o))) for o in _shaking_orders(scene)]
    whole = (n for o, n in near if n >= 1.0 and abs(o - n) < width)
    return tuple((n,) for n in dict.fromkeys(whole))


def _resolver(scene: Scene, point: Point) -> Floats:
    """Return what the twin wrongly adds for a measured angle that errs by cos or sin of k q."""
    second = _second_derivatives(scene, point[0])
    return -(inertia_of(scene) * second + _wrongly_viscous(scene, point[0]))


def _wrongly_viscous(scene: Scene, order: float) -> Floats:
    velocity = scene.full("velocity_rad_s")[:, np.newaxis]
    return np.asarray(float(scene.theta[1]) * _slopes(scene, order) * velocity)


def _resolver_grid(scene: Scene) -> Sequence[Point]:
    """Return whole orders with springs about the band's end, from where the others are reached."""
    cutoff = scene.table.cutoff_hz
    springs = log_grid(0.5 * cutoff, 2.0 * cutoff, 4)
    begin = (2.0 * _GEAR_DAMPING, 0.5 * _ARM_SHARE)
    return tuple((*order, hz, *begin) for order in _whole_orders(scene) for hz in springs)


def _resolver_swinging(scene: Scene, point: Point) -> Floats:
    """Return the same where the arm swings on the gear's spring.

    A loop that follows a wrong angle shakes motor and arm; only the arm's part passes the spring.
    """
    order, hertz, damping, share = point
    second = _second_derivatives(scene, order)
    swings = _swings(scene, order, hertz, damping)
    shaken = (1.0 - share) * second + share * swings
    return -(inertia_of(scene) * shaken + _wrongly_viscous(scene, order))


def _ripple_and_late(scene: Scene, point: Point) -> Floats:
    """Return a ripple, and what a wave that grows with the speed's square adds when late, (N, 4).

    At a held speed: the derivative by time of its second derivatives.
    """
    late = _slopes(scene, point[0]) * scene.full("velocity_rad_s")[:, np.newaxis] ** 3
    return np.concatenate((scene.wave(point[0]), late), axis=1)


def _resolver_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the error with the spring on which the arm lags behind the motor that it shakes."""
    arm = {"arm_inertia_kg_m2": values[SHARE] * inertia_of(scene)}
    return ({**{name: v for name, v in values.items() if name != SHARE}, **arm},)


BESIDE_A_WAVE = Form(
    "torque-ripple",
    "an order, and a wave of the same order a little late",
    ("cos_nm", "sin_nm", "late_cos_nm_s3", "late_sin_nm_s3"),
    _ripple_and_late,
    ("order_per_motor_rev",),
    needs=_POSITION,
)
"""What nearly every recording has of a wave's order, too small for a name: it is no candidate."""

_WOBBLE_ON_A_SPRING = "one order, through the gear's spring"
_ERROR_ON_A_SPRING = "whole order of the motor, the arm on the gear's spring"
ON_A_SPRING = frozenset({_WOBBLE_ON_A_SPRING, _ERROR_ON_A_SPRING})
"""Names of the forms whose wave shakes an arm on a spring."""

FORMS: tuple[Form, ...] = (
    Form(
        "kinematic-error",
        "one order",
        ("cos_kg_m2_rad", "sin_kg_m2_rad"),
        _kinematic,
        (ORDER, _RUBS),
        _wobbling_orders,
        needs=_POSITION,
        step=_stiff_step,
        limits=_stiff_limits,
        to_twin=_kinematic_twin,
        rests_on_numbers=True,
        from_residual=True,
        as_product=_AS_PRODUCT,
    ),
    Form(
        "kinematic-error",
        _WOBBLE_ON_A_SPRING,
        ("cos_rad", "sin_rad"),
        _wobble,
        ("order_per_motor_rev", *_SPRING, _RUBS),
        _wobble_grid,
        needs=_POSITION,
        step=_wobble_step,
        together=True,
        limits=_wobble_limits,
        to_twin=_wobble_twin,
        rests_on_numbers=True,
        from_residual=True,
        as_product=_AS_PRODUCT,
        told_apart_by=SHARE,
    ),
    Form(
        "resolver-error",
        "whole order of the motor",
        ("cos_rad", "sin_rad"),
        _resolver,
        ("order_per_motor_rev",),
        _whole_orders,
        needs=_POSITION,
        refine=False,
        rests_on_numbers=True,
        from_residual=True,
    ),
    Form(
        "resolver-error",
        _ERROR_ON_A_SPRING,
        ("cos_rad", "sin_rad"),
        _resolver_swinging,
        ("order_per_motor_rev", *_SPRING),
        _resolver_grid,
        needs=_POSITION,
        step=_spring_step,
        together=True,
        limits=_spring_limits,
        to_twin=_resolver_twin,
        rests_on_numbers=True,
        from_residual=True,
    ),
)
