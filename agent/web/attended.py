"""A cycle that the page has started: a child process, asked to stop by a signal, read from files.

Nothing of the child ever waits for the page: its words go to files, its samples to the recording
that it would write anyway. The page holds its standard input open; when the page dies the child
notices and stops (`agent.cli.page.run`).
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from agent.cell.cell import Axis, Cell
from agent.cycle.stage import Stage
from agent.record.reading import STREAM
from agent.web.cycles import Cycle
from agent.web.tail import Point, StreamTail, Thinner
from drivers.clock import Clock, wall_time_utc
from trajectories import Trajectory

AROUND = frozenset(stage.value for stage in Stage if stage is not Stage.STAIR)
"""What the recording calls samples that are not of the stair."""
CATCH_UP_S = 0.4
MOST_RUNS = 50
_READ_BYTES = 1 << 20


@dataclass(frozen=True)
class Asked:
    """What somebody asked for."""

    axis: int
    cycle: str
    who: str


@dataclass(frozen=True)
class Ended:
    """How a cycle ended: the exit code of `stribeck run`, what it said, and its recording."""

    code: int
    talk: str
    recording: str = ""

    @property
    def well(self) -> bool:
        """Return whether the cycle ran to its end and was estimated."""
        return self.code in (0, 1)


@dataclass
class AttendedRun:
    """One cycle from its start to its end, as the page sees it."""

    asked: Asked
    identity: str
    trajectory: Trajectory
    gear_ratio: float
    recordings: Path
    folder: Path
    process: subprocess.Popen[bytes]
    before: frozenset[str]
    points: list[Point] = field(default_factory=list)
    stage: str = "begin"
    share: float = 0.0
    stopping: bool = False
    stair_began_s: float | None = None
    ended: Ended | None = None
    _stream: Path | None = None
    _tail: StreamTail | None = None
    _thinner: Thinner = field(default_factory=Thinner)
    _waiting: list[Point] = field(default_factory=list)
    _play_s: float = 0.0
    _looked_s: float | None = None

    @property
    def steps(self) -> int:
        """Return how many steady speeds the stair has."""
        return len(self.trajectory.steady_windows())

    @property
    def step(self) -> int:
        """Return which of them is being driven, from 1; 0 before the first."""
        at_s = self.share * self.trajectory.duration_s
        return sum(window.start_s <= at_s for window in self.trajectory.steady_windows())

    @property
    def left_s(self) -> float:
        """Return how much of the stair is left, in seconds."""
        return (1.0 - self.share) * self.trajectory.duration_s

    def look(self, now_s: float) -> None:
        """See what the child has written and whether it has ended; costs a file's size mostly."""
        passed_s = 0.0 if self._looked_s is None else now_s - self._looked_s
        self._looked_s = now_s
        code = self.process.poll()
        self._see_progress()
        self._see_samples()
        self._play(passed_s)
        if code is not None and self.ended is None:
            self._end(code)

    def ask_to_stop(self) -> None:
        """Ask the cycle to stop by its one way to rest; may be repeated."""
        if self.process.poll() is not None:
            return
        self.stopping = True
        if sys.platform == "win32":
            self.let_go()
        else:
            self.process.send_signal(signal.SIGINT)

    def let_go(self) -> None:
        """End the lifeline."""
        if self.process.stdin is not None:
            self.process.stdin.close()

    def _see_progress(self) -> None:
        try:
            told = json.loads((self.folder / "progress").read_bytes())
            self.stage, self.share = str(told["stage"]), float(told["share"])
        except (OSError, ValueError, KeyError, TypeError):
            return  # not there yet

    def _see_samples(self) -> None:
        if self._tail is None:
            fresh = (
                [
                    name
                    for name in os.listdir(self.recordings)  # noqa: PTH208 - names are all it takes
                    if name.endswith(STREAM) and name not in self.before
                ]
                if self.recordings.is_dir()
                else []
            )
            if not fresh:
                return
            self._stream = self.recordings / sorted(fresh)[-1]
            try:
                self._tail = StreamTail(self._stream)
            except OSError:
                return
        for rows in self._tail.read():
            self._waiting += self._thinner.points(rows)

    def _play(self, passed_s: float) -> None:
        """Let points through at the pace of time: the recorder hands them over in lots of two."""
        if not self._waiting:
            return
        newest_s = self._waiting[-1].time_s
        self._play_s = min(max(self._play_s + passed_s, newest_s - CATCH_UP_S), newest_s)
        while self._waiting and self._waiting[0].time_s <= self._play_s:
            point = self._waiting.pop(0)
            if self.stair_began_s is None and point.phase and point.phase not in AROUND:
                self.stair_began_s = point.time_s
            self.points.append(point)

    def _end(self, code: int) -> None:
        if self._tail is not None:
            self._see_samples()
            self._tail.close()
        self.points += self._waiting
        self._waiting = []
        self.let_go()
        name = "" if self._stream is None else self._stream.name.removesuffix(STREAM)
        kept = name if name and (self.recordings / f"{name}.parquet").exists() else ""
        talk = (self.folder / "talk.txt").read_bytes()[-_READ_BYTES:].decode(errors="replace")
        self.ended = Ended(code, talk.strip(), kept)
        text = json.dumps({"code": code, "recording": kept, "at": wall_time_utc()})
        (self.folder / "ended.json").write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class Launch:
    """Where runs are kept and how a child is started; tests hand in another command."""

    state: Path
    cell_path: Path
    command: Sequence[str] = (sys.executable, "-m", "agent.cli")

    def __call__(
        self, cell: Cell, axis: Axis, cycle: Cycle, trajectory: Trajectory, asked: Asked
    ) -> AttendedRun:
        """Start one cycle.

        Raises
        ------
        OSError
            No file can be made, or no process started.
        """
        stamp = wall_time_utc().replace("-", "").replace(":", "").replace(".", "")
        identity = f"{stamp}-axis{axis.number}"
        folder = self.state / "runs" / identity
        folder.mkdir(parents=True)
        _forget_the_oldest(folder.parent)
        recordings = self.cell_path.parent / cell.recording.folder
        before = frozenset(p.name for p in recordings.glob(f"*{STREAM}"))
        arguments = [
            "serve-run",
            str(self.cell_path),
            "--axis",
            str(axis.number),
            "--progress",
            str(folder / "progress"),
            *cycle.arguments,
        ]
        with (folder / "out.json").open("wb") as out, (folder / "talk.txt").open("wb") as talk:
            process = subprocess.Popen(
                [*self.command, *arguments],
                stdin=subprocess.PIPE,
                stdout=out,
                stderr=talk,
                env={**os.environ, "PYTHONIOENCODING": "utf-8"},  # read as that, on Windows too
                start_new_session=True,  # Ctrl-C at the server reaches it by the page's own way
            )
        return AttendedRun(
            asked, identity, trajectory, axis.gear_ratio, recordings, folder, process, before
        )


