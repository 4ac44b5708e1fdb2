"""The night's verdict against the baseline: what of the monitor's finding is written down."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from agent.cli.history import verdict as night_verdict
from agent.cli.history.verdict import against_baseline, history_of, state_of
from agent.errors import InputError
from agent.record.catalogue.catalogue import Catalogue
from agent.record.retention import Limits, plan_retention
from agent.record.seal import content
from agent.record.verdict_file import read_verdict, verdict_path
from tests.record.test_catalogue import made

AXIS = "cell7-irb6650-axis1"


def finding(names: list[str], **changes: Any) -> Any:
    """A monitor's finding as far as the night reads it: two cycles of baseline, then an alarm."""
    joint = SimpleNamespace(robot="cell7-irb6650", axis=1)
    cycles = tuple(SimpleNamespace(name=name) for name in names)
    track = SimpleNamespace(
        segment=SimpleNamespace(start=0), baseline=SimpleNamespace(cycles=min(2, len(names)))
    )
    values: dict[str, Any] = {
        "history": SimpleNamespace(joint=joint, cycles=cycles, set_aside=()),
        "current": track,
        "alarm": True,
        "status": "H1",
        "sentence": "Friction has grown by 30 %.",
        "timing": ("The change began in May.",),
        "comparison": None,
        "next_steps": (),
        "compared_with": 0,
        "since_first": None,
        "fallen": None,
    }
    return SimpleNamespace(**{**values, **changes})


@pytest.fixture
def recordings(tmp_path: Path) -> list[Path]:
    return [made(tmp_path, f"{AXIS}-{day}", day=day) for day in (1, 2, 3, 4)]


def judge_by(monkeypatch: pytest.MonkeyPatch, found: Any) -> list[Any]:
    asked: list[Any] = []

    def monitor(request: Any) -> Any:
        asked.append(request)
        if isinstance(found, Exception):
            raise found
        return SimpleNamespace(findings=(found,))

    monkeypatch.setattr(night_verdict, "monitor", monitor)
    return asked


def test_an_alarm_is_written_with_its_baseline_which_then_never_goes(
    recordings: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    newest = recordings[-1]
    asked = judge_by(monkeypatch, finding([path.name for path in recordings]))
    verdict = against_baseline(newest, read_verdict(verdict_path(newest)))
    assert asked[0].patterns == [str(path) for path in recordings]
    assert (verdict.alarm, verdict.state) == (True, "H1")
    assert verdict.sentence == "Friction has grown by 30 %. The change began in May."
    assert verdict.baseline == tuple(content(path).sha256 for path in recordings[:2])
    assert read_verdict(verdict_path(newest)) == verdict
    assert verdict.facts == {"said": "baseline-complete", "healthy": 2}
    older = json.loads(verdict_path(newest).read_text())
    del older["facts"]  # as it was written before there were any
    verdict_path(newest).write_text(json.dumps(older))
    assert read_verdict(verdict_path(newest)) == replace(verdict, facts={})
    # and judged again, as it was: by what there was up to that recording
    assert state_of(newest, verdict, history_of(newest, verdict)) == "H1"
    assert history_of(recordings[1], verdict) == [str(path) for path in recordings[:2]]
    with Catalogue(newest.parent) as catalogue:
        catalogue.rebuild()
        assert [v.alarm for v in catalogue.verdicts()] == [False, False, False, True]
        fates = plan_retention(catalogue, Limits(days=0.0), "2027-01-01T00:00:00Z")
    assert [fate.goes for fate in fates] == [False, False, True, False]


def test_friction_that_rises_from_the_first_cycle_on_keeps_the_cycles_it_is_compared_with(
    recordings: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    judge_by(monkeypatch, finding([path.name for path in recordings], compared_with=3))
    verdict = against_baseline(recordings[-1], read_verdict(verdict_path(recordings[-1])))
    assert verdict.baseline == tuple(content(path).sha256 for path in recordings[:3])


def test_a_cycle_that_was_set_aside_is_no_alarm_of_its_own(
    recordings: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    newest = recordings[-1]
    found = finding([path.name for path in recordings[:-1]])
    found.history.set_aside = (SimpleNamespace(name=newest.name, reason="another trajectory"),)
    judge_by(monkeypatch, found)
    verdict = against_baseline(newest, read_verdict(verdict_path(newest)))
    assert not verdict.alarm
    assert verdict.sentence.endswith("Not compared with its history: another trajectory.")
    assert verdict.baseline == ()


def test_a_history_that_cannot_be_judged_leaves_the_cycle_s_own_verdict(
    recordings: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    newest = recordings[-1]
    before = read_verdict(verdict_path(newest))
    judge_by(monkeypatch, InputError("Nothing of this history can be used."))
    verdict = against_baseline(newest, before)
    assert verdict.sentence == (
        f"{before.sentence} No verdict on its history: Nothing of this history can be used."
    )
    assert read_verdict(verdict_path(newest)) == before
