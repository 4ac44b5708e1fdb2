"""The page's cycle: `stribeck run` as a child, with a lifeline to the page and progress in a file.

The lifeline is standard input, held open by the page. When it ends - the page's process has died,
however that came - whoever stood at the robot has lost the stop that they were promised, so the
cycle is asked to stop, as a closed terminal asks it (docs/decisions/0017). What the cycle does
never waits for the page: a thread writes its progress five times a second to a small file.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from agent.cell.cell import read_cell
from agent.cli.cycle.run import run_axis
from agent.cli.terminal.talk import talker
from agent.record.verdict_file import SUFFIX as VERDICT
from agent.record.verdict_file import read_verdict

PROGRESS_BYTES = 96
PERIOD_S = 0.2
_LOOK_S = 0.05


def serve_run(
    cell: Path, axis: int, *, reverse: bool, trajectory: Path | None, progress: Path
) -> None:
    """Drive one cycle for the page; see `agent.cli.cycle.run.run_axis`."""
    threading.Thread(target=_hold_lifeline, name="lifeline", daemon=True).start()

    @contextlib.contextmanager
    def shown(_title: str) -> Iterator[Callable[[str, float], None]]:
        with progress_file(progress) as update:
            yield update

    before = verdicts_of(cell, axis)
    run_axis(
        cell, axis, None, reverse=reverse, as_json=True, trajectory_path=trajectory, shown=shown
    )
    for fresh in verdicts_of(cell, axis) - before:
        judge_by_history(fresh)


def verdicts_of(cell_path: Path, axis: int) -> set[Path]:
    """Return the verdicts on an axis's recordings, in the cell's own folder."""
    cell = read_cell(cell_path)
    folder = cell_path.parent / cell.recording.folder
    return set(folder.glob(f"{cell.robot}-axis{axis}-*{VERDICT}"))


def judge_by_history(verdict: Path) -> None:
    """Let the monitor judge a fresh cycle by its joint's history, as the night does; say it."""
    from agent.cli.history.verdict import against_baseline

    recording = verdict.with_name(verdict.name.removesuffix(VERDICT) + ".parquet")
    judged = against_baseline(recording, read_verdict(verdict))
    talker().print(judged.sentence)


@contextlib.contextmanager
def progress_file(path: Path) -> Iterator[Callable[[str, float], None]]:
    """Yield the function that the control loop tells stage and share; it only keeps them.

    Parameters
    ----------
    path : pathlib.Path
        Holds one JSON object, padded to `PROGRESS_BYTES`, and is overwritten in place.
    """
    told: list[tuple[str, float]] = [("begin", 0.0)]
    ended = threading.Event()
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)

    def write() -> None:
        stage, share = told[0]
        text = json.dumps({"stage": stage, "share": round(share, 4)})
        with contextlib.suppress(OSError):  # the page then shows an older stage; nothing else
            os.lseek(descriptor, 0, os.SEEK_SET)
            os.write(descriptor, text.ljust(PROGRESS_BYTES).encode())

    def keep_writing() -> None:
        while not ended.wait(PERIOD_S):
            write()

    def tell(stage: str, share: float) -> None:
        told[0] = (stage, share)

    write()
    thread = threading.Thread(target=keep_writing, name="progress", daemon=True)
    thread.start()
    try:
        yield tell
    finally:
        ended.set()
        thread.join()
        write()
        os.close(descriptor)


def _hold_lifeline() -> None:
    """Wait until the page is gone; then ask the cycle to stop as soon as it can be asked.

    A cycle can be asked while it has its own handlers for signals. Before, nothing moves; after,
    nothing moves any more, and the estimate may be finished in peace.
    """
    with contextlib.suppress(OSError, ValueError):  # a line that breaks means as much as its end
        while os.read(sys.stdin.fileno(), 64):
            pass
    kind = getattr(signal, "SIGHUP", signal.SIGTERM)
    waiting = threading.Event()
    while signal.getsignal(kind) in (signal.SIG_DFL, signal.SIG_IGN, None):
        waiting.wait(_LOOK_S)
    if sys.platform == "win32":
        signal.raise_signal(kind)
    else:  # to the main thread itself, which it wakes from whatever it waits for
        signal.pthread_kill(threading.main_thread().ident or 0, kind)
