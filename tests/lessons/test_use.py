"""Friction that grows with use: by an odometer over what was recorded, and not by the clock."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from agent.explain import proof
from agent.explain.choosing.by_use import clock_or_use
from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.explain import explain
from agent.explain.forms.library import FORMS
from agent.explain.numbers.model import extended_twin, fit_model
from agent.explain.rows.run import Run
from agent.explain.rows.use import used_elsewhere
from agent.identify.result import Floats
from agent.physics.effects.motion import path_rad
from agent.physics.twin import format_twin, parse_twin
from tests.lessons.test_worth import bare
from tests.science.explain_joint import (
    NOISE_NM,
    TWIN,
    Conditions,
    record,
    stair,
)
from trajectories import SetPoints

SLOW, FAST = stair((2, 4, 8), 40.0, 12.0), stair((20, 40, 60), 100.0, 12.0)
CYCLES = (FAST, SLOW, FAST, SLOW, FAST)
HOURS = (0.0, 0.5, 7.0, 7.2, 30.0)  # no even steps: a clock is no odometer


def used(measure: str) -> list[Run]:
    """Return recordings in which wear has gone by its measure of use alone."""
    before, runs = 0.0, []
    for index, (cycle, hour) in enumerate(zip(CYCLES, HOURS, strict=True)):

        def worn(points: SetPoints, at: Conditions, before: float = before) -> Floats:
            del at
            return 0.1 * (before + amount(points, measure)) * np.sign(points.velocity_rad_s)

        runs.append(record(cycle, worn, Conditions(started_s=1.7e9 + 3600.0 * hour), index))
        time = runs[-1].signals.time_s
        before += float(amount(cycle.sample(time), measure, time)[-1])
    return runs


def amount(points: SetPoints, measure: str, time: Floats | None = None) -> Floats:
    """Return use since a recording began, in units of about one recording, shape (n,)."""
    at = np.arange(points.velocity_rad_s.shape[0]) / 250.0 if time is None else time
    return at / 12.0 if measure == "operating" else path_rad(at, points.velocity_rad_s) / 300.0


@pytest.mark.parametrize(
    ("measure", "number", "truth"),
    [
        ("operating", "coulomb_nm_per_operating_h", 0.1 * 3600.0 / 12.0),
        ("turned", "coulomb_nm_per_1000_turns", 0.1 * 2000.0 * math.pi / 300.0),
    ],
)
def test_wear_goes_by_its_own_odometer_on_recordings_that_nobody_had_seen(
    measure: str, number: str, truth: float
) -> None:
    *known, unseen = used(measure)
    plain = bare(*known)
    forms = [form for form in FORMS if form.effect == "friction-drift"]
    library = Library.of(plain.scene, plain.weighing, forms)
    choice = choose(library)
    assert number in choice.terms[0].scored.form.linear
    assert "and not with the clock" in clock_or_use(library, choice)
    model = fit_model(library, TWIN, choice.terms)
    assert model.parameters[0][number].value == pytest.approx(truth, rel=0.05)
    # The twin as it is written down knows what every recording began with, the unseen one, too.
    twin = parse_twin(format_twin(extended_twin(library, TWIN, model)))
    for runs in ([unseen], [known[2]], [*known, unseen]):
        compared, _ = proof.compare_runs(TWIN, TWIN, twin, runs, plain.scene.table)
        assert np.std(compared.extended) < 0.7 * NOISE_NM < np.std(compared.given)
    later = replace(unseen, started_s=unseen.started_s + 3600.0)
    compared, _ = proof.compare_runs(TWIN, TWIN, twin, [unseen, later], plain.scene.table)
    before, after = np.array_split(compared.given - compared.extended, 2)
    assert np.mean(np.abs(after)) > 1.1 * np.mean(np.abs(before))


@pytest.mark.parametrize("measure", ["operating", "turned"])
def test_a_hold_out_in_between_has_used_the_joint_as_well(measure: str) -> None:
    """Of it nothing but when it ran and how far it went counts for those that are learnt from."""
    first, second, unseen, fourth, last = used(measure)
    answer = explain(TWIN, [first, second, fourth, last], [unseen])
    assert [finding.effect for finding in answer.findings] == ["friction-drift"]
    assert answer.holdout is not None
    assert answer.holdout.floor_ratio < 1.1
    assert answer.extended.rmse_nm < 1.1 * answer.floor.value_nm


def test_hold_outs_that_began_at_once_do_not_hide_in_which_order_the_others_ran() -> None:
    first, second, *later = used("operating")
    at_once = [replace(run, started_s=later[0].started_s) for run in later]
    assert used_elsewhere(at_once, [first, second]) == ()
    assert len(used_elsewhere([*at_once[:1], second], [first])) == 2
