"""One cycle of the night in a process of its own: nothing of the night can disturb its ticks.

It drives the axis exactly as `stribeck run` does, and says in a file what became of it, by the
kind of the error and not by its words.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from agent.cli.exits import OUR_FAULT, exit_code
from agent.cycle.runner import Progress
from agent.errors import RefusedError, StoppedError
from agent.night.attempt import Outcome
from agent.record.atomic import publish
from drivers.errors import DriverError

MOVED = "moved"  # of an outcome: the agent cannot exclude that the joint has moved


def main(arguments: Sequence[str]) -> int:
    """Drive one cycle: CELL.toml, the axis's number, and where to say what became of it."""
    cell, axis, said = Path(arguments[0]), int(arguments[1]), Path(arguments[2])
    from agent.cli.run import run_axis

    code = 0
    outcome = Outcome("run", "")
    try:
        run_axis(cell, axis, None, reverse=False, as_json=False, shown=_silent)
    except Exception as error:  # noqa: BLE001 - told to the night, which is the one to say it
        code = exit_code(error)
        outcome = what_became(error)
    publish({said: json.dumps(asdict(outcome)).encode()}, overwrite=True)
    return code


def what_became(error: Exception) -> Outcome:
    """Return the outcome of a cycle that has raised.

    A refusal has moved nothing; of a device's error only the recording tells (`CellAttempts`).
    """
    sentence = str(error) or type(error).__name__
    if exit_code(error) == OUR_FAULT:
        sentence = f"A fault of stribeck's own ({type(error).__name__}: {sentence})."
    notes = tuple(getattr(error, "__notes__", ()))
    text = " ".join((sentence, *notes))
    if isinstance(error, RefusedError):
        return Outcome("skip", text)
    if isinstance(error, StoppedError):
        return Outcome("stopped", text)
    return Outcome("stopped" if isinstance(error, DriverError) else "failed", text)


@contextlib.contextmanager
def _silent(_title: str) -> Iterator[Progress]:
    yield lambda _stage, _share: None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
