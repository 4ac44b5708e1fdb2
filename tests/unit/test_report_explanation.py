"""What people see of an explanation: every verdict has its page and its text, whole and escaped."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import pytest

from agent.cli.explanation_text import WIDTH, explanation_text
from agent.explain.result import Explanation
from agent.report.explanation import explanation_page
from agent.report.explanation_words import EFFECTS, decidable, verdict_words
from tests.unit import explanation_examples as examples
from tests.unit.test_report_page import Page

Case = Callable[[], Explanation]
EFFECT_IDS = {
    "stribeck",
    "viscous-nonlinear",
    "direction-asymmetry",
    "load-dependent-friction",
    "temperature-dependent-friction",
    "position-dependent-friction",
    "presliding-hysteresis",
    "friction-drift",
    "torque-ripple",
    "kinematic-error",
    "torque-constant-error",
    "torque-offset",
    "torque-saturation",
    "measurement-delay",
    "resolver-error",
    "inertia-error",
    "wrong-number",
    "gravity-imbalance",
    "cable-force",
    "joint-flexibility",
    "backlash",
    "local-fault",
}


@functools.cache
def explanation(case: Case) -> Explanation:
    return case()


@functools.cache
def page(case: Case) -> tuple[str, Page]:
    text = explanation_page(
        explanation(case), robot="cell7", axis=1, next_file="next.json", metadata=examples.METADATA
    )
    return text, Page(text)


@pytest.mark.parametrize("case", examples.ALL)
def test_every_verdict_has_its_page_offline_and_whole(case: Case) -> None:
    text, parsed = page(case)
    words = verdict_words(explanation(case))
    assert len(parsed.all("h1")) == 1
    assert words.status in parsed.text
    assert "default-src 'none'" in text
    assert "http:" not in text
    assert "https:" not in text
    assert not parsed.all("script")
    ids = [attributes["id"] for _, attributes in parsed.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    for _, attributes in parsed.elements:
        assert attributes.get("aria-labelledby", ids[0]) in ids
    assert all(len(image["alt"]) > 40 for image in parsed.all("img"))
    assert len(parsed.all("table")) == len(parsed.all("caption"))
    assert len(text.encode()) < 1_500_000


def test_every_effect_of_the_contract_is_called_something() -> None:
    assert set(EFFECTS) == EFFECT_IDS


@pytest.mark.parametrize("case", examples.ALL)
def test_text_fits_a_terminal_and_begins_with_the_answer(case: Case) -> None:
    lines = explanation_text(explanation(case), axis=1, next_file="next.json").splitlines()
    assert lines[0] == f"{verdict_words(explanation(case)).status}."
    first = " ".join(explanation(case).sentence.split()[:6])
    assert lines[1].strip().startswith(first)
    assert max(map(len, lines)) <= WIDTH


def test_not_decidable_shows_reasons_and_no_numbers() -> None:
    _, parsed = page(examples.undecided)
    assert not decidable(explanation(examples.undecided))
    for reason in explanation(examples.undecided).reasons:
        assert reason in parsed.text
    assert not parsed.all("img")
    assert "N m" not in parsed.text


def test_names_from_outside_are_text_and_nothing_else() -> None:
    hostile = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> {{ 7*7 }} $x$"
    plain = explanation(examples.undecided)
    made = dataclasses.replace(
        plain,
        sentence=hostile,
        reasons=(hostile,),
        recordings=(hostile,),
        not_judged={hostile: hostile},
    )
    parsed = Page(explanation_page(made, title=hostile, robot=hostile, axis=hostile))
    assert not parsed.all("script")
    assert not parsed.all("img")
    assert hostile in "".join(parsed.words)
