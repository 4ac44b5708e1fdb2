"""`stribeck watch`, `ordinary` and `schedule` on one simulated history."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from agent.cli.app import app
from agent.record.reading import read
from agent.record.writing import write

RUNNER = CliRunner()


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("months") / "history"
    asked = ["fake-history", str(out), "--cycles", "9", "--work", "--wear-day", "7"]
    done = RUNNER.invoke(app, [*asked, "--wear-nm", "0.6", "--wear-days", "1", "--seed", "5"])
    assert done.exit_code == 0, done.output
    return out


def test_watch_asks_for_a_dedicated_cycle_and_exits_with_bad_news(
    history: Path, tmp_path: Path
) -> None:
    dedicated, picture = str(history / "cycle-0001.parquet"), tmp_path / "watch.svg"
    asked = ["watch", str(history / "work"), "--dedicated", dedicated, "--healthy", "7"]
    done = RUNNER.invoke(app, [*asked, "--json", "--picture", str(picture)])
    assert done.exit_code == 1, done.output
    found = json.loads(done.stdout)
    assert found["schema"] == "stribeck.watch/1"
    assert len(found["healthy"]) == 7
    assert [r["recording"] for r in found["recordings"]] == [
        "work-0008.parquet",
        "work-0009.parquet",
    ]
    assert found["asks_now"] is True
    assert any("friction at" in reason for reason in found["recordings"][-1]["reasons"])
    assert "whiteness of the innovations" in picture.read_text(encoding="utf-8")


def test_watch_wants_enough_healthy_recordings(history: Path) -> None:
    dedicated = str(history / "cycle-0001.parquet")
    done = RUNNER.invoke(app, ["watch", str(history / "work"), "--dedicated", dedicated])
    assert "9 of 10 healthy" in str(done.exception)


def test_another_payload_is_not_judged(history: Path, tmp_path: Path) -> None:
    last = read(history / "work" / "work-0009.parquet")
    heavier = last.with_metadata(last.metadata.updated({"payload_kg": 40.0}))
    other = write(heavier, tmp_path / "work-0010.parquet")
    work = [str(history / "work" / f"work-000{k}.parquet") for k in range(1, 6)]
    dedicated = str(history / "cycle-0001.parquet")
    done = RUNNER.invoke(
        app, ["watch", *work, str(other), "--dedicated", dedicated, "--healthy", "5"]
    )
    assert done.exit_code == 0, done.output
    assert "the payload is 40 kg" in done.stdout


def test_ordinary_work_lies_beside_the_dedicated_cycle(history: Path) -> None:
    work = [str(history / "work" / f"work-000{k}.parquet") for k in (1, 2, 3)]
    dedicated = str(history / "cycle-0002.parquet")
    done = RUNNER.invoke(app, ["ordinary", *work, "--dedicated", dedicated, "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["decidable"] is True
    assert len(found["friction"]["ci95_nm"]) == len(found["friction"]["velocity_rad_s"])
    assert found["comparison"]["sentence"]
    text = RUNNER.invoke(app, ["ordinary", *work])
    assert "Friction by speed" in text.stdout


def test_schedule_learns_from_the_history(history: Path) -> None:
    cycles = [str(history / f"cycle-000{k}.parquet") for k in range(1, 9)]
    asked = ["schedule", *cycles, "--no-cache", "--ambient", "15", "--json"]
    done = RUNNER.invoke(app, asked)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["site"]["slope_per_k"] < 0.0
    assert any("8 healthy cycles" in source for source in found["site"]["sources"])
    assert found["last_cycle"]["warmth"] == "comparable"


def test_schedule_needs_no_history_and_says_what_it_takes_for_usual(tmp_path: Path) -> None:
    picture = tmp_path / "rate.svg"
    asked = ["schedule", "--slope", "-1", "--swing", "8", "--picture", str(picture)]
    done = RUNNER.invoke(app, asked)
    assert done.exit_code == 0, done.output
    assert "Change from one experiment to the next" in picture.read_text(encoding="utf-8")
    assert "Test every" in done.stdout
    assert "not known of this joint" in done.stdout
    assert "Friction changes by −1.00 % a degree" in done.stdout
