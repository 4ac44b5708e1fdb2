"""What changes with use: friction that wears, or runs in, as the joint is driven."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.forms.grid import log_grid
from agent.explain.rows.scene import Scene
from agent.explain.rows.use import OPERATING, TURNED, before_each, in_order, recorded_use
from agent.identify.result import Floats
from agent.physics.friction_drift import LinearDrift, coming_share

_LEAST, _MOST, _POINTS = 0.1, 3.0, 5  # of all that was recorded: where a running-in settles
_LEVEL = LinearDrift(coulomb_nm_per_step=1.0)
_SLOPE = LinearDrift(viscous_nm_s_per_rad_per_step=1.0)


@dataclass(frozen=True)
class _Measure:
    """One measure of use: its column, how it is called, and its unit in a twin."""

    column: str
    called: str
    unit: str
    per_unit: float
    counted: str

    def grown(self, scene: Scene) -> Floats:
        """Return the use since the recordings' mean, in the twin's unit, shape (N,)."""
        return np.asarray((scene.full(self.column) - scene.mean(self.column)) / self.per_unit)

    def odometer(self, scene: Scene) -> dict[str, Any]:
        """Return when the recordings began and how much had been recorded by then; {} undated."""
        table = scene.table
        use = (*recorded_use(table.runs, table.pieces, table.full), *table.elsewhere)
        if not in_order(use):
            return {}
        shown = [
            (began.started_at_unix_s, before, own)
            for began, before, own in zip(use, before_each(use), use, strict=True)
        ]
        shown.sort(key=lambda each: each[0])
        last = shown[-1][2]
        instants = [began for began, _, _ in shown] + [shown[-1][0] + last.seconds]
        counts = [self._counted(before) for _, before, _ in shown]
        return {
            "recorded_from": [datetime.fromtimestamp(t, tz=UTC).isoformat() for t in instants],
            self.counted: [*counts, counts[-1] + self._counted(last)],
        }

    def _counted(self, use: Any) -> float:
        amount = use.seconds if self.column == OPERATING else use.turned_rad
        return float(amount / self.per_unit)


_MEASURES = (
    _Measure(OPERATING, "operating time", "operating_h", 3600.0, "operating_h"),
    _Measure(TURNED, "the motor's turns", "1000_turns", 2000.0 * math.pi, "motor_1000_turns"),
)


def _forms(measure: _Measure) -> tuple[Form, ...]:
    """Return the forms of one measure of use: steady, and running in."""

    def grown(scene: Scene, law: LinearDrift) -> Floats:
        velocity = scene.full("velocity_rad_s")
        return law.torque_nm(velocity, scene.direction, measure.grown(scene))

    def coulomb(scene: Scene, point: Point) -> Floats:
        del point
        return stack(grown(scene, _LEVEL))

    def both(scene: Scene, point: Point) -> Floats:
        del point
        return stack(grown(scene, _LEVEL), grown(scene, _SLOPE))

    def run_in(scene: Scene, point: Point) -> Floats:
        used = scene.full(measure.column) / measure.per_unit
        return stack(scene.direction * coming_share(used, point[0]))

    def grid(scene: Scene) -> Sequence[Point]:
        whole = scene.span(measure.column)[1] / measure.per_unit
        return tuple((u,) for u in log_grid(_LEAST * whole, _MOST * whole, _POINTS))

    def steady_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
        odometer = measure.odometer(scene)
        if not odometer:
            return ()
        reference = scene.mean(measure.column) / measure.per_unit
        return ({**values, f"reference_{measure.unit}": reference, **odometer},)

    def run_in_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
        """Return the change since the first sample; what was there then belongs to the base."""
        odometer = measure.odometer(scene)
        if not odometer:
            return ()
        settling = f"settling_{measure.unit}"
        change = {"coulomb_change_nm": -values["run_in_nm"], settling: values[settling]}
        return ({**change, **odometer},)

    names = (f"coulomb_nm_per_{measure.unit}", f"viscous_nm_s_per_rad_per_{measure.unit}")
    # Several recordings: within one, a cycle's speeds are driven in an order, as turns are counted.
    needs = tuple(dict.fromkeys((measure.column, OPERATING)))
    return (
        Form(
            "friction-drift",
            f"Coulomb level, steady with {measure.called}",
            names[:1],
            coulomb,
            needs=needs,
            to_twin=steady_twin,
            catch_all=True,
        ),
        Form(
            "friction-drift",
            f"Coulomb and viscous, steady with {measure.called}",
            names,
            both,
            needs=needs,
            to_twin=steady_twin,
            catch_all=True,
        ),
        Form(
            "friction-drift",
            f"run-in with {measure.called}",
            ("run_in_nm",),
            run_in,
            (f"settling_{measure.unit}",),
            grid,
            needs=needs,
            to_twin=run_in_twin,
            catch_all=True,
        ),
    )


FORMS: tuple[Form, ...] = tuple(form for measure in _MEASURES for form in _forms(measure))
"""Each measure's forms; the twin's numbers say which it is."""
