"""Hoses and cables: a spring over the arm's angle, hanging free somewhere, stiffening or lossy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, ToTwin, stack
from agent.explain.forms.grid import log_grid
from agent.explain.forms.mixed import Mixed, Part
from agent.explain.forms.reversal import hysteresis
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.external import stiffening

_NEUTRALS = 9  # along the stroke: a cubic about each looks unlike that about the next
_TRAVELS = 5
_SOONEST_RAD = 0.05  # of the arm: what has settled sooner is the joint's own friction that yields
_LATEST = 0.5  # of the stroke: what settles later is a spring
_FAR = 2.0  # strokes: so far it hangs free to one side, which is further than anybody has seen
_SLACK = 0.1  # of the stroke, at least
_SLACKS = (0.1, 0.2, 0.3)  # of the stroke, to either side of where it hangs free
_MOST_SLACK = 0.45
_STIFFENING = (0.1, 0.2, 0.4)  # of the stroke: the angle in which a spring stiffens
_MOST_STIFFENING, _LEAST_STIFFENING = 0.8, 0.08
_PULLS = 0.5  # of the inner friction, at the end of the stroke: a bundle that pulls less has none
_POSITION = ("position_rad",)
_ANYWHERE = ("torque-offset", "direction-asymmetry")


def _powers(scene: Scene, point: Point) -> Floats:
    """Return the powers 0 to 3 of the arm's angle from the stroke's middle, shape (N, 4)."""
    del point
    away = scene.arm_rad - _middle(scene)
    squared = away**2
    return stack(np.ones_like(away), away, squared, away * squared)


def _lag(scene: Scene, point: Point) -> Floats:
    """Return inner friction that settles over an arm travel, shape (N, 1)."""
    return stack(hysteresis(scene, point[0] * scene.table.gear_ratio))


def _of_powers(point: Point) -> Sequence[Part]:
    del point
    return ((_powers, ()),)


def _of_powers_and_lag(point: Point) -> Sequence[Part]:
    return ((_powers, ()), (_lag, point[-1:]))


def _middle(scene: Scene) -> float:
    lower, upper = scene.stroke_arm_rad()
    return 0.5 * (lower + upper)


def _spring_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    return ({**values, "neutral_arm_rad": _middle(scene)},)


def _spring_mix(scene: Scene, point: Point) -> Floats:
    """Return how a spring is made of the powers, shape (4, 1)."""
    return _elsewhere_mix(scene, point)[:, :1]


def _elsewhere_mix(scene: Scene, point: Point) -> Floats:
    """Return how a spring and a constant are made of the powers, shape (4, 2)."""
    del scene, point
    return np.eye(4)[:, [1, 0]]


def _elsewhere_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    stiffness = values["stiffness_nm_per_arm_rad"]
    neutral = _middle(scene) - values["constant_nm"] / stiffness if stiffness else 0.0
    return ({"stiffness_nm_per_arm_rad": stiffness, "neutral_arm_rad": neutral},)


def _lossy_mix(scene: Scene, point: Point) -> Floats:
    """Return how spring, constant and inner friction are made of powers and lag, shape (5, 3)."""
    return _beside_lag(_elsewhere_mix(scene, point))


def _beside_lag(of_powers: Floats) -> Floats:
    rows, columns = of_powers.shape
    out = np.zeros((rows + 1, columns + 1))
    out[:rows, :columns], out[rows, columns] = of_powers, 1.0
    return out


def _lossy_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    (spring,) = _elsewhere_twin(scene, values)
    names = ("hysteresis_nm", "hysteresis_travel_arm_rad")
    return ({**spring, **{name: values[name] for name in names}},)


def _travels(scene: Scene) -> Sequence[Point]:
    return tuple((travel,) for travel in log_grid(*_settling(scene)[0], _TRAVELS))


def _settling(scene: Scene) -> Sequence[tuple[float, float]]:
    lower, upper = scene.stroke_arm_rad()
    return ((_SOONEST_RAD, max(_LATEST * (upper - lower), _SOONEST_RAD)),)


def _stiffening_mix(scene: Scene, point: Point) -> Floats:
    """Return how a spring and a cube about a neutral angle are made of the powers, shape (4, 2)."""
    rest = point[0] - _middle(scene)
    return np.array([[-rest, -(rest**3)], [1.0, 3.0 * rest**2], [0.0, -3.0 * rest], [0.0, 1.0]])


def _cubic_mix(scene: Scene, point: Point) -> Floats:
    """Return how a cube about a neutral angle is made of the powers, shape (4, 1)."""
    return _stiffening_mix(scene, point)[:, 1:]


def _cubic_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return ({"stiffness_nm_per_arm_rad": 0.0, **values},)


def _lossy_stiffening_mix(scene: Scene, point: Point) -> Floats:
    """Return how spring, cube and inner friction are made of powers and lag, shape (5, 3)."""
    return _beside_lag(_stiffening_mix(scene, point[:1]))


def _drawn_up(scene: Scene, point: Point) -> Floats:
    """Return a spring that hangs free below an angle, shape (N, 1)."""
    return stack(np.maximum(scene.arm_rad - point[0], 0.0))


def _drawn_down(scene: Scene, point: Point) -> Floats:
    """Return a spring that hangs free above an angle, shape (N, 1)."""
    return stack(np.minimum(scene.arm_rad - point[0], 0.0))


def _slack(side: str) -> ToTwin:
    """Return how a spring that hangs free to one side is told to a twin: for all of the stroke."""

    def to_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
        lower, upper = scene.stroke_arm_rad()
        return ({**values, f"slack_{side}_arm_rad": _FAR * (upper - lower)},)

    return to_twin


def _neutrals_and_travels(scene: Scene) -> Sequence[Point]:
    travels = _travels(scene)[1::2]
    return tuple((*neutral, *travel) for neutral in _neutrals(scene) for travel in travels)


def _within_stroke_and_settling(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*_within_stroke(scene), *_settling(scene))


def _neutrals(scene: Scene) -> Sequence[Point]:
    """Return arm angles along the stroke, its ends left out: there a cubic is a parabola."""
    return tuple((float(x),) for x in np.linspace(*scene.stroke_arm_rad(), _NEUTRALS + 2)[1:-1])


def _within_stroke(scene: Scene) -> Sequence[tuple[float, float]]:
    return (scene.stroke_arm_rad(),)


def _where_slack_shows(scene: Scene) -> Sequence[tuple[float, float]]:
    """Return where a bundle may be drawn taut: else it is a spring with an offset."""
    lower, upper = scene.stroke_arm_rad()
    least = _SLACK * (upper - lower)
    return ((lower + least, upper - least),)


def _hardening(scene: Scene, point: Point) -> Floats:
    """Return a spring that is stiffer the further it is drawn, without an end, shape (N, 1)."""
    return stack(stiffening(scene.arm_rad - point[0], point[1]))


def _neutrals_and_stiffenings(scene: Scene) -> Sequence[Point]:
    lower, upper = scene.stroke_arm_rad()
    angles = [share * (upper - lower) for share in _STIFFENING]
    return tuple((*neutral, angle) for neutral in _neutrals(scene)[1:-1] for angle in angles)


def _where_it_stiffens(scene: Scene) -> Sequence[tuple[float, float]]:
    lower, upper = scene.stroke_arm_rad()
    least, most = (share * (upper - lower) for share in (_LEAST_STIFFENING, _MOST_STIFFENING))
    return ((lower, upper), (least, most))


def _drawn_both_ways(scene: Scene, point: Point) -> Floats:
    """Return a spring that hangs free as far to either side of an angle, shape (N, 1)."""
    away = scene.arm_rad - point[0]
    return stack(away - np.clip(away, -point[1], point[1]))


def _drawn_both_ways_lossy(scene: Scene, point: Point) -> Floats:
    """Return the same and its inner friction, shape (N, 2)."""
    return np.concatenate((_drawn_both_ways(scene, point), _lag(scene, point[-1:])), axis=1)


def _is_drawn(scene: Scene, point: Point, coefficients: Floats) -> bool:
    """Return whether the spring pulls at all beside its inner friction, where it is drawn taut."""
    drawn = np.array(scene.stroke_arm_rad()) - point[0]
    pull = coefficients[0] * max(float(np.max(np.abs(drawn))) - point[1], 0.0)
    return bool(pull > _PULLS * coefficients[1])


def _slack_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    known = dict(values)
    slack = known.pop("slack_arm_rad")
    return ({**known, "slack_below_arm_rad": slack, "slack_above_arm_rad": slack},)


def _neutrals_and_slacks(scene: Scene) -> Sequence[Point]:
    lower, upper = scene.stroke_arm_rad()
    slacks = [share * (upper - lower) for share in _SLACKS]
    return tuple((*neutral, slack) for neutral in _neutrals(scene)[2:-2] for slack in slacks)


def _slacks_and_travels(scene: Scene) -> Sequence[Point]:
    travels = _travels(scene)[1::2]
    return tuple((*place, *travel) for place in _neutrals_and_slacks(scene) for travel in travels)


def _slack_within_stroke(scene: Scene) -> Sequence[tuple[float, float]]:
    lower, upper = scene.stroke_arm_rad()
    least, most = 0.5 * _SLACK * (upper - lower), _MOST_SLACK * (upper - lower)
    return ((lower, upper), (least, most))


def _slack_and_settling(scene: Scene) -> Sequence[tuple[float, float]]:
    return (*_slack_within_stroke(scene), *_settling(scene))


FORMS: tuple[Form, ...] = (
    Form(
        "cable-force",
        "spring",
        ("stiffness_nm_per_arm_rad",),
        Mixed(_of_powers, _spring_mix),
        signs=(1,),
        needs=_POSITION,
        to_twin=_spring_twin,
    ),
    Form(
        "cable-force",
        "spring at rest elsewhere",
        ("stiffness_nm_per_arm_rad", "constant_nm"),
        Mixed(_of_powers, _elsewhere_mix),
        signs=(1, 0),
        needs=_POSITION,
        to_twin=_elsewhere_twin,
        contains=_ANYWHERE,
    ),
    Form(
        "cable-force",
        "spring with inner friction",
        ("stiffness_nm_per_arm_rad", "constant_nm", "hysteresis_nm"),
        Mixed(_of_powers_and_lag, _lossy_mix),
        ("hysteresis_travel_arm_rad",),
        _travels,
        signs=(1, 0, 1),
        limits=_settling,
        needs=_POSITION,
        to_twin=_lossy_twin,
        contains=_ANYWHERE,
        refines=("spring", "spring at rest elsewhere"),
    ),
    Form(
        "cable-force",
        "spring that stiffens",
        ("stiffness_nm_per_arm_rad", "cubic_nm_per_arm_rad3"),
        Mixed(_of_powers, _stiffening_mix),
        ("neutral_arm_rad",),
        _neutrals,
        signs=(1, 1),
        limits=_within_stroke,
        needs=_POSITION,
        contains=_ANYWHERE,
        refines=("spring", "spring at rest elsewhere"),
    ),
    Form(
        "cable-force",
        "spring that stiffens, with inner friction",
        ("stiffness_nm_per_arm_rad", "cubic_nm_per_arm_rad3", "hysteresis_nm"),
        Mixed(_of_powers_and_lag, _lossy_stiffening_mix),
        ("neutral_arm_rad", "hysteresis_travel_arm_rad"),
        _neutrals_and_travels,
        signs=(1, 1, 1),
        limits=_within_stroke_and_settling,
        needs=_POSITION,
        contains=_ANYWHERE,
        refines=(
            "spring",
            "spring at rest elsewhere",
            "spring with inner friction",
            "spring that stiffens",
        ),
    ),
    Form(
        "cable-force",
        "spring that hangs free below an angle",
        ("stiffness_nm_per_arm_rad",),
        _drawn_up,
        ("neutral_arm_rad",),
        _neutrals,
        signs=(1,),
        limits=_where_slack_shows,
        needs=_POSITION,
        to_twin=_slack("below"),
        contains=_ANYWHERE,
        refines=("spring", "spring at rest elsewhere"),
    ),
    Form(
        "cable-force",
        "spring that hangs free above an angle",
        ("stiffness_nm_per_arm_rad",),
        _drawn_down,
        ("neutral_arm_rad",),
        _neutrals,
        signs=(1,),
        limits=_where_slack_shows,
        needs=_POSITION,
        to_twin=_slack("above"),
        contains=_ANYWHERE,
        refines=("spring", "spring at rest elsewhere"),
    ),
    Form(
        "cable-force",
        "slack spring that stiffens",
        ("cubic_nm_per_arm_rad3",),
        Mixed(_of_powers, _cubic_mix),
        ("neutral_arm_rad",),
        _neutrals,
        signs=(1,),
        limits=_within_stroke,
        needs=_POSITION,
        to_twin=_cubic_twin,
        contains=_ANYWHERE,
        more_usual=("spring at rest elsewhere",),
    ),
    Form(
        "cable-force",
        "spring that stiffens ever faster",
        ("stiffness_nm_per_arm_rad",),
        _hardening,
        ("neutral_arm_rad", "stiffening_arm_rad"),
        _neutrals_and_stiffenings,
        signs=(1,),
        limits=_where_it_stiffens,
        needs=_POSITION,
        contains=_ANYWHERE,
        refines=(
            "spring",
            "spring at rest elsewhere",
            "spring that stiffens",
            "slack spring that stiffens",
        ),
        only_clearly=True,
    ),
    Form(
        "cable-force",
        "spring that hangs free between two angles",
        ("stiffness_nm_per_arm_rad",),
        _drawn_both_ways,
        ("neutral_arm_rad", "slack_arm_rad"),
        _neutrals_and_slacks,
        signs=(1,),
        limits=_slack_within_stroke,
        needs=_POSITION,
        to_twin=_slack_twin,
        contains=_ANYWHERE,
        refines=("spring", "spring at rest elsewhere", "slack spring that stiffens"),
    ),
    Form(
        "cable-force",
        "spring that hangs free between two angles, with inner friction",
        ("stiffness_nm_per_arm_rad", "hysteresis_nm"),
        _drawn_both_ways_lossy,
        ("neutral_arm_rad", "slack_arm_rad", "hysteresis_travel_arm_rad"),
        _slacks_and_travels,
        signs=(1, 1),
        limits=_slack_and_settling,
        needs=_POSITION,
        to_twin=_slack_twin,
        borne=_is_drawn,
        contains=_ANYWHERE,
        refines=(
            "spring",
            "spring at rest elsewhere",
            "spring with inner friction",
            "slack spring that stiffens",
            "spring that hangs free between two angles",
        ),
    ),
)
