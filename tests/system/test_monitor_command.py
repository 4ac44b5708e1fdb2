"""`stribeck monitor` on recordings: files in, a sentence, JSON, a page and an exit code out."""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.cli import main
from agent.cli.history.monitor import MonitorRequest, events_for
from agent.conclude import cycles as kept_cycles
from agent.record.events_file import Event, append_event
from agent.record.recording import Metadata, Recording
from agent.record.writing import write

SPEEDS = (3.0, 6.0, 12.0, 25.0, 50.0, 100.0)
NIGHT = datetime(2026, 1, 5, 2, 0, tzinfo=UTC)
RATE_HZ, PASS_S = 100.0, 1.0
HEALTHY, WORN = 8, 4


def record(
    path: Path,
    night: int,
    *,
    wear_nm: float = 0.0,
    axis: int = 1,
    robot: str = "cell7",
    **extra: Any,
) -> Path:
    """Write one stair, both ways at every speed, about one place."""
    rng = np.random.default_rng([night, axis])
    degc = 26.0 + 4.0 * np.sin(night) + 0.3 * rng.standard_normal()
    velocity = np.repeat([s * v for v in SPEEDS for s in (1.0, -1.0)], int(PASS_S * RATE_HZ))
    time_s = np.arange(velocity.size) / RATE_HZ
    speed = np.abs(velocity)
    level = (0.5 + (0.2 + wear_nm) * np.exp(-speed / 12.0)) * axis
    torque = np.sign(velocity) * (level + 6e-3 * np.exp(-(degc - 26.0) / 30.0) * speed)
    columns = {
        "time_s": time_s,
        "position_rad": np.cumsum(velocity) / RATE_HZ,
        "velocity_rad_s": velocity + 1e-3 * rng.standard_normal(velocity.size),
        "torque_nm": torque + 0.004 * rng.standard_normal(velocity.size),
        "gearbox_temperature_degc": np.full(velocity.size, round(degc, 1)),
    }
    start = (NIGHT + timedelta(days=night)).isoformat()
    metadata = Metadata(robot, axis, 100.0, started_at=start, payload_kg=5.0, extra=extra)
    write(Recording(columns, metadata, str(path)), path)
    return path


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return healthy nights and worn ones, with a cache that has seen them all."""
    folder = tmp_path_factory.mktemp("history")
    for night in range(HEALTHY + WORN):
        worn = 0.25 if night >= HEALTHY else 0.0
        record(folder / f"night-{night:02d}.parquet", night, wear_nm=worn)
    return folder


@pytest.fixture(autouse=True)
def one_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep one cache for all of these tests, and leave the user's own alone."""
    monkeypatch.setenv("STRIBECK_CACHE", str(tmp_path_factory.getbasetemp() / "stribeck-cache"))


