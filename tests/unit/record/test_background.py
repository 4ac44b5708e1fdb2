"""The recorder's thread: the tick never waits for it, and hears of its failure at the next row."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from agent.errors import StorageError
from agent.record import atomic
from agent.record.reading import read
from agent.record.rows import CAPACITY_ROWS
from agent.record.streams import open_stream
from agent.record.streams.background import PENDING_MAX
from agent.record.streams.recover import recover
from agent.record.streams.stream import FLUSH_PERIOD_S, HAND_OVER_PERIOD_S, StreamWriter
from drivers.clock import MonotonicClock
from tests.unit.record.samples import STREAM_COLUMNS, metadata, row

CLOCK = MonotonicClock()
RATE_HZ = 1000.0


class Disk:
    """The real one, but it can be told to take its time, or to fail."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.open.set()
        self.error: BaseException | None = None

    def write_all(self, descriptor: int, content: Any) -> None:
        if not self.open.is_set():
            assert self.open.wait(60.0)
        if self.error is not None:
            raise self.error
        atomic.write_all(descriptor, content)


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Disk]:
    made = Disk()
    monkeypatch.setattr(open_stream, "write_all", made.write_all)
    yield made
    made.open.set()


@pytest.fixture
def writer(tmp_path: Path, disk: Disk) -> Iterator[StreamWriter]:
    made = StreamWriter(tmp_path, "run", metadata(), STREAM_COLUMNS, background=True)
    yield made
    disk.open.set()
    disk.error = None
    made.abandon()


def settle(writer: StreamWriter) -> int:
    """Wait until the thread has saved what it was handed; return how many rows that makes."""
    assert writer._saver is not None
    deadline_s = CLOCK.now() + 60.0
    while writer._saver.oldest_s is not None:
        assert CLOCK.now() < deadline_s, "rows still wait after 60 s"
        CLOCK.sleep_until(CLOCK.now() + 0.001)
    return writer._samples_saved


def append(writer: StreamWriter, start: int, stop: int) -> None:
    for i in range(start, stop):
        writer.append(row(i, RATE_HZ))


def test_rows_become_the_same_recording(writer: StreamWriter) -> None:
    for start in range(0, 1200, 50):  # rows come in real time: the thread has some, too
        append(writer, start, start + 50)
        assert start + 50 - settle(writer) <= 1000.0 * HAND_OVER_PERIOD_S + 1
    found = read(writer.finish(samples_lost=2))
    for at, name in enumerate(STREAM_COLUMNS):
        assert found[name].tolist() == [row(i, RATE_HZ)[at] for i in range(1200)], name
    assert found.metadata == metadata(samples_lost=2)


def test_the_tick_does_not_wait_and_stops_before_half_a_second_could_be_lost(
    writer: StreamWriter, disk: Disk
) -> None:
    append(writer, 0, 1)
    assert settle(writer) == 1
    disk.open.clear()
    with pytest.raises(StorageError, match="is not written as fast as samples come: 1 of"):
        append(writer, 1, 2000)  # would stand still here, if it waited
    taken = writer.samples + writer.samples_unsaved
    assert FLUSH_PERIOD_S - HAND_OVER_PERIOD_S < taken / RATE_HZ <= FLUSH_PERIOD_S
    append(writer, taken, taken + 10)  # the joint is being stopped; nobody is told again
    disk.open.set()  # what had been handed over is saved all the same
    found = read(writer.finish(samples_lost=3))
    assert len(found) >= 300
    assert found["time_s"].tolist() == [row(i, RATE_HZ)[0] for i in range(len(found))]
    assert found.samples_lost == 3 + taken + 10 - len(found)
    assert "could not be saved" in found.metadata.notes


def test_what_came_while_a_joint_was_stopped_comes_at_once_and_is_kept(
    writer: StreamWriter, disk: Disk
) -> None:
    """A stop hands over what it has seen when it is over; that had been called a slow disk."""
    append(writer, 0, 100)
    writer.wait_for_disk()
    disk.open.clear()
    append(writer, 100, 2000)
    disk.open.set()
    found = read(writer.finish(samples_lost=0))
    assert (len(found), found.samples_lost) == (2000, 0)


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (OSError(28, os.strerror(28)), "samples are saved in it: the disk is full"),
        (MemoryError("no more"), "its thread has ended"),
    ],
)
def test_a_failure_is_told_at_the_next_row_and_once(
    writer: StreamWriter, disk: Disk, error: BaseException, says: str
) -> None:
    append(writer, 0, 250)
    writer.flush()
    assert settle(writer) == 250
    disk.error = error
    append(writer, 250, 280)
    writer.flush()
    assert writer._saver is not None
    writer._saver._thread.join(60.0)
    with pytest.raises(StorageError, match=says):
        append(writer, 280, 281)
    append(writer, 281, 285)
    disk.error = None
    found = read(writer.finish())
    assert (len(found), found.samples_lost) == (250, 35)


def test_a_failure_at_the_end_is_told_and_keeps_the_stream(
    writer: StreamWriter, disk: Disk
) -> None:
    append(writer, 0, 150)
    writer.flush()
    assert settle(writer) == 150
    append(writer, 150, 200)
    disk.error = OSError(28, os.strerror(28))
    with pytest.raises(StorageError, match="150 samples are saved"):
        writer.finish()
    disk.error = None
    (result,) = recover(writer.path)
    assert result.samples == 150


def test_rows_without_a_time_cannot_pile_up(writer: StreamWriter, disk: Disk) -> None:
    disk.open.clear()
    row_without_a_time = (float("nan"), 1.0, 2.0, 3.0, "stuck")
    for _ in range(PENDING_MAX * CAPACITY_ROWS):
        writer.append(row_without_a_time)
    with pytest.raises(StorageError, match="not written as fast"):
        writer.append(row_without_a_time)
