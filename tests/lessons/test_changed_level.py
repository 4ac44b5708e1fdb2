"""Friction that is another from one recording on is told as that, and a drift as a drift."""

from __future__ import annotations

from dataclasses import replace

import pytest

from agent.explain.answer.result import Explanation
from agent.explain.explain import explain
from tests.science.textbook_joint import TWIN, nothing, recorded, stair

SPEEDS_RAD_S = (4.0, 8.0, 15.0, 28.0)
HOUR_S = 3600.0


def explained(more_nm: tuple[float, ...]) -> Explanation:
    """Return the answer for recordings an hour apart, the last two held out."""
    *fit, one, other = (
        recorded(
            stair([(1.0 + 0.05 * seed) * v for v in SPEEDS_RAD_S]),
            nothing,
            0.02,
            seed,
            replace(TWIN, coulomb_nm=TWIN.coulomb_nm + more),
            started_s=1.7e9 + seed * HOUR_S,
        )
        for seed, more in enumerate(more_nm)
    )
    return explain(TWIN, fit, [one, other])


def test_a_change_is_told_with_the_recordings_between_which_it_came() -> None:
    answer = explained((0.0, 0.0, 0.08, 0.08, 0.08, 0.08))
    (finding,) = answer.findings
    assert (answer.verdict, finding.effect) == ("explained", "friction-drift")
    assert finding.parameters["coulomb_step_nm"].value == pytest.approx(0.08, abs=0.004)
    assert "80 mN m more from one recording on" in answer.sentence
    assert "The change came between run-1 and run-2." in answer.sentence
    assert answer.twin is not None
    (entry,) = answer.twin.effects
    assert entry.parameters["changed_at"] == "2023-11-15T00:13:20+00:00"


def test_what_grows_steadily_is_no_change() -> None:
    answer = explained((0.0, 0.02, 0.04, 0.06, 0.08, 0.1))
    (finding,) = answer.findings
    assert finding.parameters["coulomb_nm_per_h"].value == pytest.approx(0.02, rel=0.1)
