"""What the drive makes of its signals: a channel that is late, a torque that is clipped."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.reversal import hysteresis
from agent.explain.rows.pieces import without_overshoot
from agent.explain.rows.saturation import saturation_evidence
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_DELAYS_S = tuple(1e-3 * d for d in (-32, -16, -8, -4, -2, -1, 1, 2, 4, 8, 16, 32))
_SHORTEST_DELAY_S = 2e-4
_YIELDS_ARM_RAD = 1e-4  # before contacts slip: the lower end of what joints show


def _delay_grid(scene: Scene) -> Sequence[Point]:
    del scene
    return tuple((d,) for d in _DELAYS_S)


def _delay(scene: Scene, point: Point) -> Floats:
    """Return the refitted torque, later by a trial delay, less itself, over the trial, (N, 1).

    Its coefficient is the torque's delay, below zero where the motion is the late one; the trial
    only bends the column, to the second order of how far it is from the delay; in the end it is the
    delay found. Dry friction turns
    round within a little travel, as it does in every joint: a jump would reach through the filter
    to where friction has long settled, and make all delays too long.
    """
    trial_s = math.copysign(max(abs(point[0]), _SHORTEST_DELAY_S), point[0])
    predicted = turning_round(scene)
    out = np.zeros(predicted.shape[0])
    for at, _ in scene.each_piece():
        time, torque = scene.full("time_s")[at], predicted[at]
        out[at] = (np.interp(time - trial_s, time, torque) - torque) / trial_s
    return stack(out)


def turning_round(scene: Scene) -> Floats:
    """Return the refitted torque whose dry friction turns round within a travel, shape (N,)."""
    yielding = hysteresis(scene, _YIELDS_ARM_RAD * scene.table.gear_ratio)
    return np.asarray(scene.not_late_nm + float(scene.theta[2]) * (yielding - scene.direction))


def _delay_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return ({"torque_delay_s": values["torque_delay_s"]},)


def _limit_grid(scene: Scene) -> Sequence[Point]:
    """Return the torque at which the drive clips, if there are signs of it."""
    evidence = saturation_evidence(scene.table)
    return () if evidence is None else ((evidence.limit_nm,),)


def _saturation(scene: Scene, point: Point) -> Floats:
    """Return what a limit takes from the refitted torque, shape (N, 1), where none overshoots."""
    table = scene.table
    even = replace(table, full=without_overshoot(table.full, table.pieces))
    torque = replace(scene, table=even).predicted_nm
    return stack(np.clip(torque, -point[0], point[0]) - torque)


def _saturation_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene
    return ({"limit_nm": values["limit_nm"]},)


FORMS: tuple[Form, ...] = (
    Form(
        "measurement-delay",
        "torque late or early",
        ("torque_delay_s",),
        _delay,
        ("trial_s",),
        _delay_grid,
        at_edges=True,
        to_twin=_delay_twin,
        point_of=lambda coefficients: (float(coefficients[0]),),
        rests_on_numbers=True,
    ),
    Form(
        "torque-saturation",
        "clipped",
        ("share",),
        _saturation,
        ("limit_nm",),
        _limit_grid,
        (1,),
        refine=False,
        to_twin=_saturation_twin,
        rests_on_numbers=True,
    ),
)
