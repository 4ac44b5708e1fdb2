"""A number is called wrong, and written into a twin, for what the recordings show of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agent.explain.answer.number_sentences import number_sentence
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import extended_twin, fit_model
from agent.explain.numbers.plain_refits import earlier_moves
from agent.explain.numbers.refuted import lasting
from agent.explain.numbers.wrong import wrong_numbers
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import (
    GEAR_RATIO,
    NOISE_NM,
    RATE_HZ,
    TWIN,
    Conditions,
    chosen,
    nothing,
    record,
    stair,
)
from trajectories import SetPoints

SPEEDS = (2.0, 6.0, 20.0, 50.0)


def brake_now_and_then(points: SetPoints, at: Conditions) -> Floats:
    time_s = at.started_s + np.arange(points.position_rad.shape[0]) / RATE_HZ
    return np.asarray(0.18 * np.sign(points.velocity_rad_s) * (time_s % 7.3 < 1.1))


def stribeck(points: SetPoints, at: Conditions) -> Floats:
    del at
    velocity = points.velocity_rad_s
    return np.asarray(0.3 * np.exp(-((velocity / 5.0) ** 2)) * np.sign(velocity))


def test_a_brake_that_drags_now_and_then_is_no_torque_constant() -> None:
    """The factor that does best on the average had been told with an interval from 0.97 to 1.01."""
    runs = [
        record(stair(SPEEDS), brake_now_and_then, Conditions(started_s=3.0 + i), 5 + i)
        for i in range(2)
    ]
    found = study(TWIN, tabulate(TWIN, runs))
    assert "torque-constant-error" not in {number.effect for number in found.numbers}


def test_a_twin_without_a_law_for_what_was_found_keeps_the_numbers_that_fit_without_it() -> None:
    """They had stayed as the effect had bent them: on unseen data worse than before."""
    runs = [record(stair(SPEEDS), stribeck, Conditions(), i) for i in range(2)]
    library, choice = chosen(runs)
    (term,) = choice.terms

    def no_law(scene: Scene, numbers: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
        del scene, numbers
        return ()

    lawless = replace(
        term, scored=replace(term.scored, candidate=_with(term.scored.candidate, no_law))
    )
    with_term = extended_twin(library, TWIN, fit_model(library, TWIN, (lawless,)))
    without = extended_twin(library, TWIN, fit_model(library, TWIN, ()))
    assert with_term.effects == ()
    assert with_term.coulomb_nm == pytest.approx(without.coulomb_nm, rel=0.01)


def _with(candidate: Any, to_twin: Any) -> Any:
    return replace(candidate, form=replace(candidate.form, to_twin=to_twin))


@pytest.mark.parametrize(
    ("loss", "expected"),
    [
        ([1.0, 2.0, 1.5, 2.5, 300.0, 3.0, 1.0, 40.0] * 3, True),  # every block loses, some far more
        ([0.5, -0.4, 0.3, -0.6, 300.0, -0.2, 0.1, -0.5] + [0.2, -0.3] * 8, False),  # one does
        ([1.0, -1.0, 0.9, -1.1] * 6, False),
    ],
)
def test_a_number_far_off_is_no_accident_of_one_block(loss: list[float], expected: bool) -> None:
    """An inertia a hundred times the joint's had not been told, as one block held most of it."""
    assert lasting(np.array(loss)) is expected


def test_a_recorded_simulations_own_torque_is_what_a_factor_multiplies() -> None:
    """However wrong the numbers of the twin beside it are; they had been multiplied instead."""
    run = record(stair(SPEEDS), nothing, Conditions(), 1)
    points = stair(SPEEDS).sample(run.signals.time_s)
    simulated = 0.8 * (
        TWIN.inertia_kg_m2 * points.acceleration_rad_s2
        + TWIN.viscous_nm_s_per_rad * points.velocity_rad_s
        + TWIN.coulomb_nm * np.sign(points.velocity_rad_s)
    )
    asked = replace(run, columns={**run.columns, "torque_simulated_nm": simulated})
    another = replace(TWIN, inertia_kg_m2=0.1, coulomb_nm=0.1)
    (number,) = study(another, tabulate(another, [asked])).numbers
    assert number.effect == "torque-constant-error"
    assert number.parameters["factor"].value == pytest.approx(0.8, rel=0.01)


def test_of_a_recorded_simulations_number_only_what_it_lacks_is_told() -> None:
    changes = {"Coulomb friction": (0.35, 0.42, "N m")}
    said = number_sentence("wrong-number", changes, 1.0, recorded=True).whole
    assert "Coulomb friction is 70.0 mN m more than the simulation has" in said
    assert "0.35" not in said


def test_fits_to_the_first_recordings_end_where_a_simulation_made_of_them_stands() -> None:
    """What it lacks bends its numbers otherwise later: then they are bent, and not wrong."""
    speeds = ((1.5, 3.0, 6.0, 60.0), (20.0, 40.0, 60.0, 80.0))
    runs = [
        record(stair(v), stribeck, Conditions(started_s=-3600.0 * k), k)
        for k, v in enumerate(speeds)
    ]
    last, _ = refit(tabulate(TWIN, runs[1:]))  # of the recording that was made first
    numbers = {name: getattr(TWIN, name) + d for name, d in zip(BASE, last, strict=True)}
    twin = replace(TWIN, **numbers)
    table = tabulate(twin, runs)
    delta, left = refit(table)
    library = Library.of(Scene(table, delta, left), weigh(table, left), ())
    (earlier,) = earlier_moves(library, twin)
    ends = {
        name: abs(earlier[name]) < 0.1 * abs(move) for name, move in zip(BASE, delta, strict=True)
    }
    assert ends["coulomb_nm"]
    assert ends["viscous_nm_s_per_rad"]


@pytest.mark.parametrize(
    ("factor", "heavier", "said"),
    [(1.075, 1.0, {"torque-constant-error"}), (1.0, 1.075, {"gravity-imbalance"})],
)
def test_one_factor_stands_for_numbers_that_leave_more_beside_what_has_no_name(
    factor: float, heavier: float, said: set[str]
) -> None:
    """Stribeck friction bends each number its own way: a constant had been a weight 7 % too low."""
    heavy = replace(TWIN, gravity_sin_nm=-12.0, gravity_cos_nm=5.0)

    def weight_and_stribeck(points: SetPoints, at: Conditions) -> Floats:
        arm = points.position_rad / GEAR_RATIO
        weight = heavy.gravity_sin_nm * np.sin(arm) + heavy.gravity_cos_nm * np.cos(arm)
        return np.asarray(heavier * weight + 0.5 * stribeck(points, at))

    run = record(stair(SPEEDS), weight_and_stribeck, Conditions(), 2)
    torque = run.signals.torque_nm / factor
    table = tabulate(heavy, [replace(run, signals=replace(run.signals, torque_nm=torque))])
    delta, left = refit(table)
    theta = np.array([getattr(heavy, name) for name in BASE])
    library = Library.of(Scene(table, theta + delta, left, given=theta), weigh(table, left), ())
    numbers = wrong_numbers(library, heavy, fit_model(library, heavy, ()), (), NOISE_NM)
    assert {number.effect for number in numbers} == said
