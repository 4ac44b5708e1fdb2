"""A number is called wrong, and written into a twin, for what the recordings show of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agent.explain.numbers.model import extended_twin, fit_model
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import (
    RATE_HZ,
    TWIN,
    Conditions,
    chosen,
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
