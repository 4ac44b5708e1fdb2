"""The recorder in the control tick: when it flushes, what it refuses, how it ends."""

from __future__ import annotations

import errno
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.ipc as ipc
import pyarrow.parquet as pq
import pytest

from agent.errors import StorageError
from agent.record import atomic, rows
from agent.record.reading import read
from agent.record.rows import CAPACITY_ROWS
from agent.record.streams import finishing, open_stream
from agent.record.streams.recover import recover
from agent.record.streams.stream import FLUSH_PERIOD_S, StreamWriter
from agent.record.streams.stream_file import read_stream
from agent.record.writing import write_table
from tests.unit.record.samples import STREAM_COLUMNS, metadata, row

FULL = Path("/dev/full")
needs_dev_full = pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")


def begin(folder: Path, **options: Any) -> StreamWriter:
    return StreamWriter(folder, "run", metadata(), STREAM_COLUMNS, **options)


def append(writer: StreamWriter, many: Iterable[tuple[Any, ...]]) -> None:
    for one in many:
        writer.append(one)


def on_disk(writer: StreamWriter) -> int:
    return read_stream(writer.path).table.num_rows


def test_rows_become_a_recording(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    for i in range(1234):
        writer.append(row(i))
    assert writer.samples == 1234
    path = writer.finish(samples_lost=2, extra_metadata={"ambient_degc": 21.5, "verdict": "ok"})
    assert [p.name for p in tmp_path.iterdir()] == ["run.parquet"]
    found = read(path)
    assert list(found.columns) == list(STREAM_COLUMNS)
    for at, name in enumerate(STREAM_COLUMNS):
        assert found[name].tolist() == [row(i)[at] for i in range(1234)], name
    assert found.metadata == metadata(samples_lost=2, ambient_degc=21.5, extra={"verdict": "ok"})


def test_beginning_a_recording_does_not_load_pandas_while_a_device_waits(tmp_path: Path) -> None:
    code = (
        "import sys; from agent.record.streams.stream import StreamWriter; "
        "from tests.unit.record.samples import STREAM_COLUMNS, metadata, row; "
        "StreamWriter(sys.argv[1], 'run', metadata(), STREAM_COLUMNS).append(row(0)); "
        "assert 'pandas' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True)


@pytest.mark.parametrize("rate_hz", [100.0, 500.0, 1000.0, 4000.0])
def test_half_a_second_of_rows_is_all_that_ever_waits(tmp_path: Path, rate_hz: float) -> None:
    writer = begin(tmp_path)
    size, saved, flushes = 0, 0, []
    for i in range(int(2.3 * rate_hz)):
        writer.append(row(i, rate_hz))
        if writer.path.stat().st_size != size:
            size, saved = writer.path.stat().st_size, on_disk(writer)
            flushes.append(i / rate_hz)
        assert (i + 1 - saved) / rate_hz < FLUSH_PERIOD_S
    assert flushes == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0])
    writer.abandon()


