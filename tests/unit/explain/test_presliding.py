"""Friction that yields: it remembers where samples were lost, and all that slides yields."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.explain.forms.form import Form
from agent.explain.forms.reversal import FORMS
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.explain.rows.twin_effects import effects_nm
from agent.identify.result import Floats
from agent.identify.signals.simulated import simulated_torque_nm
from agent.physics.twin import Effect, Twin

TIME = np.arange(0.0, 12.0, 0.002)
# It turns round at 9 s and creeps back by a tenth of the travel after which all of it slides, ...
VELOCITY = np.where(TIME < 9.0, 3.0 * np.sin(0.5 * np.pi * TIME), -0.04)
LOST = (TIME > 9.2) & (TIME < 9.24)  # ... and 20 samples of the creeping never arrived.
AFTER = np.arange(9.4, 11.8, 0.01)
PLAIN = Twin("plant", 1, 100.0, 0.005, 0.6, 0.0)


def run_of(kept: NDArray[np.bool_]) -> Run:
    position = 0.002 * np.cumsum(VELOCITY)
    torque = 0.6 * np.sign(VELOCITY) + 1e-3 * np.cos(1e4 * TIME)
    names = ("time_s", "velocity_rad_s", "position_rad", "torque_nm")
    recorded = dict(zip(names, (TIME, VELOCITY, position, torque), strict=True))
    return Run.from_columns({n: x[kept] for n, x in recorded.items()}, 100.0, name="run")


def scene_of(run: Run) -> Scene:
    table = tabulate(PLAIN, [run], 20.0)
    theta = np.array([getattr(PLAIN, name) for name in BASE])
    return Scene(table, theta, np.zeros_like(table.target_nm))


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_creeping_is_known_behind_a_gap_as_it_is_without_one(form: Form) -> None:
    dahl = form is FORMS[0]
    law = {"stiffness_nm_per_rad": 2.0} if dahl else {"sliding_travel_rad": 1.0}
    twin = replace(PLAIN, effects=(Effect("presliding-hysteresis", law),))

    def said(kept: NDArray[np.bool_]) -> Floats:
        run = run_of(kept)
        scene = scene_of(run)
        table = scene.table
        grown = (
            form.columns(scene, (0.3,) if dahl else (1.0, 2.0))[:, 0],
            effects_nm(twin, table.runs, table.pieces, table.full),
        )
        in_file = simulated_torque_nm(twin, run.signals, run.columns)
        return np.stack(
            [np.interp(AFTER, table.full["time_s"], x) for x in grown]
            + [np.interp(AFTER, run.signals.time_s, in_file)]
        )

    whole = said(np.ones(TIME.shape, dtype=np.bool_))
    # Begun anew behind the gap all of it would have turned round: 0 beside the sign, -0.6 N m.
    assert (np.abs(whole - [[0.0], [0.0], [-0.6]]) > 0.6).all()
    assert said(~LOST) == pytest.approx(whole, abs=0.01)


def test_what_yields_is_all_of_sliding_friction() -> None:
    scene = scene_of(run_of(np.ones(TIME.shape, dtype=np.bool_)))
    half = replace(scene, sliding=(lambda of: -0.5 * of.theta[2] * of.direction,))
    spring, _, elements = FORMS
    # Elements that each slip at a travel of their own know no level; one spring has half as far.
    assert elements.columns(half, (0.3, 2.0)) == pytest.approx(
        0.5 * elements.columns(scene, (0.3, 2.0))
    )
    assert spring.columns(half, (0.3,)) == pytest.approx(
        0.5 * spring.columns(scene, (0.15,)), abs=0.01
    )


def test_a_spring_beside_friction_that_falls_is_the_twins_own() -> None:
    """Its reach had been Coulomb friction's, whatever hung on it: a twin left six times as much."""
    fall = {"static_extra_nm": 0.4, "stribeck_velocity_rad_s": 1.0, "exponent": 1.0}
    laws = Effect("stribeck", fall), Effect("presliding-hysteresis", {"stiffness_nm_per_rad": 3.0})
    scene = scene_of(run_of(np.ones(TIME.shape, dtype=np.bool_)))
    table = scene.table
    falls, both = (
        effects_nm(replace(PLAIN, effects=laws[:n]), table.runs, table.pieces, table.full)
        for n in (1, 2)
    )
    beside = replace(scene, sliding=(lambda _: falls,))
    column = FORMS[0].columns(beside, (0.6 / 3.0,))[:, 0]
    assert 0.6 * column == pytest.approx(both - falls, abs=0.01)
