"""`stribeck night` on a cell: a cycle in a process of its own, its verdict, its events."""

from __future__ import annotations

import datetime
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from typer.testing import CliRunner

from agent.cell.cell import read_cell
from agent.cli.app import app
from agent.cli.night.asked import asked_for
from agent.cli.night.cell import CellAttempts
from agent.cli.night.child import what_became
from agent.cli.night.night import _alone
from agent.cli.terminal.talk import talker
from agent.errors import InputError, RefusedError, StoppedError
from agent.night.clock import MachineClock
from agent.night.description import night_path, read_night
from agent.night.windows import Window
from agent.record.catalogue.catalogue import Catalogue
from agent.record.events_file import read_events
from agent.record.verdict_file import read_verdict
from drivers.errors import BusError
from tests.night.test_telling import Receiver
from tests.system.rig import rig

HOUR = datetime.timedelta(hours=1)


def night_text(**changes: Any) -> str:
    """Return a night whose window is open now and for hours."""
    now = datetime.datetime.now(tz=datetime.UTC)
    window = f"{now - 2 * HOUR:%H:%M}-{now + 4 * HOUR:%H:%M}"
    axis = {"number": 1, "window": window, **changes.pop("axis", {})}
    document = {"schema": "stribeck.night/1", "time_zone": "UTC", "axis": [axis], **changes}
    return tomli_w.dumps(document)


