"""How the commands talk: stdout carries data, stderr talk and progress."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

STAGES = {
    "connect": "reaching the drive",
    "prove": "proving the drive's watchdog",
    "enable": "switching the drive on",
    "approach": "going to the start",
    "stair": "driving the stair",
    "return": "returning",
    "disable": "switching the drive off",
    "done": "done",
}


def talker() -> Console:
    """Return the console for talk: stderr, numbers and [words] in brackets as they are."""
    return Console(stderr=True, highlight=False, markup=False, soft_wrap=True)


@contextlib.contextmanager
def progress_bar(title: str) -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar on stderr; yield the function that moves it (stage, share 0 to 1).

    It appears with the first call, so that a refusal stands alone.
    """
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
        console=talker(),
        refresh_per_second=4,  # drawn by a thread that the control loop has to wait for
    )
    task = progress.add_task(title, total=1.0)

    def update(stage: str, share: float) -> None:
        words = STAGES.get(stage, stage)
        progress.update(task, completed=share, description=f"{f'{title}: {words}':<40}")
        if not progress.live.is_started:
            progress.start()

    try:
        yield update
    finally:
        if progress.live.is_started:
            progress.stop()


@contextlib.contextmanager
def stop_on_signal() -> Iterator[Callable[[], str | None]]:
    """Turn Ctrl-C, SIGTERM and SIGHUP into a request to stop that the control loop asks for.

    The joint is then stopped by the one clean-up path, in order, instead of the program being torn
    out of it. A second Ctrl-C changes nothing: the clean-up is already on its way.
    """
    asked = threading.Event()
    reason = ["the operator asked for it"]

    def ask(number: int, _frame: FrameType | None) -> None:
        if number != signal.SIGINT:
            reason[0] = f"the program was asked to end ({signal.Signals(number).name})"
        asked.set()

    # The terminal was closed: SIGHUP, on Windows SIGBREAK, by which the night asks there, too.
    names = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    kinds = [getattr(signal, name) for name in names if hasattr(signal, name)]
    previous = {kind: signal.signal(kind, ask) for kind in kinds}
    try:
        yield lambda: reason[0] if asked.is_set() else None
    finally:
        for kind, handler in previous.items():
            signal.signal(kind, handler)
