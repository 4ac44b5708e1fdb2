"""Bad input gets one clear sentence and the contract's exit code, and leaves nothing behind."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from agent.cli import INTERRUPTED, NOBODY_READS
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from tests.system import explain_recordings as made
from tests.system.processes import STRIBECK, called, stribeck

USAGE, BAD_INPUT, DEVICE, SAFETY = 2, 3, 4, 5


def columns(samples: int = 500) -> dict[str, np.ndarray]:
    time_s = np.arange(samples) * 0.002
    velocity = 10.0 * np.sign(np.sin(2.0 * np.pi * time_s))
    return {
        "time_s": time_s,
        "velocity_rad_s": velocity,
        "torque_nm": 0.6 * np.sign(velocity) + 0.01 * velocity,
    }


def save(path: Path, data: dict[str, np.ndarray]) -> None:
    write(Recording(data, Metadata(robot="r", axis=1, gear_ratio=100.0), str(path)), path)


def _backwards(path: Path) -> None:
    data = columns()
    data["time_s"][200] = 0.1
    save(path, data)


def _all_nan(path: Path) -> None:
    data = columns()
    data["torque_nm"][:] = np.nan
    save(path, data)


def _rpm(path: Path) -> None:
    data = columns()
    table = pa.table(
        {
            "time_s": data["time_s"],
            "velocity_rpm": data["velocity_rad_s"] * 9.55,
            "torque_nm": data["torque_nm"],
        }
    )
    metadata = Metadata(robot="r", axis=1, gear_ratio=100.0).dumps()
    pq.write_table(table.replace_schema_metadata({b"stribeck": metadata}), path)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (Path.exists, "recording.parquet"),
        (lambda p: p.write_bytes(b""), "empty"),
        (lambda p: p.write_text("hello, I am not a recording"), "not"),
        (lambda p: save(p, columns(50)), "100"),
        (_backwards, "time_s"),
        (_rpm, "velocity_rad_s"),
    ],
    ids=["missing", "empty", "not Parquet", "too short", "time backwards", "wrong units"],
)
def test_estimate_refuses_what_is_no_recording(
    make: Callable[[Path], object], says: str, tmp_path: Path
) -> None:
    path = tmp_path / "recording.parquet"
    make(path)
    report = tmp_path / "report.html"
    done = called("estimate", path, "--report", report, "--json")
    assert done.returncode == BAD_INPUT, done.stderr
    assert done.stdout == ""
    assert says in done.stderr
    assert "recording.parquet" in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) <= 2
    assert not report.exists()


def test_a_refusal_is_talk_and_an_exit_code_for_a_shell_too(tmp_path: Path) -> None:
    """The rest of this file calls the same `main` in its own process."""
    done = stribeck("estimate", tmp_path / "recording.parquet", "--json")
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    assert "recording.parquet" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_an_output_without_room_is_no_fault_of_ours_and_closed_streams_change_no_code() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*STRIBECK, "example-cell"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == BAD_INPUT
    assert done.stderr == "The output cannot be written: No space left on device.\n"
    command = f"exec {shlex.join(STRIBECK)} estimate missing 2>&-"
    closed = subprocess.run(["sh", "-c", command], stdout=subprocess.PIPE, text=True, check=False)
    assert (closed.returncode, closed.stdout) == (BAD_INPUT, "")


def test_nobody_who_reads_on_is_no_alarm() -> None:
    shell = f"({shlex.join(STRIBECK)} example-cell; echo $? >&2) | true"
    done = subprocess.run(["sh", "-c", shell], stderr=subprocess.PIPE, text=True, check=False)
    assert done.stderr in (f"{NOBODY_READS}\n", "0\n")  # 0: written before the other end closed
    closed = f"({shlex.join(STRIBECK)} example-cell; echo $? >&2) | (exec <&-; sleep 3)"
    done = subprocess.run(["sh", "-c", closed], stderr=subprocess.PIPE, text=True, check=False)
    assert done.stderr == f"{NOBODY_READS}\n"


def test_a_byte_order_mark_is_no_part_of_a_toml_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows' editors write one."""
    monkeypatch.chdir(tmp_path)
    cell = _cell(tmp_path)
    twin = made.twin(tmp_path / "twin.toml")
    for path in (cell, twin):
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert called("run", cell, "--axis", "1", "--dry-run").returncode == 0
    run = made.save(tmp_path / "run.parquet", made.Joint(), 0)
    assert called("simulate", twin, run, "--out", "simulated.parquet").returncode == 0


