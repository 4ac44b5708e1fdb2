"""What a kill leaves: every whole batch is kept, nothing is invented, nothing is lost twice."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.ipc as ipc
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.errors import InputError, StorageError
from agent.record.metadata import Metadata
from agent.record.reading import read
from agent.record.streams import recover as module
from agent.record.streams.recover import recover
from agent.record.streams.stream import StreamWriter
from agent.record.streams.stream_file import END_OF_STREAM, read_stream
from tests.unit.record.samples import STREAM_COLUMNS, metadata, row


def killed(folder: Path, samples: int, rate_hz: float = 1000.0, **changes: Any) -> Path:
    """Return a stream as a kill after the last flush leaves it: no mark at its end."""
    writer = StreamWriter(folder, "run", metadata(**changes), STREAM_COLUMNS)
    for i in range(samples):
        writer.append(row(i, rate_hz))
    writer.abandon()
    whole = writer.path.read_bytes()
    assert whole.endswith(END_OF_STREAM)
    writer.path.write_bytes(whole[: -len(END_OF_STREAM)])
    return writer.path


def test_a_killed_stream_becomes_a_recording_that_says_so(tmp_path: Path) -> None:
    stream = killed(tmp_path, 700, samples_lost=0, notes="Gearbox warm.")
    (result,) = recover(tmp_path)
    assert (result.outcome, result.samples, result.bytes_cut) == ("recovered", 700, 0)
    assert result.recording == tmp_path / "run.parquet"
    assert not stream.exists()
    found = read(tmp_path / "run.parquet")
    assert found["torque_nm"].tolist() == [row(i)[3] for i in range(700)]
    assert found["phase"].tolist() == [row(i)[4] for i in range(700)]
    assert found.metadata.samples_lost is None  # what was lost at the end, nobody counted
    assert found.metadata.notes == (
        "Gearbox warm. Recovered 700 samples up to time_s = 0.699 from a stream whose writer did "
        "not end it; up to 0.5 s may be missing at its end, and losses before it were not counted."
    )
    assert found.metadata.updated({"notes": "", "samples_lost": None}) == metadata()


def test_an_abandoned_stream_is_whole_and_says_so(tmp_path: Path) -> None:
    with StreamWriter(tmp_path, "run", metadata(), STREAM_COLUMNS) as writer:
        for i in range(300):
            writer.append(row(i))
    (result,) = recover(writer.path)
    assert result.samples == 300
    assert "nothing is missing at its end" in read(tmp_path / "run.parquet").metadata.notes


def test_a_tail_torn_at_any_byte_is_cut_at_the_last_whole_batch(tmp_path: Path) -> None:
    stream = killed(tmp_path, 6, rate_hz=5.0)  # batches of 1, 3 and 2 rows
    whole = stream.read_bytes()
    ends = [end for end, _ in _batches(whole)]
    rows = [count for _, count in _batches(whole)]
    assert rows == [0, 1, 4, 6]
    assert ends[-1] == len(whole)
    for length in range(ends[-2], ends[-1] + 1):
        stream.write_bytes(whole[:length])
        (result,) = recover(tmp_path)
        expected = 6 if length == ends[-1] else 4
        assert (result.outcome, result.samples) == ("recovered", expected), length
        assert result.bytes_cut == (0 if length == ends[-1] else length - ends[-2])
        table = pq.read_table(tmp_path / "run.parquet")
        assert table["time_s"].to_pylist() == [i / 5.0 for i in range(expected)]
        torn = tmp_path / "run.arrows.torn"
        assert torn.exists() is (ends[-2] < length < ends[-1])
        if torn.exists():
            assert torn.read_bytes() == whole[:length]
            torn.unlink()
        (tmp_path / "run.parquet").unlink()


def test_a_stream_torn_before_its_first_batch_holds_nothing(tmp_path: Path) -> None:
    stream = killed(tmp_path, 6, rate_hz=5.0)
    whole = stream.read_bytes()
    header, first = (end for end, _ in _batches(whole)[:2])
    for length in range(first):
        stream.write_bytes(whole[:length])
        (result,) = recover(tmp_path)
        if 0 < length < header:  # not even known to be ours
            assert result.outcome == "unreadable", length
            assert result.sentence.endswith("It is left alone.")
            assert stream.read_bytes() == whole[:length]
        else:
            assert result.outcome == "empty", length
            left = [] if length in (0, header) else ["run.arrows.torn"]
            assert [p.name for p in tmp_path.iterdir()] == left
            stream.with_name("run.arrows.torn").unlink(missing_ok=True)


def test_garbage_behind_the_last_batch_is_cut(tmp_path: Path) -> None:
    stream = killed(tmp_path, 700)
    for garbage in (b"\x00" * 4096, b"\xff" * 64, os.urandom(333)):
        whole = stream.read_bytes()
        stream.write_bytes(whole + garbage)
        (result,) = recover(tmp_path)
        assert (result.samples, result.bytes_cut) == (700, len(garbage))
        (tmp_path / "run.parquet").unlink()
        stream.write_bytes(whole)


def test_a_stream_in_use_is_left_alone(tmp_path: Path) -> None:
    writer = StreamWriter(tmp_path, "run", metadata(), STREAM_COLUMNS)
    for i in range(700):
        writer.append(row(i))
    before = writer.path.read_bytes()
    (result,) = recover(tmp_path)
    assert result.outcome == "in use"
    assert "is being written by a living process" in result.sentence
    assert writer.path.read_bytes() == before
    writer.append(row(700))
    assert pq.read_metadata(writer.finish()).num_rows == 701
    assert recover(tmp_path) == ()


def test_recovering_twice_does_nothing_more(tmp_path: Path) -> None:
    killed(tmp_path, 700)
    recover(tmp_path)
    before = (tmp_path / "run.parquet").read_bytes()
    assert recover(tmp_path) == ()
    assert (tmp_path / "run.parquet").read_bytes() == before


def test_a_crash_between_the_recording_and_the_streams_removal(tmp_path: Path) -> None:
    stream = killed(tmp_path, 700)
    kept = stream.read_bytes()
    recover(tmp_path)
    before = (tmp_path / "run.parquet").read_bytes()
    stream.write_bytes(kept)
    (result,) = recover(tmp_path)
    assert (result.outcome, result.samples) == ("finished before", 700)
    assert not stream.exists()
    assert (tmp_path / "run.parquet").read_bytes() == before


@pytest.mark.parametrize("other", ["another run", "damaged", "fewer rows"])
def test_a_name_that_is_taken_costs_neither_file(tmp_path: Path, other: str) -> None:
    stream = killed(tmp_path, 700)
    kept = stream.read_bytes()
    path = tmp_path / "run.parquet"
    table = read_stream(stream).table
    if other == "another run":
        pq.write_table(table.set_column(3, "torque_nm", pa.array([0.5] * 700)), path)
    elif other == "fewer rows":
        pq.write_table(table.slice(0, 699), path)
    else:
        path.write_bytes(b"PAR1")
    before = path.read_bytes()
    (result,) = recover(tmp_path)
    assert result.outcome == "name taken"
    assert "move it away first" in result.sentence
    assert (stream.read_bytes(), path.read_bytes()) == (kept, before)


def test_a_recording_that_cannot_be_written_keeps_the_stream(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = killed(tmp_path, 700)
    kept = stream.read_bytes()

    def full(*_: object) -> None:
        raise StorageError("run.parquet cannot be written: the disk is full.")

    with monkeypatch.context() as patched:
        patched.setattr(module, "write_table", full)
        with pytest.raises(StorageError, match="the disk is full"):
            recover(tmp_path)
    assert stream.read_bytes() == kept
    assert recover(tmp_path)[0].outcome == "recovered"


def test_streams_that_are_not_ours_are_left_alone(tmp_path: Path) -> None:
    batch = pa.record_batch({"a": [1.0]})
    with ipc.new_stream(str(tmp_path / "theirs.arrows"), batch.schema) as writer:
        writer.write_batch(batch)
    (tmp_path / "noise.arrows").write_bytes(os.urandom(500))
    results = recover(tmp_path)
    assert [r.outcome for r in results] == ["unreadable", "unreadable"]
    assert "no key 'stribeck'" in results[1].sentence
    assert len(list(tmp_path.iterdir())) == 2


def test_folders_below_are_searched_and_old_temporaries_removed(tmp_path: Path) -> None:
    for name in ("night10", "night2"):
        (tmp_path / name).mkdir()
        killed(tmp_path / name, 700)
        (tmp_path / name / ".run.parquet.0a1b2c3d.tmp").write_bytes(b"half")
        (tmp_path / name / ".other.parquet.0a1b2c3d.tmp").write_bytes(b"not ours")
    results = recover(tmp_path)
    assert [r.stream.parent.name for r in results] == ["night2", "night10"]
    for result in results:
        left = {p.name for p in result.stream.parent.iterdir()}
        assert left == {"run.parquet", ".other.parquet.0a1b2c3d.tmp"}


@settings(max_examples=30, deadline=None)
@given(steps=st.lists(st.floats(1e-4, 0.7), min_size=1, max_size=30), torn=st.floats(0.0, 1.0))
def test_whatever_is_recovered_is_where_the_run_began(steps: list[float], torn: float) -> None:
    times = np.cumsum(steps)
    with TemporaryDirectory() as name:
        folder = Path(name)
        with StreamWriter(folder, "run", metadata(), STREAM_COLUMNS) as writer:
            for time_s in times:
                writer.append((time_s, 1.0, 2.0, time_s * 3.0, f"{time_s:.1f}"))
        size = int(torn * writer.path.stat().st_size)
        os.truncate(writer.path, size)
        results = recover(folder)
        if results[0].outcome == "recovered":
            table = pq.read_table(folder / "run.parquet")
            count = table.num_rows
            assert count >= 1
            assert table["time_s"].to_pylist() == times[:count].tolist()
            assert table["torque_nm"].to_pylist() == (times[:count] * 3.0).tolist()
            assert table["phase"].to_pylist() == [f"{t:.1f}" for t in times[:count]]
        assert torn < 1.0 or results[0].samples == len(times)


def test_what_is_no_stream_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        recover(tmp_path / "none")
    (tmp_path / "run.parquet").touch()
    with pytest.raises(InputError, match="is not an unfinished stream"):
        recover(tmp_path / "run.parquet")


def test_a_batch_that_asks_for_too_much_is_no_torn_tail(tmp_path: Path) -> None:
    stream = killed(tmp_path, 1200)
    whole = bytearray(stream.read_bytes())
    (header, _), (first, _) = _batches(bytes(whole))[:2]
    metadata_bytes = int.from_bytes(whole[header + 4 : header + 8], "little")
    body_bytes = first - header - 8 - metadata_bytes
    at = whole.index(body_bytes.to_bytes(8, "little"), header)
    whole[at : at + 8] = (2**61).to_bytes(8, "little")
    stream.write_bytes(whole)
    (result,) = recover(tmp_path)
    assert result.outcome == "unreadable"
    assert stream.read_bytes() == whole


def test_dictionaries_of_other_writers_are_read(tmp_path: Path) -> None:
    source = killed(tmp_path, 700)
    table = read_stream(source).table
    phase = table.column_names.index("phase")
    encoded = table.set_column(phase, "phase", table["phase"].dictionary_encode())
    with ipc.new_stream(str(tmp_path / "other.arrows"), encoded.schema) as writer:
        writer.write_table(encoded, max_chunksize=100)
    shutil.copy(tmp_path / "other.arrows", source)
    found = read(source)
    assert isinstance(found.metadata, Metadata)
    assert found["phase"].tolist() == table["phase"].to_pylist()


def _batches(whole: bytes) -> list[tuple[int, int]]:
    """Return, for the header and each batch, where it ends and how many rows end there."""
    source = pa.BufferReader(whole)
    reader = ipc.open_stream(source)
    ends = [(source.tell(), 0)]
    for batch in reader:
        ends.append((source.tell(), ends[-1][1] + batch.num_rows))
    return ends
