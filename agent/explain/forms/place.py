"""What belongs to a place of the arm: tight spots, faults."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Grid, Point, Proportional, stack
from agent.explain.forms.orders import half_a_line, strong_orders
from agent.explain.forms.spots import strong_places
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.external import dent_share
from agent.physics.friction_place import bump_share

_PLACES = 24
_LOCAL = 0.028  # of the stroke: narrower, a bell is seen along less than a tenth of it: a fault
_BROAD = 0.045  # wider, along more than a sixth: friction of the path; between: either
_NARROWEST, _WIDEST = 0.003, 0.12
_FLANK = 0.04  # at an end of the stroke: wider, it is no place
_WIDEST_SPOT = 0.25  # wider, friction of the path is no spot
_SPOTS = (_LOCAL, _WIDEST_SPOT)
_TURN, _ROUND = 2.0 * math.pi, 1.2  # rad of the arm, turns: what goes no further comes back
_SHAPES = ((1.0, 1.0, 6.0), (0.7, 0.7, 1.0), (0.3, 1.5, 1.5), (1.5, 0.3, 1.5))
_EXPONENTS = (0.7, 12.0)
_POSITION = ("position_rad",)

Limits = Callable[[Scene], Sequence[tuple[float, float]]]
Borne = Callable[[Scene, Point, Floats], bool]


def _half_an_arm_line(scene: Scene) -> Point:
    return (half_a_line(scene)[0] * scene.table.gear_ratio,)


def _arm_grid(scene: Scene) -> Sequence[Point]:
    """Return arm orders from a half wave over the stroke, and the strong ones of the residual."""
    lower, upper = scene.span("position_rad")
    stroke = (upper - lower) / scene.table.gear_ratio
    longest = 0.5 * 2.0 * math.pi / max(stroke, 1e-6)
    whole = [float(k) for k in (1, 2, 3, 4) if k >= longest]
    low = [longest * k for k in (1.0, 1.5, 2.0, 3.0)]
    orders = () if scene.one_way else strong_orders(scene, "friction")
    strong = [order * scene.table.gear_ratio for order in orders]
    return tuple((o,) for o in dict.fromkeys((*whole, *low, *strong)))


def _friction_wave(scene: Scene, point: Point) -> Floats:
    wave = scene.wave(point[0] / scene.table.gear_ratio)
    return np.asarray(scene.direction[:, np.newaxis] * wave)


def _friction_wave_two(scene: Scene, point: Point) -> Floats:
    double = _friction_wave(scene, (2.0 * point[0],))
    return np.concatenate((_friction_wave(scene, point), double), axis=1)


def _one_way_grid(scene: Scene) -> Sequence[Point]:
    """Return the strong orders where friction cannot be told from ripple, which comes first."""
    strong = strong_orders(scene, "torque") if scene.one_way else ()
    return tuple((o * scene.table.gear_ratio,) for o in strong)


def _wave_two_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    order = values["order_per_arm_rev"]
    return tuple(
        {"cos_nm": values[cos], "sin_nm": values[sin], "order_per_arm_rev": times * order}
        for cos, sin, times in (("cos_nm", "sin_nm", 1), ("cos_second_nm", "sin_second_nm", 2))
    )


def _bump(scene: Scene, point: Point) -> Floats:
    return bump_share(scene.arm_rad, *point)


def _places(widths: Sequence[float], *, friction: bool) -> Grid:
    """Return spots all along the stroke, and finer ones where the residual stands out.

    Parameters
    ----------
    widths : sequence of float
        Of the stroke, narrow to wide.
    friction : bool
        Whether the spot brakes; else it pushes.
    """

    def grid(scene: Scene) -> Sequence[Point]:
        lower, upper = scene.stroke_arm_rad()
        centers = np.linspace(lower, upper, _PLACES)
        even = [(float(c), w * (upper - lower)) for w in widths[-2:] for c in centers]
        return (*even, *strong_places(scene, widths, friction=friction))

    return grid


def _within_stroke(narrowest: float, widest: float) -> Limits:
    """Return where a spot may lie, and how narrow or wide it may be, of the stroke.

    One at the very end, which few samples reach, is seen by its flank.
    """

    def limits(scene: Scene) -> Sequence[tuple[float, float]]:
        lower, upper = scene.stroke_arm_rad()
        return (scene.ends_arm_rad(), (narrowest * (upper - lower), widest * (upper - lower)))

    return limits


def _is_a_place(scene: Scene, point: Point, coefficients: Floats) -> bool:
    """Return whether a bump is seen to rise and to fall, or is too narrow for a pull that grows.

    The flank of a wide one at the end of the stroke is what a hose does that is drawn taut there.
    """
    del coefficients
    (lower, upper), (centre, width) = scene.stroke_arm_rad(), point
    whole = lower + width <= centre <= upper - width
    return whole or width <= _FLANK * (upper - lower)


def _spot_step(scene: Scene) -> Point:
    """Return how far a spot is moved and widened at first: it is nearly found."""
    lower, upper = scene.stroke_arm_rad()
    return (0.5 * (upper - lower) / _PLACES, 0.5 * _LOCAL * (upper - lower))


def _tight_spot(scene: Scene, point: Point) -> Floats:
    return stack(scene.direction * _bump(scene, point))


def _fault(scene: Scene, point: Point) -> Floats:
    return stack(_bump(scene, point))


def _of_any_shape(width: float, *, friction: bool) -> Grid:
    """Return bells where the residual stands out most: flat ones, sharp ones, and leaning ones.

    Parameters
    ----------
    width : float
        Of the stroke.
    friction : bool
        Whether the place brakes; else it pushes.
    """

    def grid(scene: Scene) -> Sequence[Point]:
        places = strong_places(scene, (width, 3.0 * width), friction=friction)
        firsts = dict.fromkeys(places[at] for at in (0, len(places) // 2) if places)
        return shaped_there(tuple(firsts))

    return grid


def shaped_there(places: Sequence[tuple[float, float]]) -> tuple[Point, ...]:
    """Return bells flat, sharp and leaning to either side, at places given by middle and width."""
    return tuple(
        (center, below * wide, above * wide, exponent)
        for center, wide in places
        for below, above, exponent in _SHAPES
    )


def _shape_limits(scene: Scene) -> Sequence[tuple[float, float]]:
    lower, upper = scene.stroke_arm_rad()
    widths = (_NARROWEST * (upper - lower), _WIDEST_SPOT * (upper - lower))
    return (scene.ends_arm_rad(), widths, widths, _EXPONENTS)


def _shape_step(scene: Scene) -> Point:
    lower, upper = scene.stroke_arm_rad()
    return (0.5 * _LOCAL * (upper - lower), Proportional(0.3), Proportional(0.3), Proportional(0.3))


def _is_as_wide(narrowest: float, widest: float) -> Borne:
    """Return whether a bell of any shape is as wide as that, of the stroke, and whole within it."""

    def borne(scene: Scene, point: Point, coefficients: Floats) -> bool:
        del coefficients
        (lower, upper), (center, below, above, _) = scene.stroke_arm_rad(), point
        wide = narrowest <= 0.5 * (below + above) / max(upper - lower, 1e-9) <= widest
        return wide and lower + below <= center <= upper - above

    return borne


def _shaped(scene: Scene, point: Point) -> Floats:
    center, below, above, exponent = point
    return stack(bump_share(scene.arm_rad, center, below, 0.0, above, exponent))


def _shaped_friction(scene: Scene, point: Point) -> Floats:
    return scene.direction[:, np.newaxis] * _shaped(scene, point)


def _dent(scene: Scene, point: Point) -> Floats:
    return stack(dent_share(scene.arm_rad, *point))


def _turns_round(scene: Scene) -> bool:
    """Return whether the arm passes its places more than once by going round."""
    lower, upper = scene.stroke_arm_rad()
    return upper - lower > _ROUND * _TURN


def _of_every_turn(widths: Sequence[float], *, friction: bool) -> Grid:
    """Return spots along one turn of an arm that goes round, where the residual stands out."""

    def grid(scene: Scene) -> Sequence[Point]:
        if not _turns_round(scene):
            return ()
        return strong_places(scene, widths, friction=friction, of_turn=True)

    return grid


def _within_a_turn(narrowest: float, widest: float) -> Limits:
    def limits(scene: Scene) -> Sequence[tuple[float, float]]:
        del scene
        return ((-0.5 * _TURN, 0.5 * _TURN), (narrowest * _TURN, widest * _TURN))

    return limits


def _turn_step(scene: Scene) -> Point:
    del scene
    return (0.5 * _TURN / _PLACES, 0.5 * _LOCAL * _TURN)


def _fault_every_turn(scene: Scene, point: Point) -> Floats:
    center, width = point
    return stack(bump_share(scene.arm_rad, center, width, _TURN))


def _rubbing_every_turn(scene: Scene, point: Point) -> Floats:
    return scene.direction[:, np.newaxis] * _fault_every_turn(scene, point)


def _every_turn_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return ({**values, "period_arm_rad": _TURN},)


FORMS: tuple[Form, ...] = (
    Form(
        "position-dependent-friction",
        "wave",
        ("cos_nm", "sin_nm"),
        _friction_wave,
        ("order_per_arm_rev",),
        _arm_grid,
        needs=_POSITION,
        step=_half_an_arm_line,
    ),
    Form(
        "position-dependent-friction",
        "wave, one way",
        ("cos_nm", "sin_nm"),
        _friction_wave,
        ("order_per_arm_rev",),
        _one_way_grid,
        needs=_POSITION,
        step=_half_an_arm_line,
        catch_all=True,
    ),
    Form(
        "position-dependent-friction",
        "wave and its double, one way",
        ("cos_nm", "sin_nm", "cos_second_nm", "sin_second_nm"),
        _friction_wave_two,
        ("order_per_arm_rev",),
        _one_way_grid,
        needs=_POSITION,
        step=_half_an_arm_line,
        to_twin=_wave_two_twin,
        catch_all=True,
    ),
    Form(
        "position-dependent-friction",
        "tight spot",
        ("height_nm",),
        _tight_spot,
        ("center_arm_rad", "width_arm_rad"),
        _places((_LOCAL, 0.04, 0.08, 0.16), friction=True),
        limits=_within_stroke(*_SPOTS),
        needs=_POSITION,
    ),
    Form(
        "local-fault",
        "bump",
        ("height_nm",),
        _fault,
        ("center_arm_rad", "width_arm_rad"),
        _places((0.01, 0.02, 0.04, 0.08), friction=False),
        step=_spot_step,
        limits=_within_stroke(_NARROWEST, _WIDEST),
        needs=_POSITION,
        borne=_is_a_place,
    ),
    Form(
        "local-fault",
        "dent",
        ("dent_nm",),
        _dent,
        ("center_arm_rad", "width_arm_rad"),
        _places((0.01, 0.02, 0.04, 0.08), friction=False),
        step=_spot_step,
        limits=_within_stroke(_NARROWEST, _WIDEST),
        needs=_POSITION,
        borne=_is_a_place,
    ),
    Form(
        "local-fault",
        "rubbing",
        ("rubbing_nm",),
        _tight_spot,
        ("center_arm_rad", "width_arm_rad"),
        _places((0.007, 0.014, _LOCAL), friction=True),
        step=_spot_step,
        limits=_within_stroke(_NARROWEST, _BROAD),
        needs=_POSITION,
    ),
    Form(
        "local-fault",
        "bump, every turn",
        ("height_nm",),
        _fault_every_turn,
        ("center_arm_rad", "width_arm_rad"),
        _of_every_turn((0.003, 0.006, 0.012, 0.025), friction=False),
        step=_turn_step,
        limits=_within_a_turn(0.5 * _NARROWEST, _WIDEST),
        needs=_POSITION,
        to_twin=_every_turn_twin,
    ),
    Form(
        "local-fault",
        "rubbing, every turn",
        ("rubbing_nm",),
        _rubbing_every_turn,
        ("center_arm_rad", "width_arm_rad"),
        _of_every_turn((0.003, 0.006, 0.012, 0.025), friction=True),
        step=_turn_step,
        limits=_within_a_turn(0.5 * _NARROWEST, _BROAD),
        needs=_POSITION,
        to_twin=_every_turn_twin,
    ),
)


def _of_another_shape(
    effect: str,
    called: str,
    height: str,
    grid: Grid,
    between: tuple[float, float],
    *,
    friction: bool,
) -> Form:
    """Return a form's like of any shape, as wide as between two parts of the stroke."""
    return Form(
        effect,
        f"{called} of another shape",
        (height,),
        _shaped_friction if friction else _shaped,
        ("center_arm_rad", "width_arm_rad", "width_above_arm_rad", "shape_exponent"),
        grid,
        step=_shape_step,
        limits=_shape_limits,
        needs=_POSITION,
        borne=_is_as_wide(*between),
        refines=(called,),
        from_residual=True,
        only_clearly=True,
    )


SHAPES: tuple[Form, ...] = tuple(
    _of_another_shape(
        effect, called, height, _of_any_shape(width, friction=friction), between, friction=friction
    )
    for effect, called, height, width, between, friction in (
        ("position-dependent-friction", "tight spot", "height_nm", _BROAD, _SPOTS, True),
        ("local-fault", "bump", "height_nm", 0.02, (_NARROWEST, _WIDEST), False),
        ("local-fault", "rubbing", "rubbing_nm", 0.014, (_NARROWEST, _BROAD), True),
    )
)
"""Places of any shape: asked only in the place of such as were found."""