def _forget_the_oldest(runs: Path) -> None:
    """Remove what the oldest runs have said; their recordings are elsewhere and stay."""
    for folder in sorted(path for path in runs.iterdir() if path.is_dir())[:-MOST_RUNS]:
        shutil.rmtree(folder, ignore_errors=True)


class Attendant:
    """Looks after the one cycle that may run: one at a time in a cell, for the others must rest.

    Parameters
    ----------
    launch : Launch
        Starts the child.
    clock : drivers.clock.Clock
        Monotonic.
    """

    def __init__(self, launch: Launch, clock: Clock) -> None:
        self._launch = launch
        self._clock = clock
        self.run: AttendedRun | None = None

    @property
    def active(self) -> AttendedRun | None:
        """Return the cycle whose process lives."""
        return self.run if self.run is not None and self.run.ended is None else None

    def start(
        self, cell: Cell, axis: Axis, cycle: Cycle, trajectory: Trajectory, who: str
    ) -> AttendedRun | None:
        """Start a cycle; None where one is running."""
        if self.active is not None:
            return None
        asked = Asked(axis.number, cycle.word, who)
        self.run = self._launch(cell, axis, cycle, trajectory, asked)
        return self.run

    def stop(self) -> AttendedRun | None:
        """Ask the running cycle to stop; None where none is running."""
        run = self.active
        if run is not None:
            run.ask_to_stop()
        return run

    def look(self) -> None:
        """See what has become of the cycle."""
        if self.active is not None:
            self.active.look(self._clock.now())
