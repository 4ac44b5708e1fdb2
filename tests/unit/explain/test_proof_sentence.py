"""One sentence says what findings are worth on data that was not seen, whichever way it went."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from agent.explain.answer.fits import UNSEEN, Fit, Holdout
from agent.explain.answer.located import Alternative, Finding
from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.result import Explanation, Floor, Verdict
from agent.explain.answer.said import Said
from agent.explain.answer.ties import is_tied
from agent.explain.answer.words import proof_sentence, summary_of
from agent.explain.unnamed import taken_back, unproven


def _holdout(before_nm: float, after_nm: float) -> Holdout:
    before, after = Fit(before_nm, 90.0), Fit(after_nm, 90.0)
    return Holdout("recordings unseen", before, before, after, 0.0, None, 1.0, 1, 2, 0.0, True)


def _said(verdict: Verdict, floor_nm: float, refitted: Fit, **parts: Any) -> str:
    """Return the answer of an explanation that has some parts, and no others."""
    plain: dict[str, Any] = {
        "reasons": (),
        "baseline": Fit(),
        "extended": Fit(),
        "holdout": None,
        "findings": (),
        "unexplained_share": 0.001,
        "unexplained_where": (),
        "cells": (),
        "moved": (),
        "next_experiment": None,
        "recordings": (),
        "held_out": (),
    }
    floor = Floor(floor_nm, floor_nm, math.nan, math.nan)
    known = {"verdict": verdict, "sentence": "", "floor": floor, "refitted": refitted}
    return summary_of(Explanation(**(plain | known | parts)))


@pytest.mark.parametrize(
    ("before_nm", "after_nm", "said"),
    [
        (0.0105, 0.00625, "the error falls from 10 to 6.2 mN m; noise is 6.1 mN m."),
        (0.00625, 0.00621, "the error stays at 6.2 mN m; noise is 6.1 mN m."),
        (
            0.0062,
            0.0105,
            "the error does not fall: it goes from 6.2 to 10 mN m; noise is 6.1 mN m. "
            "What was found does not hold there.",
        ),
    ],
)
def test_sentence_is_the_way_the_error_went(before_nm: float, after_nm: float, said: str) -> None:
    sentence = proof_sentence(_holdout(before_nm, after_nm), 0.0061)
    assert sentence == f"On recordings unseen {said}"


def test_names_that_unseen_recordings_do_not_bear_out_are_said_to_be_unproven() -> None:
    """A real arm without a gear had a gear's wobble, where the error left out went 2.1 to 1.9."""
    fell = replace(_holdout(2.1, 1.9), floor_ratio=5.1)
    said = proof_sentence(replace(fell, improvement_ci95_percent=(-14.7, 46.2)), 0.36)
    assert "from 2.1 to 1.9 N m (by \N{MINUS SIGN}15 to 46 %); noise is 0.36 N m." in said
    assert said.endswith(" What was found is not proven.")
    assert "proven" not in proof_sentence(replace(fell, improvement_ci95_percent=(3.0, 46.2)), 0.36)


@pytest.mark.parametrize(
    ("low_percent", "after_nm", "unsure"),
    [(-0.6, 0.00991, True), (0.3, 0.00991, False), (-0.6, 0.0089, False)],
)
def test_what_takes_next_to_nothing_of_unseen_recordings_is_a_suspicion(
    low_percent: float, after_nm: float, unsure: bool
) -> None:
    """Friction along the position, 59 % of a gap's mismatch, took 8 % of a fourth recording's."""
    interval, ratio = (low_percent, 1.6), after_nm / 0.00862
    proven = replace(_holdout(0.01, after_nm), floor_ratio=ratio, source=UNSEEN)
    assert replace(proven, improvement_ci95_percent=interval).unsure is unsure


def test_a_mismatch_of_the_unseen_recordings_alone_is_said_to_be_theirs() -> None:
    """All that was fitted has a name: not "less than 1 % has no name, and follows nothing"."""
    finding = Finding(
        "stribeck", 1, 1.0, 1.0, (), Said("Stribeck explains all."), {}, (), 0.0, "a form"
    )
    unseen = replace(_holdout(0.013, 0.0034), floor_ratio=2.4)
    said = _said("partly-explained", 0.0014, Fit(0.008, 96.0), findings=(finding,), holdout=unseen)
    assert "has no name" not in said
    assert "2.4 times the noise: these hold something that the recordings to learn from" in said


def test_what_is_wrong_with_a_simulation_that_only_refitting_brings_to_the_noise() -> None:
    """Not: "off by 11 where noise is 11, and no effect of the library carries that"."""
    refitted, given = Fit(0.0112, 99.1), Fit(0.015, 98.8)
    said = _said("unexplained", 0.0107, refitted, baseline=given, unexplained_share=1.0)
    assert said.startswith("The simulation as given is off by 15 mN m rms where noise is 11 mN m.")


def test_a_torque_limit_is_not_judged_by_torque() -> None:
    limit = Finding("torque-saturation", 1, 1.0, 0.0, (), Said("The drive clips."), {})
    said = _said("explained", 2.0, Fit(), findings=(limit,), holdout=_holdout(2.0, 2.2))
    assert said == "The drive clips."