def test_a_copy_under_another_name_is_not_counted_twice(tmp_path: Path) -> None:
    """Intervals had shrunk by it."""
    run = made.save(tmp_path / "run.parquet", made.Joint(), 0)
    copy = tmp_path / "copy.parquet"
    copy.write_bytes(run.read_bytes())
    twin = made.twin(tmp_path / "twin.toml")
    for asked in (("estimate",), ("explain", "--out", tmp_path / "out", twin)):
        done = called(*asked, run, copy)
        assert (done.returncode, done.stdout) == (BAD_INPUT, "")
        assert "copy.parquet holds samples of" in done.stderr


def test_a_name_that_is_no_text_is_refused_by_its_name(tmp_path: Path) -> None:
    named = os.fsencode(tmp_path) + b"/old-\xff.parquet"
    save(tmp_path / "run.parquet", columns())
    try:
        os.rename(os.fsencode(tmp_path / "run.parquet"), named)  # noqa: PTH104 - bytes, no path
    except OSError:
        pytest.skip("this file system takes text only")
    done = called("estimate", tmp_path, "--json")
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    assert "old-\\udcff.parquet" in done.stderr


def test_ctrl_c_before_a_command_runs_is_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("agent.cli.terminal.threads.keep_to_one_thread", pressed)
    done = called("estimate", "anything")
    assert (done.returncode, done.stdout, done.stderr) == (INTERRUPTED, "", "")


def test_a_recording_full_of_nan_is_not_decidable(tmp_path: Path) -> None:
    path = tmp_path / "recording.parquet"
    _all_nan(path)
    done = called("estimate", path, "--json")
    assert done.returncode == 0, done.stderr
    assert '"decidable": false' in done.stdout
    assert "NaN" not in done.stdout


def test_twin_of_nothing_decidable_writes_nothing(tmp_path: Path) -> None:
    path, out = tmp_path / "recording.parquet", tmp_path / "twin.toml"
    save(path, columns())
    done = called("twin", path, "--out", out)
    assert done.returncode == BAD_INPUT, done.stdout
    assert "No twin" in done.stderr
    assert not out.exists()


def _cell(folder: Path, *changes: tuple[str, str]) -> Path:
    text = called("example-cell").stdout
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "cell.toml"
    path.write_text(text)
    return path


COMMISSIONED = (
    ("commissioned = false", "commissioned = true"),
    ('commissioned_by = ""', 'commissioned_by = "a test"'),
)


@pytest.mark.parametrize(
    ("changes", "code", "says"),
    [
        ((), SAFETY, "not commissioned"),
        ((("gear_ratio = 224.0", "gear = 224.0"),), BAD_INPUT, "axis[1].gear: unknown key"),
        (
            (
                *COMMISSIONED,
                ("arm_position_min_deg = -80.0", "arm_position_min_deg = -10.0"),
            ),
            SAFETY,
            "position would reach",
        ),
        (
            (*COMMISSIONED, ('channel = "can0"', 'channel = "nosuchcan"')),
            DEVICE,
            "CAN",  # the interface's name, or that this kernel has no SocketCAN at all
        ),
        (
            (*COMMISSIONED, ('interface = "socketcan"', 'interface = "carrierpigeon"')),
            DEVICE,
            "carrierpigeon",
        ),
        ((*COMMISSIONED, ("duration_s = 40.0", "duration_s = 2.0")), BAD_INPUT, "duration"),
    ],
    ids=["not commissioned", "unknown key", "beyond limits", "no bus", "no interface", "no time"],
)
def test_run_refuses_before_anything_moves(
    changes: tuple[tuple[str, str], ...], code: int, says: str, tmp_path: Path
) -> None:
    cell = _cell(tmp_path, *changes)
    done = called("run", cell, "--axis", "1", "--out", tmp_path / "out")
    assert done.returncode == code, done.stderr
    assert done.stdout == ""
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert not list((tmp_path / "out").glob("*")) if (tmp_path / "out").exists() else True


