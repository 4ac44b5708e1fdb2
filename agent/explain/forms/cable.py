"""Hoses and cables: a spring over the arm's angle, hanging free elsewhere, stiffening or lossy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, ToTwin, stack
from agent.explain.forms.reversal import hysteresis
from agent.explain.rows.scene import Scene, log_grid
from agent.identify.result import Floats

_NEUTRALS = 9  # along the stroke: a cubic about each looks unlike that about the next
_TRAVELS = 5
_SOONEST_RAD = 0.05  # of the arm: what has settled sooner is the joint's own friction that yields
_LATEST = 0.5  # of the stroke: what settles later is a spring
_FAR = 2.0  # strokes: so far it hangs free to one side, which is further than anybody has seen
_SLACK = 0.1  # of the stroke, at least
_POSITION = ("position_rad",)
_ANYWHERE = ("torque-offset", "direction-asymmetry")


def _spring(scene: Scene, point: Point) -> Floats:
    del point
    return stack(scene.arm_rad - _middle(scene))


def _middle(scene: Scene) -> float:
    lower, upper = scene.stroke_arm_rad()
    return 0.5 * (lower + upper)


def _spring_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    return ({**values, "neutral_arm_rad": _middle(scene)},)


def _elsewhere(scene: Scene, point: Point) -> Floats:
    del point
    return stack(scene.arm_rad - _middle(scene), np.ones_like(scene.arm_rad))


def _elsewhere_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    stiffness = values["stiffness_nm_per_arm_rad"]
    neutral = _middle(scene) - values["constant_nm"] / stiffness if stiffness else 0.0
    return ({"stiffness_nm_per_arm_rad": stiffness, "neutral_arm_rad": neutral},)


def _lossy(scene: Scene, point: Point) -> Floats:
    """Return spring and constant, and inner friction that settles over an arm travel, (N, 3)."""
    away = scene.arm_rad - _middle(scene)
    lag = hysteresis(scene, point[0] * scene.table.gear_ratio)
    return stack(away, np.ones_like(away), lag)


def _lossy_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    (spring,) = _elsewhere_twin(scene, values)
    names = ("hysteresis_nm", "hysteresis_travel_arm_rad")
    return ({**spring, **{name: values[name] for name in names}},)


def _travels(scene: Scene) -> Sequence[Point]:
    return tuple((travel,) for travel in log_grid(*_settling(scene)[0], _TRAVELS))


def _settling(scene: Scene) -> Sequence[tuple[float, float]]:
    lower, upper = scene.stroke_arm_rad()
    return ((_SOONEST_RAD, max(_LATEST * (upper - lower), _SOONEST_RAD)),)


def _stiffening(scene: Scene, point: Point) -> Floats:
    away = scene.arm_rad - point[0]
    return stack(away, away**3)


def _cubic(scene: Scene, point: Point) -> Floats:
    return stack((scene.arm_rad - point[0]) ** 3)


def _cubic_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return ({"stiffness_nm_per_arm_rad": 0.0, **values},)


def _lossy_stiffening(scene: Scene, point: Point) -> Floats:
    """Return spring and cube about a neutral angle, and inner friction that settles, (N, 3)."""
    neutral, travel = point
    lag = hysteresis(scene, travel * scene.table.gear_ratio)
    return np.concatenate((_stiffening(scene, (neutral,)), stack(lag)), axis=1)


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


FORMS: tuple[Form, ...] = (
    Form(
        "cable-force",
        "spring",
        ("stiffness_nm_per_arm_rad",),
        _spring,
        signs=(1,),
        needs=_POSITION,
        to_twin=_spring_twin,
    ),
    Form(
        "cable-force",
        "spring at rest elsewhere",
        ("stiffness_nm_per_arm_rad", "constant_nm"),
        _elsewhere,
        signs=(1, 0),
        needs=_POSITION,
        to_twin=_elsewhere_twin,
        contains=_ANYWHERE,
    ),
    Form(
        "cable-force",
        "spring with inner friction",
        ("stiffness_nm_per_arm_rad", "constant_nm", "hysteresis_nm"),
        _lossy,
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
        _stiffening,
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
        _lossy_stiffening,
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
        _cubic,
        ("neutral_arm_rad",),
        _neutrals,
        signs=(1,),
        limits=_within_stroke,
        needs=_POSITION,
        to_twin=_cubic_twin,
        contains=_ANYWHERE,
    ),
)
