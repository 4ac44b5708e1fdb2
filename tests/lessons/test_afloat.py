"""A law that removes the noise of held speeds is none; one that shows where speed changes stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.afloat import afloat
from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.forms import arm, gap
from agent.explain.numbers.heavier import heavier_than_the_joint
from agent.explain.numbers.model import fit_model
from agent.explain.rows.evidence import weigh
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import tabulate
from agent.identify.result import Parameter
from tests.lessons.test_dynamic import GAP, SOFT, seen
from tests.science.explain_joint import TWIN, Conditions, nothing, record, stair

GAPS = gap.FORMS
SPRINGS = arm.FORMS


def noisy_rigid_joint() -> Library:
    run = record(stair((2.0, 6.0, 20.0, 50.0)), nothing, Conditions(), 0)
    noise = 0.1 * np.random.default_rng(0).standard_normal(run.signals.time_s.shape[0])
    assert run.signals.velocity_rad_s is not None
    signals = replace(run.signals, velocity_rad_s=run.signals.velocity_rad_s + noise)
    table = tabulate(TWIN, [replace(run, signals=signals)], 30.0)
    theta = np.array([TWIN.inertia_kg_m2, TWIN.viscous_nm_s_per_rad, TWIN.coulomb_nm, 0.0, 0.0])
    left = np.where(table.used, table.target_nm, 0.0)
    return Library.of(Scene(table, theta, left), weigh(table, left), ())


def test_an_arm_that_floats_while_speeds_are_held_is_no_gap() -> None:
    library = noisy_rigid_joint()
    floating = library.candidate(GAPS[0], (0.001, 0.5, 0.0, 100.0, 0.4, 20.0, 0.0, 0.07, 0.0))
    chosen = replace(choose(library), terms=())
    assert afloat(library, chosen) == set()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(chosen), "candidates", (floating,))
        assert afloat(library, chosen) == {("backlash", "gap")}


def test_an_arm_that_rattles_at_held_speeds_is_one() -> None:
    """A wrist in play was flicker noise: 2.6 mN m were left, where noise was 1.8."""
    library = noisy_rigid_joint()
    rattling = library.candidate(GAPS[0], (0.001, 0.5, 0.0, 100.0, 0.4, 20.0, 0.0, 0.07, 0.0))
    shaken = library.base[:, 0] * TWIN.inertia_kg_m2  # no noise: the motor moves so, and asks
    noise = 0.1 * np.std(rattling.columns) * np.random.default_rng(1).standard_normal(shaken.size)
    library = replace(library, target=shaken + rattling.columns.sum(axis=1) + noise)
    chosen = replace(choose(library), terms=())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(chosen), "candidates", (rattling,))
        assert afloat(library, chosen) == set()


def test_a_spring_that_is_a_low_pass_of_noise_is_no_soft_gear() -> None:
    """Damped, it lets a quarter of the inertia follow slow motion only: the noise is fast."""
    library = noisy_rigid_joint()
    damped = library.candidate(SPRINGS[0], (15.0, 0.8))
    library = replace(library, candidates=(damped,))
    chosen = replace(choose(library, rivals=False), terms=())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(chosen), "candidates", (damped,))
        assert afloat(library, chosen) == {("joint-flexibility", damped.form.name)}


def test_a_soft_gear_that_is_there_stays() -> None:
    scene = seen(SOFT)
    library = Library.of(scene, weigh(scene.table, scene.residual_nm), SPRINGS[:1])
    choice = choose(library, rivals=False)
    assert [t.scored.form.effect for t in choice.terms] == ["joint-flexibility"]
    assert afloat(library, choice) == set()


def test_no_arm_is_heavier_than_the_joint_that_it_is_a_part_of() -> None:
    scene = seen(SOFT)
    library = Library.of(scene, weigh(scene.table, scene.residual_nm), SPRINGS[:1])
    model = fit_model(library, TWIN, choose(library, rivals=False).terms)
    assert heavier_than_the_joint(library, model) == set()
    arm = model.parameters[0]["arm_inertia_kg_m2"].value
    for share, refused in ((1.05, set()), (1.2, {("joint-flexibility", SPRINGS[0].name)})):
        joint = dict(model.base) | {"inertia_kg_m2": Parameter(arm / share, None)}
        assert heavier_than_the_joint(library, replace(model, base=joint)) == refused


def test_a_gap_that_is_there_stays() -> None:
    scene = seen(GAP)
    library = Library.of(scene, weigh(scene.table, scene.residual_nm), GAPS)
    choice = choose(library, rivals=False)
    assert [t.scored.form.effect for t in choice.terms] == ["backlash"]
    assert afloat(library, choice) == set()