def test_nobody_on_the_bus_is_a_device_error(tmp_path: Path) -> None:
    cell = _cell(
        tmp_path,
        *COMMISSIONED,
        ('interface = "socketcan"', 'interface = "virtual"'),
        ('channel = "can0"', 'channel = "nobody-here"'),
    )
    done = called("run", cell, "--axis", "1", "--out", tmp_path / "out")
    assert done.returncode == DEVICE, done.stderr
    assert "Nobody answers under node id 1" in done.stderr


def test_an_unknown_axis_and_an_unknown_option() -> None:
    assert called("run", "cell.toml").returncode == USAGE
    assert called("estimate").returncode == USAGE


@pytest.mark.parametrize(
    ("command", "code", "says"),
    [
        ("run gone.toml --axis 1", 3, "gone.toml cannot be read: No such file or directory. `st"),
        ("serve folder", 3, "folder cannot be read: Is a directory."),
        ("night latin.toml", 3, "latin.toml cannot be read: it is not text in UTF-8."),
        ("simulate latin.toml run.parquet --out out.parquet", 3, "cannot be read: it is not text"),
        ("eds folder", 3, "The EDS folder cannot be read: Is a directory."),
        ("eds latin.toml", 3, "latin.toml describes no object of a device: it is no EDS."),
        (
            "explain twin.toml x.parquet --out latin.toml",
            3,
            "latin.toml cannot be made: a file has",
        ),
        (
            "monitor x.parquet --out latin.toml",
            3,
            "latin.toml cannot be made: a file has that name",
        ),
        ("study x.parquet --out latin.toml", 3, "latin.toml cannot be made: a file has that name"),
        ("fake-history months --every-days 1e9", 2, "'--every-days'"),
        ("run latin.toml --axis 1 --dry-run --json", 2, "leave out --json"),
        ("thermal x.parquet --until nan", 2, "'--until'"),
        ("verify-map latin.toml", 3, "latin.toml cannot be read: it is not text in UTF-8."),
        ("demo --out latin.toml", 3, "The folder latin.toml cannot be made: a file has that name."),
        ("demo --seed -1", 2, "'--seed'"),
        ("fake --node 300", 2, "'--node'"),
        ("plan latin.toml --axis 1 --seconds 1e9", 2, "'--seconds'"),
        ("plan latin.toml --axis 1 --seconds -5", 2, "'--seconds'"),
        ("plan latin.toml --axis 1 --seconds 20 --dwell-s 0", 2, "'--dwell-s'"),
    ],
)
def test_what_cannot_be_used_is_said_in_words_before_any_work(
    command: str, code: int, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No number of the system's, no codec, the name once; and no fault of the program's own."""
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("latin.toml").write_bytes("robot = 'Gelenk für Öl'".encode("latin-1"))
    made.twin(Path("twin.toml"))
    done = called(*command.split())
    assert (done.returncode, done.stdout) == (code, "")
    assert says in done.stderr
    assert "Errno" not in done.stderr


@pytest.mark.parametrize(
    ("command", "code", "says"),
    [
        ("fake-history months --cycles 1 --robot \n", 3, "a name without control characters"),
        ("fake-history cell.toml --cycles 1", 3, "a file has that name"),
        ("catalogue add run.parquet --folder none", 3, "none: is no folder."),
        ("catalogue add run.parquet --folder other", 3, "run.parquet is not below other."),
        ("catalogue add run.parquet --catalogue nonsense", 3, "URL cannot be read"),
        ("catalogue note . oil  --robot cell7", 2, "A note without a word says nothing."),
        ("user invite cell.toml anna --state other", 3, "other/page.sqlite is not there"),
        ("plan cell.toml --axis 1 --seconds 20 --out run.parquet", 3, "a file has that name"),
    ],
)
def test_what_is_refused_leaves_nothing_behind(
    command: str, code: int, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "run.parquet", columns())
    Path("other").mkdir()
    Path("cell.toml").write_text(called("example-cell").stdout)
    before = sorted(tmp_path.rglob("*"))
    done = called(*command.split(" "))
    assert (done.returncode, done.stdout) == (code, "")
    assert says in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


NO_NUMBER = ("nan", "inf", "-1e9", "1e308")


@pytest.mark.parametrize(
    ("command", "values"),
    [
        ("run cell.toml --axis 1 --contour --dry-run --torque-nm", ("nan", "inf", "0")),
        ("plan cell.toml --axis 1 --seconds 20 --noise-nm", (*NO_NUMBER, "0")),
        ("plan cell.toml --axis 1 --seconds 20 --dwell-s", NO_NUMBER),
        ("ripple x.parquet --highest-order", ("nan", "inf", "0")),
        ("ripple x.parquet --picture", ("x.pdf", ".", "")),
        ("flexible x.parquet --kind", ("four-mass", "")),
        ("simulate twin.toml x.parquet --out", ("x.txt",)),
        ("prove --cases", ("0", "99999999999999999999")),
        ("prove --cases 1 --seed", ("-1",)),
        ("prove --cases 1 --processes", ("0", "1000000")),
        ("fake --bus-option", ("x", "=x", "")),
        ("verify-map jaka --rtu", ("",)),
        ("verify-map jaka --rtu /dev/none --baudrate", ("99999999999999",)),
        ("verify-map jaka --tcp 127.0.0.1:9 --interval-s", NO_NUMBER),
        ("verify-map jaka --tcp 127.0.0.1:9 --timeout-s", NO_NUMBER),
        ("fake-history months --cycles 1 --wear-day", NO_NUMBER),
        ("fake-history months --cycles 1 --wear-day 1 --wear-nm", NO_NUMBER),
        ("fake-history months --cycles 1 --wear-day 1 --wear-days", (*NO_NUMBER, "0")),
        ("fake-history months --cycles 1 --oil-day", NO_NUMBER),
        ("fake-history months --cycles 1 --swap-day", NO_NUMBER),
        ("fake-history months --cycles 1 --payload-kg", NO_NUMBER),
        ("self-test months --rise", (*NO_NUMBER, "0")),
        ("self-test months --detector", ("tarot", "")),
        ("schedule --swing", NO_NUMBER),
        ("schedule --wear", (*NO_NUMBER, "0")),
        ("schedule --limit", (*NO_NUMBER, "0")),
        ("schedule --minutes", (*NO_NUMBER, "0")),
        ("schedule --false-alarms", (*NO_NUMBER, "0")),
        ("schedule --slope", NO_NUMBER),
        ("schedule --scatter", (*NO_NUMBER, "0")),
        ("schedule --ambient", (*NO_NUMBER, "20")),
        ("schedule --cooling", ("x.parquet", "")),
        ("watch x.parquet --dedicated x.parquet --false-rate", (*NO_NUMBER, "0")),
        ("monitor months --detector", ("tarot", "")),
        ("monitor months --baseline", ("2", "-1")),
        ("monitor months --low-speed", (*NO_NUMBER, "0")),
        ("stop --axis", ("1",)),
        ("serve cell.toml --tls-cert", ("cell.toml",)),
        ("serve cell.toml --host", ("0.0.0.0", "")),
        ("serve cell.toml --public-url", ("http://x", "https://")),
        ("export x.parquet --format", ("xls", "")),
        ("import x.csv --robot r --axis 1 --gear-ratio", (*NO_NUMBER, "0")),
        ("import x.csv --robot r --axis 1 --gear-ratio 9 --payload-kg", NO_NUMBER),
        ("import x.csv --robot r --axis 1 --gear-ratio 9 --set", ("x", "x=nan", "=1")),
        ("catalogue list folder --newest", ("0", "99999999999999999999999")),
        ("catalogue retain folder --days", NO_NUMBER),
        ("catalogue retain folder --max-mb", NO_NUMBER),
        ("catalogue retain", ("folder",)),
        ("catalogue note folder oil text --robot r --at", ("yesterday", "2026-13-01")),
        ("fleet pack folder --before", ("x", "2026-13")),
        ("fleet estimate folder --memory", NO_NUMBER),
        ("fleet monitor folder --workers 1 --detector", ("tarot",)),
    ],
)
def test_a_value_that_means_nothing_is_usage_and_leaves_nothing(
    command: str, values: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the files hold: here they hold nothing, or are not there."""
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("cell.toml").write_text(called("example-cell").stdout)
    before = sorted(tmp_path.rglob("*"))
    wrong = {}
    for value in values:
        done = called(*command.split(), value)
        sentences = [line for line in done.stderr.splitlines() if "Usage:" not in line]
        if done.returncode != USAGE or done.stdout or not sentences:
            wrong[value] = (done.returncode, done.stdout, done.stderr)
    assert wrong == {}
    assert sorted(tmp_path.rglob("*")) == before


def test_dry_run_opens_no_bus_and_says_what_would_be_driven(tmp_path: Path) -> None:
    done = called("run", _cell(tmp_path), "--axis", "1", "--dry-run")
    assert done.returncode == 0, done.stderr
    assert "22 steady velocities" in done.stdout
    assert "within all limits" in done.stdout
    assert "not commissioned" in done.stdout
    done = called("run", _cell(tmp_path), "--axis", "9", "--dry-run")
    assert done.returncode == BAD_INPUT
    assert "no axis 9; it has 1" in done.stderr


def test_recover_where_there_is_nothing(tmp_path: Path) -> None:
    done = called("recover", tmp_path)
    assert done.returncode == 0
    assert "Nothing to recover" in done.stderr
    assert called("recover", tmp_path / "missing").returncode == BAD_INPUT


@pytest.mark.parametrize(
    "words",
    [
        ("estimate", ""),
        ("estimate", "recording.parquet", "--validation", ""),
        ("twin", " ", "--out", "twin.toml"),
        ("simulate", "twin.toml", "", "--out", "other.parquet"),
        ("monitor", "", "--out", "report"),
        ("export", ""),
        ("verify", ""),
        ("recover", ""),
        ("catalogue", "add", ""),
        ("catalogue", "rebuild", ""),
        ("catalogue", "add", "recording.parquet", "--folder", ""),
        ("run", "", "--axis", "1"),
        ("run", "cell.toml", "--axis", "1", "--dry-run", "--trajectory", ""),
        ("plan", "cell.toml", "--axis", "1", "--seconds", "20", "--out", ""),
        ("demo", "--out", ""),
        ("estimate", "recording.parquet", "--report", ""),
        ("explain", "twin.toml", "recording.parquet", "--out", ""),
        ("study", "recording.parquet", "--out", ""),
        ("eds", ""),
        ("stop", "", "--dry-run"),
        ("user", "invite", "cell.toml", "anna", "--state", ""),
        ("night", "install", "cell.toml", "--folder", ""),
        ("fleet", "push", "", "recording.parquet", "--site", "a"),
        ("fleet", "estimate", ""),
        ("fleet", "report", "lake", "--out", ""),
    ],
    ids=" ".join,
)
def test_an_empty_name_is_not_the_current_folder(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a shell's variable that was never set."""
    save(tmp_path / "recording.parquet", columns())
    made.twin(tmp_path / "twin.toml")
    before = sorted(tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    done = called(*words)
    assert done.returncode == BAD_INPUT
    assert re.fullmatch(
        r"An empty name names no [\w ]+\. The current folder is `\.`\.\n", done.stderr
    )
    assert done.stdout == ""
    assert sorted(tmp_path.iterdir()) == before
