"""A law of time alone that was found first gives way to two others that together leave noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.forms.library import FORMS
from agent.explain.numbers.anew import _without_time
from agent.identify.result import Floats
from tests.lessons.test_worth import bare
from tests.science.explain_joint import Conditions, record, stair
from trajectories import SetPoints


@pytest.mark.parametrize("drifts", [False, True])
def test_a_drift_that_hides_two_laws_gives_way_and_one_that_is_there_stays(drifts: bool) -> None:
    """Beside a drift of friction at every speed neither warmth nor the bend was of use."""

    def missing(points: SetPoints, at: Conditions) -> Floats:
        speed = points.velocity_rad_s
        thin = 0.01 * np.exp((20.0 - at.gearbox_degc) / 12.0) * speed
        bent = 0.5 * np.abs(speed / 60.0) ** 1.8 * np.sign(speed)
        hours = at.started_s / 3600.0
        return np.asarray(hours * (0.1 * np.sign(speed) + 0.005 * speed) if drifts else thin + bent)

    runs = [
        record(stair((5, 15, 30, 60), 200.0, 12.0), missing, Conditions(t, 900.0 * k), k)
        for k, t in enumerate((20.0, 27.0, 31.0, 35.0))
    ]
    plain = bare(*runs)
    named = ("viscosity", "power law", "Coulomb and viscous, steady")
    forms = [form for form in FORMS if form.name in named]
    library = Library.of(plain.scene, plain.weighing, forms)
    of_time = tuple(c for c in library.candidates if c.form.catch_all)
    first = choose(replace(library, candidates=of_time), rivals=False)
    assert [term.scored.form.effect for term in first.terms] == ["friction-drift"]
    found, choice = _without_time(library, library, first)
    effects = {"viscous-nonlinear", "temperature-dependent-friction"}
    expected = {"friction-drift"} if drifts else effects
    assert {term.scored.form.effect for term in choice.terms} == expected
    assert {c.form.effect for c in found.candidates} == {"friction-drift", *effects}