@pytest.mark.parametrize(
    ("verdict", "floor_ratio", "after_nm", "named"),
    [
        ("explained", 1.2, 0.0125, False),
        ("explained", 1.2, 0.0115, True),
        ("explained", 3.3, 0.02, True),  # they have a mismatch of their own
        ("partly-explained", 3.3, 0.02, False),  # and so has what it was fitted to
        ("partly-explained", 3.3, 0.0125, True),
    ],
)
def test_a_law_that_harms_what_it_was_not_fitted_to_is_taken_back(
    verdict: Verdict, floor_ratio: float, after_nm: float, named: bool
) -> None:
    """Stribeck, of what a simulator smooths, where it hardly shows; a clutch, as load friction."""
    finding = Finding("stribeck", 1, 1.0, 1.0, (), Said(""), {}, (), 0.0, "a form")
    proven = replace(
        _holdout(0.011, after_nm),
        floor_ratio=floor_ratio,
        improvement_ci95_percent=(-15.0, -8.0),
        white=False,
    )
    said = taken_back(verdict, [finding], proven)
    assert (said == ()) is named
    assert named or "(Stribeck) would carry what was fitted, and was taken back" in said[0]


@pytest.mark.parametrize(("verdict", "named"), [("partly-explained", False), ("tied", True)])
def test_laws_beside_which_unseen_recordings_ask_for_the_numbers_alone_are_taken_back(
    verdict: Verdict, named: bool
) -> None:
    """Five of them, each for certain: 11 mN m where the numbers alone left 6.2, 15 as given."""
    finding = Finding("friction-drift", 1, 1.0, 0.2, (), Said(""), {}, (), 0.0, "a form")
    proven = replace(
        _holdout(0.0146, 0.0111),
        source=UNSEEN,
        refitted=Fit(0.0062, 96.0),
        improvement_percent=24.4,
        improvement_ci95_percent=(21.5, 28.0),
    )
    said = taken_back(verdict, [finding], proven)
    assert (said == ()) is named
    assert named or "6.2 mN m with the simulation's numbers alone refitted" in said[0]


@pytest.mark.parametrize(
    ("floor_ratio", "improvement_percent", "named"),
    [(math.nan, -1.3, False), (math.nan, 4.0, True), (1.02, -1.3, True)],
)
def test_without_a_noise_floor_unseen_recordings_have_to_be_better(
    floor_ratio: float, improvement_percent: float, named: bool
) -> None:
    """A bump that made 3 % of what a joint leaves that lacks nothing."""
    bump = Finding("local-fault", 1, 1.0, 0.03, (), Said(""), {}, (), 0.0, "rubbing")
    proven = replace(
        _holdout(0.00187, 0.0019),
        source=UNSEEN,
        floor_ratio=floor_ratio,
        improvement_percent=improvement_percent,
        improvement_ci95_percent=(-3.3, 5.0),
    )
    assert (taken_back("tied", [bump], proven) == ()) is named


@pytest.mark.parametrize(
    ("refitted_nm", "after_nm", "claimed", "proven"),
    [
        (0.054, 0.049, 0.8, False),  # a third of what stands above the noise
        (0.054, 0.049, 0.3, True),  # nor was more claimed
        (0.054, 0.038, 0.8, True),
        (0.038, 0.037, 0.8, True),  # next to nothing stands above the noise
    ],
)
def test_laws_that_take_little_of_what_they_claim_elsewhere_are_not_proven(
    refitted_nm: float, after_nm: float, claimed: float, proven: bool
) -> None:
    """A bouncing gap: "explains 82 %, the error falls from 54 to 49 mN m; noise is 36"."""
    held_out = replace(_holdout(refitted_nm, after_nm), source=UNSEEN, floor_ratio=after_nm / 0.036)
    assert unproven(held_out, 1.0, claimed) is not proven


def test_how_little_is_gone_elsewhere_is_said() -> None:
    gap = Finding("backlash", 1, 1.0, 0.8, (), Said("The gear has play."), {}, (), 0.0, "gap")
    held_out = replace(_holdout(0.054, 0.049), source=UNSEEN, floor_ratio=1.36)
    said = _said("partly-explained", 0.036, Fit(0.054, 90.0), findings=(gap,), holdout=held_out)
    assert said.endswith("What was found takes away 32 % of what stands above the noise there.")


@pytest.mark.parametrize(("share", "tied"), [(0.05, False), (0.6, True)])
def test_a_small_error_of_a_number_ties_nothing(share: float, tied: bool) -> None:
    """Friction that differs between the directions, and an inertia or a constant 1 % off."""
    law = Finding("direction-asymmetry", 1, 1.0, 1.0, (), Said(""), {}, (), 0.0, "Coulomb")
    rival = (Alternative("inertia-error", 0.5, "Compare them with their known values."),)
    number = replace(law, effect="torque-constant-error", form=OWN_NUMBER, energy_share=share)
    number = replace(number, alternatives=rival)
    assert is_tied([law, number]) is tied
    assert is_tied([number])
