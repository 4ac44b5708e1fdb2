"""An axis has one owner on this machine, across processes and cell files, and no hand is needed."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from agent.cell.cell import Cell, parse_cell
from agent.cli.cycle.stop import stop
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.axis_lock import FOLDER_VARIABLE, holders, lock_folder, owned
from agent.errors import InputError, RefusedError, StoppedError, StorageError
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import MonotonicClock, SteppedClock
from fakes.specification import FakeSpecification

HOLDER = """
import sys
from pathlib import Path
from agent.cell.cell import parse_cell
from agent.cycle.axis_lock import owned

cell = parse_cell(Path(sys.argv[1]).read_text())
with owned(cell, cell.axis[0], Path(sys.argv[2])) as condition:
    print("held" if condition.holds else condition.reason, flush=True)
    sys.stdin.read()
"""


def cell_with(robot: str = "cell7", channel: str = "can0", **drive: Any) -> Cell:
    text = fake_cell_text(FakeSpecification(), interface="socketcan", channel=channel)
    description = tomllib.loads(text) | {"robot": robot}
    description["axis"][0]["drive"] |= drive
    return parse_cell(tomli_w.dumps(description))


@contextmanager
def held_elsewhere(cell: Cell, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Let another process own the cell's axis."""
    description = folder / "holder.toml"
    description.write_text(
        tomli_w.dumps(cell.model_dump(mode="json", by_alias=True, exclude_none=True))
    )
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(description), str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        yield holder
        holder.kill()


def test_a_second_start_learns_who_holds_the_axis_and_a_kill_leaves_it_free(tmp_path: Path) -> None:
    cell = cell_with()
    with held_elsewhere(cell, tmp_path) as holder:
        with owned(cell, cell.axis[0], tmp_path) as condition:
            assert not condition.holds
            said = rf"axis 1 of cell7.* process {holder.pid} \(user .+\) since 20\d\d-.+Z"
            assert re.search(said, condition.reason)
        holder.send_signal(signal.SIGKILL)
        holder.wait()
        with owned(cell, cell.axis[0], tmp_path) as condition:
            assert condition.holds


def test_stop_asks_the_process_that_holds_the_lock_and_waits_until_it_lets_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    with pytest.raises(InputError, match="nothing was asked to stop"):
        stop(None, None, dry_run=False, as_json=True)
    with held_elsewhere(cell_with(), tmp_path) as holder:
        path = tmp_path / "holder.toml"
        stop(path, 1, dry_run=True, as_json=True)
        assert holder.poll() is None
        assert f"process {holder.pid} " in capsys.readouterr().out
        stop(path, 1, dry_run=False, as_json=True)
        (ended,) = json.loads(capsys.readouterr().out)["ended"]
        assert ended["pid"] == holder.pid
        assert holder.wait(timeout=60.0) != 0


@pytest.mark.skipif(sys.platform != "linux", reason="who has a file open is /proc's to tell")
def test_a_process_that_only_stands_in_the_lock_is_not_asked(tmp_path: Path) -> None:
    """Anybody may write a number into the file; this one belongs to a bystander."""
    cell = cell_with()
    with (
        held_elsewhere(cell, tmp_path),
        subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as bystander,
    ):
        for path in tmp_path.glob("*.lock"):
            path.write_text(json.dumps({"pid": bystander.pid, "user": "somebody"}))
        assert holders(tmp_path) == ()
        bystander.kill()


def test_one_that_does_not_let_go_is_a_matter_for_the_e_stop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    with held_elsewhere(cell_with(), tmp_path) as holder:
        holder.send_signal(signal.SIGSTOP)
        try:
            with pytest.raises(StoppedError, match=r"still owns its axis.*E-stop"):
                stop(None, None, dry_run=False, as_json=False, clock=SteppedClock())
        finally:
            holder.send_signal(signal.SIGCONT)


@pytest.mark.parametrize(
    ("other", "is_free"),
    [
        (cell_with(channel="can1"), False),  # the same robot and axis in another cell file
        (cell_with(robot="another-name"), False),  # the same drive under another name
        (cell_with(robot="another-name", node_id=2), True),
        (cell_with(robot="another-name", channel="can1"), True),
    ],
    ids=["same axis", "same drive", "another node", "another bus"],
)
def test_neither_another_file_nor_another_name_leads_around_it(
    other: Cell, is_free: bool, tmp_path: Path
) -> None:
    cell = cell_with()
    with (
        owned(cell, cell.axis[0], tmp_path) as ours,
        owned(other, other.axis[0], tmp_path) as theirs,
    ):
        assert ours.holds
        assert theirs.holds is is_free


def test_a_lock_that_was_not_got_holds_nothing_back(tmp_path: Path) -> None:
    """A start that is refused for the drive's place must not keep the robot's name locked."""
    cell, other = cell_with(), cell_with(robot="another-name")
    with owned(cell, cell.axis[0], tmp_path):
        with owned(other, other.axis[0], tmp_path) as refused:
            assert not refused.holds
        elsewhere = cell_with(robot="another-name", channel="can1")
        with owned(elsewhere, elsewhere.axis[0], tmp_path) as condition:
            assert condition.holds


def test_a_cycle_on_an_owned_axis_is_refused_before_the_bus_is_opened(tmp_path: Path) -> None:
    cell = cell_with(channel="no-such-bus")  # opening it would be a BusError
    with (
        owned(cell, cell.axis[0]),
        pytest.raises(RefusedError, match=f"held by process {os.getpid()}"),
    ):
        drive_cycle(CycleRequest(cell, cell.axis[0], tmp_path / "out"), MonotonicClock())


def test_a_folder_that_cannot_be_used_is_said(tmp_path: Path) -> None:
    cell = cell_with()
    with (
        pytest.raises(StorageError, match=FOLDER_VARIABLE),
        owned(cell, cell.axis[0], tmp_path / "missing"),
    ):
        raise AssertionError("unreachable")


def test_the_folder_is_the_machines_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER_VARIABLE)
    assert lock_folder().is_dir()


@pytest.mark.parametrize("platform", ["darwin", "win32"])
def test_two_users_programs_look_for_locks_in_one_folder(
    platform: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each user has a folder for temporary files of their own on macOS and Windows."""
    shared = {"darwin": Path("/tmp"), "win32": tmp_path}[platform]
    may_write = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode: Path(path) == shared and may_write(path, mode)
    )
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "of-one-user"))
    monkeypatch.setenv("PUBLIC", str(tmp_path))
    monkeypatch.delenv(FOLDER_VARIABLE)
    assert lock_folder() == shared