@pytest.fixture(scope="module")
def replayed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a cell whose axis is a recording, as fast as it can be played."""
    folder = tmp_path_factory.mktemp("cell")
    seen: list[dict[str, Any]] = []
    with rig(folder, edit=seen.append) as made:
        recording = made.run().recording
    bus = {"interface": "replay", "channel": recording.name, "options": {"real_time": False}}
    (folder / "cell.toml").write_text(tomli_w.dumps({**seen[0], "bus": bus}))
    return folder


@pytest.fixture
def cell(replayed: Path, tmp_path: Path) -> Path:
    shutil.copytree(replayed, tmp_path / "cell")
    path = tmp_path / "cell" / "cell.toml"
    night_path(path).write_text(night_text())
    return path


def edited(cell: Path, edit: Callable[[dict[str, Any]], None]) -> Path:
    import tomllib

    document = tomllib.loads(cell.read_text())
    edit(document)
    cell.write_text(tomli_w.dumps(document))
    return cell


def test_a_night_from_the_window_to_a_verdict_that_verifies(cell: Path) -> None:
    run = CliRunner().invoke
    answer = run(app, ["night", str(cell), "--once"])
    assert answer.exit_code == 0, answer.output
    folder = cell.parent / "recordings"
    events = [event for _, event in read_events(folder)[0]]
    assert [e.kind for e in events] == ["night", "begun", "run"]
    (verdict_file,) = folder.glob("*.verdict.json")
    verdict = read_verdict(verdict_file)
    assert events[-1].recording == verdict.recording_sha256
    # the monitor has judged: one cycle is no baseline, and that is said
    assert events[-1].text == verdict.sentence
    assert verdict.state == "not decidable"
    assert verdict.baseline == (verdict.recording_sha256,)
    assert events[-1].details["numbers"]["coulomb_nm"] == verdict.numbers["coulomb_nm"]
    with Catalogue(folder) as catalogue:
        (row,) = catalogue.recordings()
        (judged,) = catalogue.verdicts()
        assert row.sha256 == judged.recording_sha256 == events[-1].recording
        assert len(catalogue.estimates()) == 1
        kept = (catalogue.recordings(), catalogue.verdicts(), catalogue.events())
        catalogue.rebuild()
        assert (catalogue.recordings(), catalogue.verdicts(), catalogue.events()) == kept
    again = run(app, ["verify", str(folder), "--recompute"])
    assert again.exit_code == 0
    assert "the same verdict again" in again.stdout
    # one attempt a night, also of another process
    assert run(app, ["night", str(cell), "--once"]).exit_code == 0
    assert len(read_events(folder)[0]) == 3


def attempts(cell: Path, stopped: Callable[[], bool] = lambda: False) -> CellAttempts:
    night = read_night(night_path(cell))
    return CellAttempts(cell, read_cell(cell), night, MachineClock(), stopped)


def window(ends_in_s: float) -> Window:
    now = datetime.datetime.now(tz=datetime.UTC)
    return Window(1, now.date(), now - HOUR, now + datetime.timedelta(seconds=ends_in_s))


def test_a_night_that_is_asked_to_stop_stops_its_cycle_and_keeps_what_was_recorded(
    cell: Path,
) -> None:
    edited(cell, lambda d: d["bus"]["options"].update(real_time=True))
    folder = cell.parent / "recordings"
    hands = attempts(cell, lambda: any(p.stat().st_size > 40e3 for p in folder.glob("*.arrows")))
    outcome = hands.attempt(window(ends_in_s=120.0))
    assert outcome.kind == "stopped"
    assert "The night was asked to stop." in outcome.sentence
    assert len(outcome.recording) == 64
    with Catalogue(folder) as catalogue:  # sealed and known, with no verdict
        assert [row.sha256 for row in catalogue.recordings()] == [outcome.recording]
        assert not catalogue.verdicts()


def test_two_programs_do_not_watch_over_one_cell(cell: Path) -> None:
    (cell.parent / "recordings").mkdir()
    with _alone(asked_for(cell, None)):
        answer = CliRunner().invoke(app, ["night", str(cell), "--once"])
    assert isinstance(answer.exception, InputError)
    assert "watched already" in str(answer.exception)


def test_the_window_s_end_before_the_cycle_s_is_a_skip_where_nothing_had_moved(cell: Path) -> None:
    outcome = attempts(cell).attempt(window(ends_in_s=-1.0))
    assert (outcome.kind, outcome.recording) == ("skip", "")
    assert "The quiet window ended." in outcome.sentence


def test_nobody_to_guarantee_for_a_cell_without_a_release(cell: Path) -> None:
    edited(cell, lambda d: d.update(bus={"interface": "virtual", "channel": "nowhere"}))
    assert "no [release], and at night nobody is there" in attempts(cell).blocked(1)


def test_a_folder_that_is_full_blocks_with_its_reason(cell: Path) -> None:
    (cell.parent / "recordings").mkdir()
    (cell.parent / "recordings" / "old.bin").write_bytes(b"x" * 3_000_000)
    night_path(cell).write_text(night_text(disk={"limit_mb": 2.0}))
    assert "3.0 MB, its limit is 2 MB" in attempts(cell).blocked(1)
    assert CliRunner().invoke(app, ["night", str(cell), "--once"]).exit_code == 0
    events, _ = read_events(cell.parent / "recordings")
    assert [event.kind for _, event in events] == ["night", "skip"]


def test_what_became_of_a_cycle_is_told_by_the_kind_of_its_error() -> None:
    refused = RefusedError("Refused, nothing has moved: no permit.")
    refused.add_note("The PLC said why.")
    text = "Refused, nothing has moved: no permit. The PLC said why."
    assert what_became(refused) == ({"kind": "skip", "sentence": text}, 5)
    for error, kind, code in (
        (StoppedError("Stopped."), "stopped", 5),
        (BusError("The bus is gone."), "stopped", 4),  # a skip where nothing was recorded
        (InputError("A file."), "failed", 3),
        (ZeroDivisionError("x"), "failed", 70),
    ):
        said, exit_code = what_became(error)
        assert (said["kind"], exit_code) == (kind, code)


def test_the_plan_and_the_units_are_shown_and_nothing_is_installed(cell: Path) -> None:
    run = CliRunner().invoke
    night_path(cell).write_text(night_text(axis={"days": ["mon", "sun"], "window": "22:15-04:00"}))
    planned = json.loads(run(app, ["night", "plan", str(cell), "--json"]).stdout)
    assert {p["axis"] for p in planned} == {1}
    # Eight days hold two weekdays two or three times; beside a window that is open now, four times.
    assert 2 <= len(planned) <= 4
    target = cell.parent / "units"
    target.mkdir()
    shown = run(app, ["night", "install", str(cell), "--show", "--folder", str(target)])
    assert "OnCalendar=Mon,Sun *-*-* 22:15:00 UTC" in shown.stdout
    assert "Persistent=false" in shown.stdout
    assert f'night run "{cell.resolve()}"' in shown.stdout
    assert not list(target.iterdir())
    refused = run(app, ["night", "install", str(cell), "--folder", str(target)], input="n\n")
    assert refused.exit_code == 1
    assert not list(target.iterdir())
    run(app, ["night", "install", str(cell), "--folder", str(target)], input="y\n")
    assert sorted(p.suffix for p in target.iterdir()) == [".service", ".timer"]


def test_systemd_takes_the_units(cell: Path, tmp_path: Path) -> None:
    analyse = shutil.which("systemd-analyze")
    if analyse is None:
        pytest.skip("systemd-analyze is not installed")
    import subprocess

    CliRunner().invoke(app, ["night", "install", str(cell), "--folder", str(tmp_path)], input="y\n")
    files = [str(p) for p in tmp_path.glob("stribeck-night-*")]
    checked = subprocess.run(
        [analyse, "verify", *files], check=False, capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stderr


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"time_zone": "Europe/Atlantis"}, "is not known"),
        ({"axis": {"window": "22:00-22:00"}}, "longer than nothing"),
        ({"axis": {"window": "tonight"}}, "HH:MM-HH:MM"),
        ({"axis": {"days": ["Montag"]}}, "days"),
        ({"axis": {"temperatur_degc": 30.0}}, "unknown key"),
        ({"axis": {"number": 7}}, "has no axis 7"),
        ({"notify": [{"kind": "webhook", "url": "ftp://x"}]}, "url"),
        (
            {"notify": [{"kind": "email", "host": "h", "sender": "a\nBcc: b", "to": ["c"]}]},
            "sender",
        ),
    ],
)
def test_each_mistake_in_the_night_s_file_is_named(
    cell: Path, change: dict[str, Any], says: str
) -> None:
    night_path(cell).write_text(night_text(**change))
    answer = CliRunner().invoke(app, ["night", "plan", str(cell)])
    assert isinstance(answer.exception, InputError)
    assert says in str(answer.exception)


def test_the_example_is_a_night_and_a_missing_one_says_what_to_do(cell: Path) -> None:
    example = CliRunner().invoke(app, ["night", "example"]).stdout
    night_path(cell).write_text(example)
    assert read_night(night_path(cell)).axis[0].window == "22:00-05:00"
    commented = "\n".join(
        line.removeprefix("# ") if "=" in line or line.startswith("# [") else line
        for line in example.splitlines()
    )
    night_path(cell).write_text(commented)
    kinds = [sink.kind for sink in read_night(night_path(cell)).notify]
    assert kinds == ["webhook", "email", "mqtt"]
    night_path(cell).unlink()
    answer = CliRunner().invoke(app, ["night", str(cell), "--once"])
    assert isinstance(answer.exception, InputError)
    assert "stribeck night example" in str(answer.exception)


def test_notify_tries_everybody_and_a_night_without_its_secret_does_not_begin(
    cell: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = CliRunner().invoke
    with Receiver([200]).running() as receiver:
        hook = {"kind": "webhook", "url": receiver.url, "secret_env": "KEY_OF_A_TEST", "tries": 1}
        night_path(cell).write_text(
            night_text(notify=[hook, {**hook, "url": "http://127.0.0.1:9/"}])
        )
        answer = run(app, ["night", str(cell), "--once"])
        assert isinstance(answer.exception, InputError)
        assert "KEY_OF_A_TEST is not set" in str(answer.exception)
        monkeypatch.setenv("KEY_OF_A_TEST", "geheim")
        answer = run(app, ["notify", str(cell)])
    assert answer.exit_code == 1
    assert "127.0.0.1:9: NOT told" in answer.stdout
    assert answer.stdout.count(": told.") == 1
    assert "geheim" not in answer.output
    assert json.loads(receiver.requests[0][1])["kind"] == "test"


def test_what_is_said_keeps_its_brackets(capsys: pytest.CaptureFixture[str]) -> None:
    talker().print("the cell has no [release], and [bold] is a word")
    assert "no [release], and [bold] is" in capsys.readouterr().err