def stribeck(monkeypatch: pytest.MonkeyPatch, arguments: Sequence[object]) -> int:
    """Run the command in this process and return its exit code."""
    monkeypatch.setattr(sys, "argv", ["stribeck", "monitor", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def test_a_worn_joint_is_an_alarm_with_json_page_and_exit_code(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    code = stribeck(monkeypatch, [kept, "--baseline", HEALTHY, "--json", "--out", out])
    said = capsys.readouterr()
    document = json.loads(said.out)
    assert code == 1
    assert document["schema"] == "stribeck.monitor/1"
    assert document == json.loads((out / "monitor.json").read_text())
    (joint,) = document["joints"]
    assert (joint["state"] in ("H0", "H1"), document["alarm"]) == (True, True)
    low, high = (joint["comparison"]["effects"][k] for k in ("low", "high"))
    assert low["ci95_nm"][0] > 0.05
    assert low["change_percent"] > 5.0 * abs(high["change_percent"])
    assert joint["reasons"]["causes"][0]["cause"] == "wear"
    (segment,) = joint["segments"]
    assert len(segment["features"]["low_integral_w"]["at_reference"]) == HEALTHY + WORN
    assert "report.html" in said.err
    page = (out / "report.html").read_text()
    assert "Alarm: friction has increased" in page
    assert not re.search(r'(src|href)="(?!data:|#)', page)


def test_explain_is_asked_what_an_alarm_is_and_says_that_it_is_time(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    code = stribeck(monkeypatch, [kept, "--baseline", HEALTHY, "--explain", "--json", "--out", out])
    assert code == 1
    (joint,) = json.loads(capsys.readouterr().out)["joints"]
    assert re.match(r"Asked of 7 healthy and 3 present cycles", joint["explanation"]["sentence"])
    assert "friction that changes with time or use" in joint["explanation"]["sentence"]
    (page,) = re.findall(r'href="(explanation-[^"]+)"', (out / "report.html").read_text())
    assert (out / page).is_file()


def test_siblings_teach_and_are_not_judged_and_too_few_are_said(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for night in range(3):
        record(tmp_path / f"other-{night}.parquet", night, robot="cell8", axis=1)
    young = [kept / f"night-{night:02d}.parquet" for night in range(HEALTHY)]
    given = ["--siblings", tmp_path / "*.parquet", "--siblings", kept]
    assert stribeck(monkeypatch, [*young, *given, "--json"]) == 0
    (joint,) = json.loads(capsys.readouterr().out)["joints"]
    assert (joint["robot"], joint["cycles"]) == ("cell7", HEALTHY)
    known = joint["siblings"]
    assert (known["known"], known["grown"], known["features"]) == (1, [], {})
    assert "0 of the 1 that are known have lived long enough" in known["sentence"]
    assert stribeck(monkeypatch, [*young, *given, "--out", tmp_path / "out"]) == 0
    assert known["sentence"] in capsys.readouterr().out
    assert known["sentence"] in (tmp_path / "out" / "report.html").read_text()


def test_the_second_call_estimates_nothing_again(
    kept: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert stribeck(monkeypatch, [kept, "--baseline", HEALTHY]) == 1
    first = capsys.readouterr().out
    with monkeypatch.context() as patch:
        patch.setattr(kept_cycles, "estimate", None)
        assert stribeck(patch, [kept, "--baseline", HEALTHY]) == 1
    assert capsys.readouterr().out == first
    assert "ALARM: friction has increased" in first
    assert ": most likely wear in the gearbox.\n" in first
    assert first.count("ost likely") == 1


def test_a_cache_that_is_spoiled_or_changed_bytes_are_estimated_anew(
    kept: Path, tmp_path: Path
) -> None:
    one, cache = tmp_path / "night.parquet", tmp_path / "cache"
    shutil.copy(kept / "night-00.parquet", one)
    shares: list[float] = []
    healthy, _ = kept_cycles.cycles_of([one], cache, lambda _what, share: shares.append(share))
    kept_cycles.cycles_of([one], cache, lambda _what, share: shares.append(share))
    assert shares == [0.0, 1.0]  # what is kept needs no bar
    for entry in cache.glob("cycle-*.json"):
        entry.write_text('{"half": ')
    again, _ = kept_cycles.cycles_of([one], cache)
    assert again[0].to_json() == healthy[0].to_json()
    one.unlink()
    record(one, 0, wear_nm=0.3)
    worn, _ = kept_cycles.cycles_of([one], cache)
    assert worn[0].fingerprint != healthy[0].fingerprint
    assert worn[0].curve is not None
    assert healthy[0].curve is not None
    assert worn[0].curve.friction_nm[0] > healthy[0].curve.friction_nm[0] + 0.2


def test_what_does_not_belong_is_told_apart_and_said(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "mixed"
    folder.mkdir()
    for night in range(HEALTHY + 1):
        name = f"night-{night:02d}.parquet"
        source = kept / name if night < HEALTHY else record(tmp_path / name, 40)
        shutil.copy(source, folder / name)
    record(folder / "night-03-axis2.parquet", 3, axis=2)
    shutil.copy(folder / "night-04.parquet", folder / "copy.parquet")
    (folder / "torn.parquet").write_bytes(b"PAR1 and then the power went")
    code = stribeck(monkeypatch, [folder, "--baseline", HEALTHY, "--json"])
    document = json.loads(capsys.readouterr().out)
    first, second = document["joints"]
    assert code == 0
    assert (first["state"], first["cycles"]) == ("NF", HEALTHY + 1)
    assert "same samples as copy.parquet" in first["set_aside"][0]["reason"]
    assert second["axis"] == 2
    assert second["sentence"] == f"Not decidable yet: 1 of {HEALTHY} healthy cycles."
    assert [u["name"] for u in document["unreadable"]] == ["torn.parquet"]


def test_events_beside_the_recordings_start_a_new_baseline(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    events = tmp_path / "events.toml"
    changed = (NIGHT + timedelta(days=HEALTHY - 1, hours=12)).date().isoformat()
    events.write_text(
        'schema = "stribeck.events/1"\n[[events]]\n'
        f'at = {changed}\nkind = "swap"\naxis = 1\nnote = "gearbox G2"\n'
    )
    code = stribeck(monkeypatch, [kept, "--events", events])
    said = capsys.readouterr().out
    assert code == 0
    assert f"of 8 healthy cycles since the swap (gearbox G2) on {changed}" in said


def test_what_the_agent_wrote_down_of_a_joint_is_an_event_too(
    kept: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(kept / "night-00.parquet", tmp_path)
    append_event(tmp_path, Event(NIGHT.isoformat(), "oil", "VG 220", robot="cell7", axis=1))
    append_event(tmp_path, Event(NIGHT.isoformat(), "alarm", "is none of these"))
    with (tmp_path / "events.jsonl").open("a") as lines:
        lines.write("torn")
    (event,) = events_for(MonitorRequest([str(tmp_path)]), [tmp_path / "night-00.parquet"])
    assert (event.label, event.axis) == ("oil change (VG 220)", 1)
    assert event.at_s == NIGHT.timestamp()
    assert "line 3 is no event" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--low-speed", "500"], "must end between"),
        (["--events", "nowhere.toml"], "nowhere.toml: cannot be read"),
    ],
)
def test_an_option_that_does_not_fit_the_history_is_bad_input(
    arguments: list[str],
    sentence: str,
    kept: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert stribeck(monkeypatch, [kept, *arguments]) == 3
    said = capsys.readouterr()
    assert sentence in said.err
    assert said.out == ""


def test_a_history_of_nothing_is_bad_input(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert stribeck(monkeypatch, [tmp_path]) == 3
    assert "the folder holds no recording" in capsys.readouterr().err
    (tmp_path / "torn.parquet").write_bytes(b"PAR1")
    assert stribeck(monkeypatch, [tmp_path]) == 3
    assert "Nothing of this history can be used." in capsys.readouterr().err
