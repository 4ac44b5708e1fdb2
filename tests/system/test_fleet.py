"""A fleet as its engineer runs it: pushed, estimated on workers, judged, ranked."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb
import psutil
import pytest

from agent.conclude.outcome import conclude
from agent.fleet.estimates import estimates_of
from agent.fleet.lake import Lake
from agent.fleet.listing import listed
from agent.fleet.verdicts import verdicts_of
from agent.record.reading import read
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from drivers.clock import MonotonicClock
from fakes.history import HistoryPlan, Wear, cycles
from tests.conftest import REPOSITORY
from tests.system.processes import PATIENCE_S, STRIBECK, called, stribeck

NIGHTS = 18
MODELS: dict[str, dict[str, str]] = {"worn": {"robot_model": "IRB 6650"}, "healthy": {}}


@dataclass(frozen=True)
class Plant:
    """Two robots of one model in a lake, one of them worn, and a file that is no recording."""

    lake: Lake
    folder: Path


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    folder = tmp_path_factory.mktemp("plant")
    lake = Lake(str(folder / "lake"))
    for robot, wear in (("healthy", None), ("worn", Wear(11.0, 3.0, 0.3))):
        plan = HistoryPlan(cycles=NIGHTS, seed=5, events=() if wear is None else (wear,))
        for run in cycles(plan):
            known = Metadata.from_json({**run.metadata, "robot": robot, **MODELS[robot]}, run.name)
            path = folder / robot / f"{run.name}.parquet"
            path.parent.mkdir(exist_ok=True)
            lake.push(write(Recording(run.columns, known), path), "north")
    half = read_first(lake).replace("axis=1", "axis=7")
    lake.put(half, b"PAR1 and then the line was cut")
    return Plant(lake, folder)


def read_first(lake: Lake) -> str:
    """Return the first recording's path in a lake."""
    there = listed(lake)
    return next(there.entries(there.months[0])).path


def document_of(done: subprocess.CompletedProcess[str], expect: int = 0) -> dict[str, Any]:
    """Return the JSON that a command of the fleet ended with."""
    assert done.returncode == expect, done.stderr
    document: dict[str, Any] = json.loads(done.stdout)
    return document


@pytest.fixture(scope="module")
def estimated(plant: Plant) -> tuple[Plant, dict[str, Any]]:
    """Return the plant, estimated while one of the workers was killed, and what was said of it."""
    command = [*STRIBECK, "fleet", "estimate", plant.lake.url, "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        kill_one(psutil.Process(process.pid), after_cpu_s=2.5)
        out, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    return plant, json.loads(out)


def kill_one(parent: psutil.Process, after_cpu_s: float) -> None:
    """Kill the first worker below a process that has worked for some seconds."""
    clock = MonotonicClock()
    end = clock.now() + 120.0
    while clock.now() < end:
        for child in parent.children(recursive=True):
            with suppress(psutil.NoSuchProcess):  # it has just ended
                if child.cpu_times().user > after_cpu_s:
                    child.kill()
                    return
        clock.sleep_until(clock.now() + 0.05)
    raise AssertionError("no worker came to work")


def test_a_killed_worker_loses_nothing_and_nothing_is_done_twice(
    estimated: tuple[Plant, dict[str, Any]],
) -> None:
    plant, said = estimated
    assert (said["estimated"], said["already"]) == (2 * NIGHTS, 0)
    (unusable,) = said["unusable"]
    assert "not what was pushed" in unusable
    again = document_of(called("fleet", "estimate", plant.lake.url, "--json"))
    assert (again["estimated"], again["already"]) == (0, 2 * NIGHTS + 1)


def test_the_answer_is_the_one_of_one_machine_bit_for_bit(
    estimated: tuple[Plant, dict[str, Any]],
) -> None:
    plant, _ = estimated
    rows = [r for r in estimates_of(plant.lake).rows() if not r["failure"]]
    assert len(rows) == 2 * NIGHTS
    for row in rows[::NIGHTS]:
        alone = conclude([read(Path(plant.lake.url) / row["key"])])
        assert row["estimate"] == alone.json()


def test_the_worn_joint_is_found_named_and_first(estimated: tuple[Plant, dict[str, Any]]) -> None:
    plant, _ = estimated
    command = ("fleet", "monitor", plant.lake.url, "--workers", "1", "--json")
    judged = document_of(stribeck(*command), expect=1)
    assert (judged["judged"], judged["already"], judged["unusable"]) == (2, 0, [])
    worn, healthy = judged["joints"]
    assert (worn["robot"], worn["alarm"]) == ("worn", True)
    assert (healthy["robot"], healthy["state"]) == ("healthy", "NF")
    assert worn["low_rise_from_percent"] > 0.0
    assert (worn["model"], healthy["model"]) == ("IRB 6650", "model not recorded")

    roster = Path(plant.lake.url) / "fleet.toml"
    roster.write_text('schema = "stribeck.fleet/1"\n[[model]]\nname = "M"\nrobots = ["healthy"]\n')
    named = document_of(stribeck(*command), expect=1)
    assert (named["judged"], named["already"]) == (0, 2)
    assert [joint["model"] for joint in named["joints"]] == ["IRB 6650", "M"]
    roster.unlink()
    assert document_of(stribeck(*command), expect=1)["joints"] == judged["joints"]

    (row,) = [r for r in verdicts_of(plant.lake).rows() if r["robot"] == "worn"]
    everything = f"{plant.lake.url}/recordings/**/robot=worn/**/*"
    alone = called("monitor", "--no-cache", "--json", everything)
    assert json.loads(row["finding"]) == json.loads(alone.stdout)["joints"][0]

    page = plant.folder / "fleet.html"
    done = called("fleet", "report", plant.lake.url, "--out", page)
    assert "see to worn, axis 1 first" in done.stdout
    assert "not what was pushed" in page.read_text()
    assert "1 joint is compared with no other" in page.read_text()

    text = (REPOSITORY / "docs" / "fleet.md").read_text(encoding="utf-8")
    queries = re.findall(r"```sql\n(.*?)```", text, re.DOTALL)
    assert len(queries) == 5
    for query in queries:
        found = duckdb.sql(query.replace("LAKE", plant.lake.url))
        assert found is not None
        assert found.fetchall(), query


@pytest.mark.parametrize("known", [[], ["forgotten"]])
def test_what_ends_its_worker_is_known_and_takes_nobody_along(known: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.system.fleet_poison", *known],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        cwd=REPOSITORY,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    values, failures = json.loads(done.stdout)
    assert values == {str(i): i * i for i in range(12) if i not in (7, 9)}
    assert "ended its worker process" in failures["7"]
    assert failures["9"] == "ValueError: nine is refused"


def test_a_lake_without_estimates_says_what_comes_first(tmp_path: Path, plant: Plant) -> None:
    first = Path(plant.lake.url) / read_first(plant.lake)
    lake = str(tmp_path / "lake")
    assert called("fleet", "push", lake, first, "--site", "north").returncode == 0
    done = called("fleet", "monitor", lake, "--workers", "1")
    assert done.returncode == 0
    assert "`stribeck fleet estimate`" in done.stderr
    assert "0 joints judged" in done.stdout
