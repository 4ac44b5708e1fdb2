"""Warmth and time are told apart by a tenth of what either explains, other laws by a twentieth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.rivals import with_rivals
from agent.explain.choosing.search import Library
from agent.explain.forms.library import FORMS
from agent.identify.result import Floats
from tests.lessons.test_worth import bare
from tests.science.explain_joint import Conditions, record, stair
from trajectories import SetPoints


def warms_up() -> Library:
    """Return three recordings of a joint whose Coulomb friction falls as it warms."""

    def falls(points: SetPoints, at: Conditions) -> Floats:
        level = -0.02 * (at.gearbox_degc - 25.0)
        return np.asarray(level * np.sign(points.velocity_rad_s))

    at = (Conditions(25.0, 0.0), Conditions(31.0, 900.0), Conditions(34.0, 1800.0))
    runs = [record(stair((5, 20, 60), 100.0, 12.0), falls, each, k) for k, each in enumerate(at)]
    plain = bare(*runs)
    named = ("Coulomb level", "Coulomb level, steady")
    forms = [form for form in FORMS if form.name in named]
    return Library.of(plain.scene, plain.weighing, forms)


@pytest.mark.parametrize(("missed", "stands"), [(0.08, {"friction-drift"}), (0.12, set())])
def test_a_thermometer_is_not_where_the_oil_rubs(missed: float, stands: set[str]) -> None:
    """Eight percent that a run-in misses of what warmth explains is within how warmth is known."""
    library = warms_up()
    ranked = {scored.form.effect: scored for scored in library.rank([])}
    best = ranked["temperature-dependent-friction"]
    without = library.errors([])

    def behind(scored: Scored) -> Scored:
        lost = missed * (without.sum() - best.error) / without.shape[0]
        return replace(scored, blocks=best.blocks + lost)

    drift = behind(ranked["friction-drift"])
    bump = next(form for form in FORMS if form.name == "bump")
    another = replace(drift, candidate=replace(drift.candidate, form=bump))
    term = with_rivals(library, [], [best, drift, another], best, 0.0, {})
    assert {rival.scored.form.effect for rival in term.rivals} == stands
