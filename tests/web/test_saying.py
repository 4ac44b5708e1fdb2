"""What the engine decides, in German: by what was decided, with the engine's own numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from agent.cell.cell import parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.conclude.facts import SAID as DECIDED
from agent.conclude.facts import facts_of
from agent.cycle.preconditions import preconditions
from agent.monitor.detection.detectors import detector
from agent.monitor.history.history import histories
from agent.monitor.verdict.reasons import WORDS as CAUSE_WORDS
from agent.monitor.verdict.verdict import Finding, judge
from agent.monitor.verdict.words import parts_of
from agent.record.verdict_file import Verdict
from agent.report.advice import advised, next_steps
from agent.web.words import saying
from agent.web.words.verdict import ADVICE, CAUSES, REFUSED, SAID
from fakes.specification import FakeSpecification
from tests.unit.monitor.joint import Truth, months
from tests.web.bench import Bench


def verdict_on(finding: Finding) -> Verdict:
    return Verdict(
        "x.parquet",
        "0" * 64,
        "cell7",
        2,
        "2026-03-01",
        "",
        True,
        finding.alarm,
        finding.status,
        finding.sentence,
        facts=facts_of(finding),
    )


def judged(cycles: int, truth: Truth | None = None) -> Verdict:
    (history,) = histories(months(1, cycles, truth))
    return verdict_on(judge(history, detector(), 30))


def numbers(text: str) -> list[str]:
    """Return the per cents and degrees of a sentence, in either language's writing."""
    return re.findall(r"[+−]?\d+[.,]\d (?=%)|\d+(?= °C)", text)


def plain(found: list[str]) -> list[float]:
    return [float(n.replace("−", "-").replace(",", ".")) for n in found]


@pytest.fixture(scope="module")
def worn() -> Verdict:
    return judged(50, Truth(wear_nm=0.2, onset=32))


def test_an_alarm_in_german_has_the_numbers_of_the_engine_s_own_sentence(worn: Verdict) -> None:
    assert worn.alarm
    said = saying.verdict("de", worn)
    assert said.language == "de"
    assert said.text.startswith("Die Reibung ist ")
    assert "Verschleiß im Getriebe" in said.text
    shown = plain(numbers(said.text))
    assert len(shown) == 5  # two changes with their intervals' upper ends, and the temperature
    _, its_numbers = parts_of(worn.sentence)
    assert shown == plain(numbers(parts_of(its_numbers)[0]))
    assert "zwischen" in said.text
    assert saying.verdict("en", worn) == (worn.sentence, "en")
    assert "Fettprobe" in " ".join(s.text for s in saying.steps("de", worn))
    assert "grease sample" in " ".join(s.text for s in saying.steps("en", worn))


@pytest.mark.parametrize(
    ("cycles", "begins"),
    [(4, "Noch nicht entscheidbar: 4 von 30"), (30, "Die Referenz aus 30"), (40, "Kein Alarm, ")],
)
def test_a_joint_without_alarm_is_said_in_german_too(cycles: int, begins: str) -> None:
    verdict = judged(cycles)
    said = saying.verdict("de", verdict)
    assert said.text.startswith(begins)
    assert plain(numbers(said.text)) == plain(numbers(verdict.sentence))
    assert "{" not in said.text


def test_whatever_may_be_decided_has_its_german(worn: Verdict) -> None:
    assert set(SAID) == set(DECIDED)
    assert set(CAUSES) == set(CAUSE_WORDS)
    everything = (
        "too slow; does not move; no torque; saturat; gear; one direction; steady; cold; lost",
    )
    assert list(advised(everything)) == list(ADVICE)
    assert len(next_steps(everything)) == len(ADVICE)
    cell = parse_cell(fake_cell_text(FakeSpecification(), interface="virtual", channel="x"))
    assert {p.name for p in preconditions(cell, cell.axis[0])} <= set(REFUSED)
    for said in DECIDED:
        more = {"needed": 30, "moved": "lower", "cycles": 20, "since_first": worn.facts["low"]}
        of_it = replace(worn, facts={**worn.facts, "said": said, **more})
        assert saying.verdict("de", of_it).language == "de", said


@pytest.mark.parametrize(
    "facts",
    [
        {},
        {"said": "another"},
        {"said": "increased"},
        {"said": "increased", "low": 3, "high": []},
        {"said": "moved", "moved": "sideways"},
        {"said": ["increased"]},
    ],
)
def test_facts_of_another_version_or_spoilt_ones_leave_the_engine_s_english(
    worn: Verdict, facts: dict[str, Any]
) -> None:
    spoilt = replace(worn, facts=facts)
    assert saying.verdict("de", spoilt) == (worn.sentence, "en")
    assert saying.steps("de", spoilt) == []


def test_the_page_says_it_in_german_and_marks_what_stays_english(bench: Bench) -> None:
    from agent.web.roles import Role

    bench.shelve("first", 1)
    bench.shelve("poor", 2, decidable=False)
    browser = bench.browser(Role.TECHNICIAN)
    german = {"accept-language": "de"}
    text = browser.get("/results/poor", **german).text
    assert '<span lang="de">Die Treppe fahren' in text
    assert '<span lang="en">one speed only &lt;b&gt;</span>' in text
    assert "Drive more speeds." not in text
    assert "Drive more speeds." in browser.get("/results/poor").text
