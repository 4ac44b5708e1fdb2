"""Two effects whose pair leaves least, and neither of which is the best one alone."""

from __future__ import annotations

import pytest

from agent.explain.choosing.beginnings import other_beginning
from agent.explain.choosing.choice import choose, decided
from fakes.conceal.case import conceal
from tests.science.explain_joint import library_of
from tests.science.test_explain import runs_of, twin_of

LOAD, OFFSET = "load-dependent-friction", frozenset({"torque-offset", "direction-asymmetry"})
SPOTS = frozenset({"local-fault", "position-dependent-friction"})


def test_a_wide_bump_that_is_best_alone_keeps_no_pair_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """An offset and friction under a load: "unexplained" at 3.3 times the noise."""
    # Its flank at the end of the stroke is no place any more; another shape may be best alone.
    monkeypatch.setattr("agent.explain.forms.place._FLANK", 1.0)
    case = conceal(7015, effects=[LOAD, "torque-offset"], design="rich", snr=2.0)
    library = library_of(runs_of(case), twin_of(case), {LOAD} | OFFSET | SPOTS)
    by_the_best = choose(library, rivals=False)
    assert {term.scored.form.effect for term in by_the_best.terms} <= SPOTS
    beginning = other_beginning(library, by_the_best)
    assert beginning is not None
    assert beginning.scored.form.effect in OFFSET
    by_the_pair = choose(library, rivals=False, begun=[beginning])
    assert LOAD in {term.scored.form.effect for term in by_the_pair.terms}
    assert decided(library, by_the_pair, by_the_best)
