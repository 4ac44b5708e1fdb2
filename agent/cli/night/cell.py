"""The night's hands: what may run unattended, how warm it is, and one cycle as a child process."""

from __future__ import annotations

import datetime
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from agent.cell.cell import Cell
from agent.cell.devices import Cia404Temperature
from agent.cycle.plan import plan_cycle
from agent.errors import AgentError, InputError
from agent.night.attempt import Outcome
from agent.night.clock import WallClock
from agent.night.description import NightDescription
from agent.night.windows import Window
from agent.record.reading import PARQUET, STREAM
from agent.record.retention import over_limit
from agent.record.seal import content
from agent.record.verdict_file import Verdict, read_verdict, verdict_path
from agent.wire.devices import permit_wait_s, temperature_probe
from drivers.clock import MonotonicClock
from drivers.errors import DriverError

_SLACK = 1.5  # how much longer than planned a cycle may take
_AROUND_S = 120.0  # reaching the drive, its watchdog's proof, approach, return, verdict
_TO_REST_S = 60.0  # from being asked to stop to being gone, before it is killed
_LOOK = datetime.timedelta(seconds=1)


@dataclass(frozen=True)
class CellAttempts:
    """A cell, as `agent.night.attempt.Attempts` has it.

    Parameters
    ----------
    path, cell, description
        CELL.toml, what it says, and what the night's file says.
    clock : WallClock
        For the window's end.
    stopped : callable
        Whether somebody has asked the night to stop: the cycle then stops, too.
    catalogue_url : str, optional
        Where the verdicts are kept besides their files.
    """

    path: Path
    cell: Cell
    description: NightDescription
    clock: WallClock
    stopped: Callable[[], bool]
    catalogue_url: str | None = None

    @property
    def folder(self) -> Path:
        """Return where the cell's recordings go."""
        return self.path.parent / self.cell.recording.folder

    def blocked(self, axis: int) -> str:
        """Return why the axis must not run unattended now."""
        described = self.cell.axis_numbered(axis)
        reasons = []
        replays = self.cell.bus_ is not None and self.cell.bus_.replays
        if self.cell.release is None and described.job is None and not replays:
            reasons.append(
                "the cell has no [release], and at night nobody is there to guarantee that it is "
                "closed, free and in automatic mode"
            )
        full = over_limit(self.folder, self.description.disk.limit_mb)
        return "; ".join([*reasons, *([full] if full else [])])

    def needs(self, axis: int) -> datetime.timedelta:
        """Return how long a cycle takes at most."""
        described = self.cell.axis_numbered(axis)
        planned_s = plan_cycle(self.cell, described).trajectory.duration_s
        seconds = _SLACK * planned_s + _AROUND_S + permit_wait_s(self.cell)
        return datetime.timedelta(seconds=seconds)

    def temperature(self, axis: int) -> float | None:
        """Read the gearbox temperature from a device that can be asked without the drive."""
        described = self.cell.axis_numbered(axis).temperature
        if described is None or isinstance(described, Cia404Temperature):
            return None
        try:
            probe = temperature_probe(described, None, MonotonicClock())
            try:
                probe.open()
                degc = probe.latest().degc
            finally:
                probe.close()
        except (DriverError, InputError):
            return None  # the cycle itself refuses a temperature that is not known, and says why
        return degc if math.isfinite(degc) else None

    def attempt(self, window: Window) -> Outcome:
        """Drive one cycle in a process of its own; ask it to stop when the window ends."""
        before = self._files(window.axis)
        with tempfile.TemporaryDirectory(prefix="stribeck-night-") as place:
            said = Path(place) / "outcome.json"
            talk = Path(place) / "talk.txt"
            try:
                forced = self._run(window, said, talk)
            except OSError as error:
                return Outcome("failed", f"The cycle could not be begun: {error}.")
            outcome = _read(said, talk, forced)
        new = sorted(self._files(window.axis) - before)
        finished = [path for path in new if path.suffix == PARQUET]
        if not finished and new:  # killed, or the disk failed: a stream is left
            text = f"{outcome.sentence} `stribeck recover` finishes {new[-1].name}."
            return replace(outcome, kind="stopped", sentence=text)
        return self._concluded(outcome, finished[-1] if finished else None)

    def _run(self, window: Window, said: Path, talk: Path) -> str:
        """Have the cycle driven; return what was done to end it, empty where it ended by itself."""
        # -P: a folder named `agent` where this was started must not take our place
        command = [sys.executable, "-P", "-m", "agent.cli.night.child"]
        command += [str(self.path.resolve()), str(window.axis), str(said)]
        with talk.open("wb") as sink:
            child = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=sink,
                env={**os.environ, "PYTHONIOENCODING": "utf-8"},  # read as that, on Windows too
                # Ctrl-C here reaches it through us alone, once
                start_new_session=True,
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # Windows
            )
        forced = ""
        kill_at: datetime.datetime | None = None
        while child.poll() is None:
            now = self.clock.now()
            late = now >= window.ends
            if not forced and (late or self.stopped()):
                forced = "The quiet window ended." if late else "The night was asked to stop."
                _ask_to_stop(child)
                kill_at = now + datetime.timedelta(seconds=_TO_REST_S)
            elif kill_at is not None and now >= kill_at:
                # its heartbeat ends with it, and the drive stops the joint by itself
                forced += " The cycle did not end when asked to, and was killed."
                child.kill()
                kill_at = None
            self.clock.wait_until(now + _LOOK, lambda: child.poll() is not None)
        return forced

    def _files(self, axis: int) -> set[Path]:
        """Return the axis's recordings, finished or not."""
        own = f"{self.cell.robot}-axis{axis}-*"
        return {p for suffix in (PARQUET, STREAM) for p in self.folder.glob(f"{own}{suffix}")}

    def _concluded(self, outcome: Outcome, recording: Path | None) -> Outcome:
        """Return the outcome with what the recording and its verdict say."""
        if recording is None:
            # without a sample there was no motion: it is recorded from before the first set-point
            nothing = outcome.kind == "stopped"
            return replace(outcome, kind="skip") if nothing else outcome
        try:
            sha256 = content(recording).sha256
            if outcome.kind != "run":
                return self._cut_short(outcome, recording, sha256)
            from agent.cli.history.verdict import against_baseline

            verdict = read_verdict(verdict_path(recording))
            verdict = against_baseline(recording, verdict, self.catalogue_url)
        except AgentError as error:
            return replace(outcome, kind="failed", sentence=str(error))
        return Outcome(
            "alarm" if verdict.alarm else "run",
            verdict.sentence,
            sha256,
            {"file": recording.name, **_about(verdict)},
        )

    def _cut_short(self, outcome: Outcome, recording: Path, sha256: str) -> Outcome:
        """Return the outcome of a cycle that left a recording, which is kept, and no verdict."""
        from agent.cli.record.keep import take

        kind = "stopped" if outcome.kind == "skip" else outcome.kind
        try:
            take(recording, self.catalogue_url)
        except AgentError as error:  # too short to be one: it stays as it is
            outcome = replace(outcome, sentence=f"{outcome.sentence} {error}")
        return replace(outcome, kind=kind, recording=sha256, details={"file": recording.name})


def _about(verdict: Verdict) -> dict[str, Any]:
    return {
        "state": verdict.state,
        "decidable": verdict.decidable,
        "numbers": dict(verdict.numbers),
        "facts": dict(verdict.facts),
        "version": verdict.version,
    }


def _ask_to_stop(child: subprocess.Popen[bytes]) -> None:
    """Ask a cycle to stop by its one way to rest; on Windows no other signal reaches a child."""
    if sys.platform == "win32":
        child.send_signal(signal.CTRL_BREAK_EVENT)
    else:
        child.send_signal(signal.SIGINT)


def _read(said: Path, talk: Path, forced: str) -> Outcome:
    """Return what the child has said; where it said nothing, what is known all the same."""
    try:
        document: Mapping[str, Any] = json.loads(said.read_text(encoding="utf-8"))
        return Outcome(str(document["kind"]), f"{document['sentence']} {forced}".strip())
    except (OSError, ValueError, KeyError, TypeError):
        if forced:  # asked to stop before it could listen, or killed: the recording tells which
            return Outcome("stopped", forced)
        last = talk.read_text(encoding="utf-8", errors="replace").strip()[-300:]
        return Outcome("failed", f"The cycle ended without a word on what became of it. {last}")
