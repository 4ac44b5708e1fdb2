"""kill -9 in the middle of a real-time recording loses no more than the last half second."""

from __future__ import annotations

import mmap
import os
import signal
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from agent.record.reading import read
from agent.record.streams.recover import recover
from agent.record.streams.stream import FLUSH_PERIOD_S
from drivers.clock import MonotonicClock

REPOSITORY = Path(__file__).resolve().parents[2]

# The child notes in shared memory, which outlives it, how many rows it has handed over, and when
# the last of them was.
CHILD = """
import mmap, struct, sys
from pathlib import Path
from agent.record.streams.stream import StreamWriter
from drivers.clock import MonotonicClock
from tests.unit.record.samples import STREAM_COLUMNS, metadata, row

clock = MonotonicClock()
with open(sys.argv[2], "r+b") as file:
    appended = mmap.mmap(file.fileno(), 16)
background = sys.argv[3] == "background"
writer = StreamWriter(
    Path(sys.argv[1]), "run", metadata(), STREAM_COLUMNS, background=background
)
start_s = clock.now()
for i in range(60_000):
    clock.sleep_until(start_s + i / 1000.0)
    time_s = clock.now() - start_s
    writer.append((time_s, *row(i)[1:]))
    struct.pack_into("<qd", appended, 0, i + 1, time_s)
"""


class Child:
    """The recording process, and how many rows it says it has appended."""

    def __init__(self, folder: Path, where: str) -> None:
        counter = folder / "appended"
        counter.write_bytes(bytes(16))
        with counter.open("r+b") as file:
            self._appended = mmap.mmap(file.fileno(), 16)
        self.process = subprocess.Popen(
            [sys.executable, "-c", CHILD, str(folder), str(counter), where], cwd=REPOSITORY
        )

    @property
    def appended(self) -> int:
        """Return how many rows the recorder has taken."""
        return int(struct.unpack_from("<q", self._appended)[0])

    @property
    def last_time_s(self) -> float:
        """Return the time of the last row that the recorder has taken."""
        return float(struct.unpack_from("<d", self._appended, 8)[0])

    def wait_for(self, rows: int) -> None:
        """Wait until so many rows were appended."""
        clock = MonotonicClock()
        deadline_s = clock.now() + 60.0
        while self.appended < rows:
            assert self.process.poll() is None, "the recording process ended by itself"
            assert clock.now() < deadline_s, f"only {self.appended} rows after 60 s"
            clock.sleep_until(clock.now() + 0.002)

    def kill(self) -> None:
        """End the process as the system would, without a chance to clean up."""
        os.kill(self.process.pid, signal.SIGKILL)
        assert self.process.wait(timeout=60.0) == -signal.SIGKILL

    def close(self) -> None:
        """Make sure that nothing is left of it."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(timeout=60.0)
        self._appended.close()


@pytest.fixture(params=["background"])
def child(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Child]:
    process = Child(tmp_path, request.param)
    yield process
    process.close()


@pytest.mark.real_time
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system has no kill -9")
@pytest.mark.parametrize(
    ("child", "rows"),
    [("background", 720), ("background", 1490), ("in the tick", 1990)],
    indirect=["child"],
)
def test_a_kill_loses_no_more_than_half_a_second(child: Child, tmp_path: Path, rows: int) -> None:
    child.wait_for(rows)
    (in_use,) = recover(tmp_path)
    assert in_use.outcome == "in use"

    child.kill()
    (result,) = recover(tmp_path)

    assert result.outcome == "recovered"
    assert result.recording is not None
    found = read(result.recording)
    assert len(found) == result.samples
    assert found["torque_nm"].tolist() == [0.125 * i for i in range(len(found))]
    assert child.last_time_s - found["time_s"][-1] <= FLUSH_PERIOD_S
    assert len(found) <= child.appended + 1  # a row may be written, but not yet noted
    assert "Recovered" in found.metadata.notes
    assert found.metadata.samples_lost is None
    assert not (tmp_path / "run.arrows").exists()


@pytest.mark.real_time
@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="this system cannot stop a process")
def test_a_process_that_hangs_still_owns_its_stream(child: Child, tmp_path: Path) -> None:
    child.wait_for(600)
    os.kill(child.process.pid, signal.SIGSTOP)
    (result,) = recover(tmp_path)
    assert result.outcome == "in use"
    child.kill()
    (result,) = recover(tmp_path)
    assert result.outcome == "recovered"
