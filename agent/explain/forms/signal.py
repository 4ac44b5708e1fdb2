"""What the drive makes of its signals: a channel that is late, a torque that is clipped."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.reversal import hysteresis
from agent.explain.rows.evidence import weigh
from agent.explain.rows.pieces import without_overshoot
from agent.explain.rows.saturation import saturation_evidence
from agent.explain.rows.scene import Scene
from agent.explain.rows.slow_motion import Slow, by_slow_motion
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats
from agent.physics.reported import limited_nm

_DELAYS_S = tuple(1e-3 * d for d in (-32, -16, -8, -4, -2, -1, 1, 2, 4, 8, 16, 32))
_SHORTEST_DELAY_S = 2e-4
REACH_S, CLOSELY_S = 0.012, 5e-5
"""How far from what a bent column gives a delay is searched for, and how closely."""

_SETTLES = 2
_FAR = 0.5  # of a delay: slow motion that says so much else is of something else
_LONGEST_DELAY_S = 0.05
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

    Where all is known to be late already, that is the trial, and the torque is the twin's as given:
    what its numbers are moved by is late by itself (`later_by_numbers`).
    """
    if scene.late_s:
        own = _own_nm(scene, scene.as_given)
        return stack(_later_less_itself(scene, own, scene.late_s) / scene.late_s)
    trial_s = math.copysign(max(abs(point[0]), _SHORTEST_DELAY_S), point[0])
    return stack(_later_less_itself(scene, turning_round(scene), trial_s) / trial_s)


def later_by_numbers(scene: Scene) -> Floats:
    """Return what the twin's structure has more where all is late, by its numbers, shape (N, 5)."""
    nothing = _own_nm(scene, np.zeros(len(BASE)))
    units = (_own_nm(scene, unit) - nothing for unit in np.eye(len(BASE)))
    return stack(*(_later_less_itself(scene, unit, scene.late_s) for unit in units))


def _own_nm(scene: Scene, theta: Floats) -> Floats:
    """Return the torque of the twin's own structure with some numbers, shape (N,)."""
    alone = replace(scene, theta=theta, held=None, beside=(), sliding=(), late_s=0.0)
    return turning_round(alone)


def _later_less_itself(scene: Scene, torque_nm: Floats, by_s: float) -> Floats:
    out, passed, shift_s = np.empty_like(torque_nm), torque_nm, by_s
    if scene.late_s and scene.lag_s:  # a part of the lateness is a low-pass's
        passed, shift_s = scene.smoothed(torque_nm), by_s - scene.lag_s
    for at, _ in scene.each_piece():
        time = scene.full("time_s")[at]
        out[at] = np.interp(time - shift_s, time, passed[at]) - torque_nm[at]
    return out


def turning_round(scene: Scene) -> Floats:
    """Return the refitted torque whose dry friction turns round within a travel, shape (N,).

    It is that of the motion as recorded: the smooth one has passed the band's filter already, and
    what passes it twice is a tenth smaller and more in the band's upper half.
    """
    yielding = hysteresis(scene, _YIELDS_ARM_RAD * scene.table.gear_ratio)
    dry_nm = float(scene.theta[2]) * (yielding - scene.direction)
    return np.asarray(scene.not_late_nm + dry_nm + scene.not_smooth_nm)


def _delay_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    """Return the delay that slow motion has, where that is known well; else what was fitted.

    Beside a torque on time the same torque later has the noise of an acceleration twice, and least
    squares take the mean of both: a delay too short by a tenth and more where fast motion counts.
    """
    found_s = values["torque_delay_s"]
    slow = _slow_delay(scene, found_s)
    far_s = _FAR * max(abs(slow.value), abs(found_s))
    known = slow.known and abs(slow.value - found_s) < far_s
    late_s = slow.value if known else found_s
    lag_s = scene.lag_s if scene.late_s else 0.0
    if not lag_s:
        return ({"torque_delay_s": late_s},)
    return ({"torque_delay_s": late_s - lag_s, "torque_lag_s": lag_s},)


def _slow_delay(scene: Scene, found_s: float) -> Slow:
    """Return the delay of all of the torque in slow motion, beside a model's other terms.

    Where these are late already, so is what the twin's own numbers are moved by.
    """
    table, weighing = scene.table, weigh(scene.table, scene.residual_nm)
    others = np.zeros_like(table.target_nm) if scene.others_nm is None else scene.others_nm
    target = weighing.weighted(table.target_nm - others)
    slow = Slow(found_s, math.inf)
    for _ in range(_SETTLES):  # the trial delay is in the end the one that its column says
        trial = replace(scene, late_s=slow.value) if scene.late_s else scene
        late, base = _delay(trial, (slow.value,)), table.base
        if scene.late_s:
            base = base + table.band(table.where_speed_changes(later_by_numbers(trial)))
        seen = table.band(table.where_speed_changes(late))
        columns = weighing.weighted(np.column_stack((seen, base[:, table.carried])))
        slow = by_slow_motion(table, weighing, columns, target, found_s)
        if not _SHORTEST_DELAY_S < abs(slow.value) < _LONGEST_DELAY_S:
            return Slow(found_s, math.inf)
    return slow


def turn_s(table: Table) -> float:
    """Return the delay that turns the fastest wave of the band by a radian, s."""
    return 1.0 / (2.0 * math.pi * table.cutoff_hz)


def nearest_delay(
    left: Callable[[float], float], around_s: float, reach_s: float = REACH_S
) -> float:
    """Return the delay, not far from another, that leaves least."""
    from scipy.optimize import minimize_scalar

    ends = around_s - reach_s, around_s + reach_s
    found = minimize_scalar(left, bounds=ends, method="bounded", options={"xatol": CLOSELY_S})
    return float(found.x)


def _limit_grid(scene: Scene) -> Sequence[Point]:
    """Return the torque at which the drive clips, if there are signs of it."""
    evidence = saturation_evidence(scene.table)
    return () if evidence is None else ((evidence.limit_nm,),)


def _saturation(scene: Scene, point: Point) -> Floats:
    """Return what a limit takes from what is asked for, shape (N, 1).

    That is the refitted torque where none overshoots, or a recorded simulation's own.
    """
    table = scene.table
    if table.simulated:
        torque = table.full["torque_simulated_nm"]
    else:
        even = replace(table, full=without_overshoot(table.full, table.pieces))
        torque = replace(scene, table=even).predicted_nm
    return stack(limited_nm(torque, *point) - torque)


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
