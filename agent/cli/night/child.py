"""One cycle of the night in a process of its own: nothing of the night can disturb its ticks.

It drives the axis exactly as `stribeck run` does, and says in a file what became of it, by the
kind of the error and not by its words. A request to stop ends the motion; the verdict on what was
recorded is made all the same.
"""

from __future__ import annotations

import contextlib
import json
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import FrameType

_ASKED = "The night was asked to stop before anything had moved."


def main(arguments: Sequence[str]) -> int:
    """Drive one cycle: CELL.toml, the axis's number, and where to say what became of it."""
    cell, axis, said = Path(arguments[0]), int(arguments[1]), Path(arguments[2])
    driven = _Driven()
    for name in ("SIGINT", "SIGTERM", "SIGBREAK"):  # the last on Windows alone
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), driven.asked_to_stop)
    document, code = {"kind": "run", "sentence": ""}, 0
    try:
        from agent.cli.cycle.run import run_axis

        run_axis(cell, axis, None, reverse=False, as_json=False, shown=driven.watched)
    except KeyboardInterrupt:
        document = {"kind": "skip", "sentence": _ASKED}
    except Exception as error:  # noqa: BLE001 - told to the night, which is the one to say it
        document, code = what_became(error)
    from agent.record.atomic import publish

    publish({said: json.dumps(document).encode()}, overwrite=True)
    return code


def what_became(error: Exception) -> tuple[dict[str, str], int]:
    """Return what became of a cycle that has raised, and the exit code.

    A refusal has moved nothing; of a device's error only the recording tells (`CellAttempts`).
    """
    from agent.cli.terminal.exits import DEVICE, OUR_FAULT, exit_code
    from agent.errors import RefusedError, StoppedError

    code = exit_code(error)
    sentence = str(error) or type(error).__name__
    if code == OUR_FAULT:
        sentence = f"A fault of stribeck's own ({type(error).__name__}: {sentence})."
    text = " ".join((sentence, *getattr(error, "__notes__", ())))
    kind = "failed"
    if isinstance(error, RefusedError):
        kind = "skip"
    elif isinstance(error, StoppedError) or code == DEVICE:
        kind = "stopped"
    return {"kind": kind, "sentence": text}, code


class _Driven:
    """Whether the motion is over; until then a request to stop ends this process or the motion."""

    def __init__(self) -> None:
        self._over = False

    def asked_to_stop(self, _number: int, _frame: FrameType | None) -> None:
        """Take a signal outside of the cycle, which has its own way to be stopped."""
        if not self._over:
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def watched(self, _title: str) -> Iterator[Callable[[str, float], None]]:
        """Show nothing; the cycle is over when this is left."""
        try:
            yield lambda _stage, _share: None
        finally:
            self._over = True


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
