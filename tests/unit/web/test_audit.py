"""The audit trail: what was added stays, and whoever changes a byte of it is found out."""

from __future__ import annotations

import json
import multiprocessing
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from agent.cli.page.user import verify_audit
from agent.cli.terminal.exits import exit_code
from agent.errors import InputError
from agent.record.audit import HEAD, NAME, AuditTrail, verify

HERE = settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def trail_of(folder: Path, entries: int) -> AuditTrail:
    folder.mkdir(parents=True, exist_ok=True)
    for name in (NAME, HEAD):
        (folder / name).unlink(missing_ok=True)
    trail = AuditTrail(folder)
    for number in range(entries):
        trail.add("eva", "start", axis=number, note="über \u2028 Öl\n")
    return trail


def test_what_was_added_is_read_back_newest_first(tmp_path: Path) -> None:
    trail = trail_of(tmp_path, 3)
    assert [e.detail["axis"] for e in trail.newest(2)] == [2, 1]
    head = verify(tmp_path)
    assert (head.entries, head.hash) == (3, trail.newest(1)[0].hash)
    trail.add("eva", "stop")
    assert verify(tmp_path, expect=head.hash).entries == 4
    with pytest.raises(InputError, match="expected hash"):
        verify(tmp_path, expect="f" * 64)


@HERE
@given(data=st.data())
def test_a_changed_byte_anywhere_is_found(tmp_path: Path, data: st.DataObject) -> None:
    trail = trail_of(tmp_path, 4)
    content = bytearray(trail.path.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    content[at] = data.draw(st.integers(0, 255).filter(lambda b: b != content[at]))
    trail.path.write_bytes(content)
    with pytest.raises(InputError):
        verify(tmp_path)


@HERE
@given(data=st.data())
def test_a_line_removed_doubled_or_moved_is_found(tmp_path: Path, data: st.DataObject) -> None:
    trail = trail_of(tmp_path, 4)
    lines = trail.path.read_bytes().splitlines(keepends=True)
    order = data.draw(
        st.lists(st.integers(0, 3), max_size=6).filter(lambda numbers: numbers != [0, 1, 2, 3])
    )
    trail.path.write_bytes(b"".join(lines[i] for i in order))
    with pytest.raises(InputError):
        verify(tmp_path)


def test_nothing_is_added_to_a_trail_that_was_cut_or_damaged(tmp_path: Path) -> None:
    trail = trail_of(tmp_path, 3)
    whole = trail.path.read_bytes()
    for damaged in (whole.splitlines(keepends=True)[0], whole[:-5], b"", whole + b"{}\n"):
        trail.path.write_bytes(damaged)
        with pytest.raises(InputError):
            trail.add("eva", "start")
    trail.path.write_bytes(whole)
    assert trail.add("eva", "start").number == 4


def test_a_power_cut_between_line_and_head_is_no_forgery(tmp_path: Path) -> None:
    trail = trail_of(tmp_path, 2)
    head = (tmp_path / HEAD).read_bytes()
    trail.add("eva", "start")
    (tmp_path / HEAD).write_bytes(head)
    assert verify(tmp_path).entries == 3
    trail.add("eva", "stop")
    assert verify(tmp_path).entries == 4


def _add_ten(folder: Path, who: str) -> None:
    trail = AuditTrail(folder)
    for _ in range(10):
        trail.add(who, "start")


def test_two_processes_add_to_one_chain(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    processes = [context.Process(target=_add_ten, args=(tmp_path, w)) for w in ("eva", "toni")]
    for process in processes:
        process.start()
    for process in processes:
        process.join(30.0)
    assert [process.exitcode for process in processes] == [0, 0]
    assert verify(tmp_path).entries == 20


def test_the_command_says_the_head_or_the_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trail = trail_of(tmp_path, 2)
    verify_audit(tmp_path, expect="")
    assert trail.newest(1)[0].hash in capsys.readouterr().out
    lines = trail.path.read_text().splitlines()
    first = json.loads(lines[0])
    first["who"] = "nobody"
    trail.path.write_text("\n".join([json.dumps(first, sort_keys=True), lines[1], ""]))
    with pytest.raises(InputError, match="line 1") as caught:
        verify_audit(tmp_path, expect="")
    assert exit_code(caught.value) == 3