def test_the_first_row_is_on_the_disk_at_once(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    assert on_disk(writer) == 0
    writer.append(row(0))
    assert on_disk(writer) == 1
    writer.abandon()


def test_time_that_does_not_pass_cannot_overrun_the_buffer(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    for _ in range(2 * CAPACITY_ROWS + 5):
        writer.append((math.nan, 1.0, 2.0, 3.0, "stuck"))
    assert on_disk(writer) == 2 * CAPACITY_ROWS
    writer.abandon()
    assert on_disk(writer) == 2 * CAPACITY_ROWS + 5


def test_one_row_without_a_time_does_not_stop_the_flushes(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    append(writer, [(time_s, 1.0, 2.0, 3.0, "") for time_s in [math.nan] * CAPACITY_ROWS])
    append(writer, [(time_s, 1.0, 2.0, 3.0, "") for time_s in (0.0, math.inf, math.nan, 0.6)])
    assert on_disk(writer) == CAPACITY_ROWS + 4
    writer.abandon()


def test_nobody_can_recover_a_stream_that_is_being_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = begin(tmp_path)
    append(writer, map(row, range(150)))
    outcomes: list[str] = []

    def recovered_meanwhile(*arguments: Any) -> None:
        outcomes.extend(result.outcome for result in recover(tmp_path))
        write_table(*arguments)

    monkeypatch.setattr(finishing, "write_table", recovered_meanwhile)
    assert pq.read_metadata(writer.finish()).num_rows == 150
    assert outcomes == ["in use"]


def test_a_disk_that_gives_back_less_than_it_took_is_found_out(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    append(writer, map(row, range(1100)))
    os.truncate(writer.path, writer.path.stat().st_size - 100)
    with pytest.raises(StorageError, match="gives back 501 of the 1100 samples"):
        writer.finish()
    assert not writer.recording_path.exists()


def test_all_kinds_of_columns(tmp_path: Path) -> None:
    writer = StreamWriter(
        tmp_path,
        "run",
        metadata(),
        ["phase", "time_s", "torque_nm", "velocity_rad_s", "cycle", "limited", "note"],
        kinds={"cycle": "integer", "limited": "boolean", "note": "text"},
    )
    for i in range(150):
        numbers = (np.float64(i / 100), np.float32(0.5), i)
        writer.append(("a" if i < 70 else "ü", *numbers, 2**53 + i, i % 3 == 0, str(i)))
    found = read(writer.finish())
    assert found["cycle"].tolist() == [2**53 + i for i in range(150)]
    assert found["limited"].tolist() == [i % 3 == 0 for i in range(150)]
    assert found["note"].tolist() == [str(i) for i in range(150)]
    assert found["phase"].tolist() == ["a"] * 70 + ["ü"] * 80
    assert found["velocity_rad_s"].tolist() == [float(i) for i in range(150)]


@pytest.mark.parametrize(
    ("bad", "expected"),
    [
        ((0.0, 1.0, 2.0, 3.0), "expected a row of 5 values, got 4"),
        ((0.0, 1.0, 2.0, 3.0, "ramp", 1.0), "expected a row of 5 values, got 6"),
        ((0.0, None, 2.0, 3.0, "ramp"), "not of its column's kind: time_s=0.0, position_rad=None"),
        ((0.0, "1.0", 2.0, 3.0, "ramp"), "position_rad='1.0'"),
        ((0.0, 1.0, 2.0, 3.0, None), "phase=None"),
        ((0.0, 1.0, 2.0, 3.0, ["ramp"]), r"phase=\['ramp'\]"),
    ],
)
def test_a_row_that_does_not_fit_is_refused_and_leaves_no_trace(
    tmp_path: Path, bad: tuple[Any, ...], expected: str
) -> None:
    writer = begin(tmp_path)
    writer.append(row(0))
    with pytest.raises(ValueError, match=expected):
        writer.append(bad)
    writer.append(row(1))
    table = read_stream(_abandoned(writer)).table
    assert table["time_s"].to_pylist() == [0.0, 0.001]
    assert table["phase"].to_pylist() == ["steady", "ramp"]


@pytest.mark.parametrize(
    ("columns", "kinds", "expected"),
    [
        (["time_s"], {}, "expected columns torque_nm"),
        (["time_s", "torque_nm", "time_s"], {}, "every column once"),
        (["time_s", "torque_nm"], {"phase": "text"}, "not there"),
        (["time_s", "torque_nm"], {"time_s": "integer"}, "time_s must be float"),
    ],
)
def test_columns_that_cannot_make_a_recording(
    tmp_path: Path, columns: list[str], kinds: dict[str, rows.Kind], expected: str
) -> None:
    with pytest.raises(ValueError, match=expected):
        StreamWriter(tmp_path, "run", metadata(), columns, kinds=kinds)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["", "a/b", "../a", "."])
def test_a_name_that_is_no_file_name(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match="file name"):
        StreamWriter(tmp_path, name, metadata(), STREAM_COLUMNS)


def test_names_that_are_taken(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    with pytest.raises(StorageError, match="is the unfinished stream of another run"):
        begin(tmp_path)
    writer.append(row(0))
    writer.finish()
    with pytest.raises(StorageError, match=r"run\.parquet exists already"):
        begin(tmp_path)
    with pytest.raises(StorageError, match="cannot be made: the folder does not exist"):
        StreamWriter(tmp_path / "none", "run", metadata(), STREAM_COLUMNS)


def test_the_stream_is_plain_arrow_with_the_metadata_from_the_start(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    with writer.path.open("rb") as file:
        schema = ipc.open_stream(file).schema
    assert schema.names == list(STREAM_COLUMNS)
    assert json.loads(schema.metadata[b"stribeck"]) == metadata().to_json()
    for i in range(700):
        writer.append(row(i))
    with _abandoned(writer).open("rb") as file:
        assert ipc.open_stream(file).read_all().num_rows == 700


def test_leaving_the_block_keeps_what_came(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    with pytest.raises(ValueError, match="a row of 5"), writer:
        append(writer, [*map(row, range(300)), ()])
    content = read_stream(writer.path)
    assert (content.table.num_rows, content.closed, content.bytes_cut) == (300, True, 0)
    writer.abandon()
    with pytest.raises(ValueError, match="the writer is closed"):
        writer.append(row(300))
    with pytest.raises(ValueError, match="the writer is closed"):
        writer.finish()


def test_a_run_without_a_single_row_leaves_nothing(tmp_path: Path) -> None:
    with begin(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_finishing_in_a_block_leaves_the_recording_alone(tmp_path: Path) -> None:
    with begin(tmp_path) as writer:
        writer.append(row(0))
        path = writer.finish()
    assert pq.read_metadata(path).num_rows == 1
    assert not writer.path.exists()


def test_metadata_that_cannot_be_used_at_the_end_keeps_the_stream(tmp_path: Path) -> None:
    writer = begin(tmp_path)
    for i in range(150):
        writer.append(row(i))
    with pytest.raises(ValueError, match="ambient_degc must be"):
        writer.finish(extra_metadata={"ambient_degc": math.nan})
    (result,) = recover(tmp_path)
    assert result.outcome == "recovered"


@needs_dev_full
def test_a_disk_that_fills_up_is_said_once_and_what_was_saved_becomes_the_recording(
    tmp_path: Path,
) -> None:
    writer = begin(tmp_path)
    for i in range(1100):
        writer.append(row(i))
    disk = _divert(writer, FULL)
    with pytest.raises(
        StorageError,
        match=r"cannot be written any further, 1001 samples are saved in it: the disk is full\.",
    ):
        append(writer, map(row, range(1100, 3000)))
    _divert(writer, disk)
    for i in range(1501, 1600):  # the joint is being stopped; nobody wants to hear it again
        writer.append(row(i))
    assert writer.samples_unsaved == 500 + 99
    found = read(writer.finish(samples_lost=1))
    assert len(found) == 1001
    assert found.samples_lost == 1 + 599
    assert "the last 599 samples could not be saved" in found.metadata.notes


def test_a_write_that_ends_in_the_middle_is_taken_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = begin(tmp_path)
    writer.append(row(0))
    whole = writer.path.stat().st_size

    def half(descriptor: int, content: Any) -> None:
        atomic.write_all(descriptor, memoryview(content)[: len(content) // 2])
        raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

    monkeypatch.setattr(open_stream, "write_all", half)
    with pytest.raises(StorageError, match="1 samples are saved in it: the disk quota is used up"):
        append(writer, map(row, range(1, 600)))
    assert writer.path.stat().st_size == whole
    monkeypatch.setattr(open_stream, "write_all", atomic.write_all)
    assert read_stream(_abandoned(writer)).closed
    (result,) = recover(tmp_path)
    assert (result.samples, result.bytes_cut) == (1, 0)


def test_an_interrupt_in_the_middle_of_a_write_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = begin(tmp_path)
    writer.append(row(0))

    def interrupted(descriptor: int, content: Any) -> None:
        atomic.write_all(descriptor, memoryview(content)[: len(content) // 2])
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(open_stream, "write_all", interrupted)
        with pytest.raises(KeyboardInterrupt):
            append(writer, map(row, range(1, 600)))
    content = read_stream(_abandoned(writer))
    assert content.table["time_s"].to_pylist() == [i / 1000.0 for i in range(501)]
    assert (content.closed, content.bytes_cut) == (True, 0)


def test_a_tail_that_cannot_be_cut_gets_no_end_mark(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = begin(tmp_path)
    writer.append(row(0))

    def all_but_the_mark(descriptor: int, content: Any) -> None:
        atomic.write_all(descriptor, memoryview(content)[:-8])
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    def fails(*_: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as patched:
        patched.setattr(open_stream, "write_all", all_but_the_mark)
        patched.setattr(os, "ftruncate", fails)
        with pytest.raises(StorageError, match="input/output error"):
            append(writer, map(row, range(1, 600)))
    content = read_stream(_abandoned(writer))
    assert content.table.num_rows == 1
    assert not content.closed
    assert content.bytes_cut > 0


@needs_dev_full
def test_a_disk_that_is_full_from_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system_open = os.open

    def opens_full(path: Any, flags: int, *mode: int) -> int:
        descriptor = system_open(path, flags, *mode)
        if flags & os.O_EXCL:
            os.dup2(system_open(FULL, os.O_WRONLY), descriptor)
        return descriptor

    monkeypatch.setattr(os, "open", opens_full)
    # A machine has one /dev/full, and another run of these tests may hold its lock.
    monkeypatch.setattr(open_stream, "try_lock", lambda _descriptor: True)
    with pytest.raises(StorageError, match=r"run\.arrows cannot be written: the disk is full"):
        begin(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_while_finishing_keeps_the_stream(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = begin(tmp_path)
    for i in range(150):
        writer.append(row(i))

    def full(*_: object, **__: object) -> None:
        raise StorageError("run.parquet cannot be written: the disk is full.", "Free some space.")

    with monkeypatch.context() as patched:
        patched.setattr(finishing, "write_table", full)
        with pytest.raises(
            StorageError, match=r"The 150 samples are kept in .*run\.arrows"
        ) as told:
            writer.finish()
    assert "stribeck recover" in told.value.do
    assert recover(writer.path)[0].samples == 150


def test_waiting_for_the_disk_can_be_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    for wanted, expected in ((False, 0), (True, 3)):
        writer = StreamWriter(
            tmp_path, f"run{wanted}", metadata(), STREAM_COLUMNS, sync_every_flush=wanted
        )
        synced.clear()
        for i in range(1001):
            writer.append(row(i))
        assert len(synced) == expected
        writer.abandon()


def _abandoned(writer: StreamWriter) -> Path:
    writer.abandon()
    return writer.path


def _divert(writer: StreamWriter, target: Path | int) -> int:
    """Let the writer's descriptor mean another file, and return what it meant before."""
    descriptor = writer._file._descriptor
    assert descriptor is not None
    before = os.dup(descriptor)
    source = os.open(target, os.O_WRONLY) if isinstance(target, Path) else target
    os.dup2(source, descriptor)
    os.close(source)
    return before
