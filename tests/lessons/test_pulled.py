"""Friction under a load of which a cable makes a part: neither is right without the other."""

from __future__ import annotations

from agent.explain.numbers.anew import chosen_anew
from fakes.conceal.case import conceal
from tests.science.explain_joint import library_of
from tests.science.test_explain import runs_of, twin_of

LOAD, CABLE = "load-dependent-friction", "cable-force"
ASKED = (LOAD, CABLE, "torque-offset", "direction-asymmetry", "local-fault")


def test_a_cable_is_found_beside_friction_under_its_own_pull() -> None:
    """One after the other, an offset had stood for the cable (and in 310102 spots as well)."""
    case = conceal(8042, effects=[LOAD, CABLE], design="rich", snr=0.5)
    _, choice = chosen_anew(library_of(runs_of(case), twin_of(case), ASKED))
    assert {term.scored.form.effect for term in choice.terms} == {LOAD, CABLE}
