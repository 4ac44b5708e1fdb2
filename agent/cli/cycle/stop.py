"""`stribeck stop`: Stop test (not an E-stop), from another terminal.

It knows the running cycle by the lock of its axis and asks that process to stop, as Ctrl-C in its
own terminal does: it needs no access to the bus, and two programs never speak to one drive.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path

import typer

from agent.cell.cell import read_cell
from agent.cli.terminal.talk import talker
from agent.cycle.axis_lock import Holder, holders, is_held, lock_folder, lock_names, word_left
from agent.errors import InputError, StoppedError, UsageError
from drivers.clock import Clock, MonotonicClock

PATIENCE_S = 15.0
"""Stopping takes less than a second; giving a drive back, and finishing a recording, some more."""

_LOOK_S = 0.01
_E_STOP = "This is no E-stop: where a joint must stand at once, use the E-stop."


def stop(
    cell_path: Path | None,
    number: int | None,
    *,
    dry_run: bool,
    as_json: bool,
    clock: Clock | None = None,
) -> None:
    """Ask the cycle that owns an axis to stop, and wait until it has let go.

    Parameters
    ----------
    cell_path, number : pathlib.Path or None, int or None
        Which axis; every axis that is owned on this machine where no cell is given.
    dry_run : bool
        Only say whom it would ask.
    as_json : bool
        Write what became of each to stdout as JSON.
    clock : drivers.clock.Clock, optional
        Measures how long it takes.

    Raises
    ------
    agent.errors.InputError
        No cycle runs there, or it is another user's.
    agent.errors.StoppedError
        It has not let go in time: the E-stop is what is left.
    """
    if sys.platform == "win32":
        raise InputError(
            "Windows has no signal that asks another terminal's program to stop.",
            "Press Ctrl-C in the cycle's own terminal.",
        )
    found = _found(cell_path, number)
    if dry_run:
        for holder in found:
            typer.echo(f"Would ask {holder.who} to stop: it owns {holder.path.name}. {_E_STOP}")
        return
    talker().print(f"Stop test (not an E-stop): {', '.join(holder.who for holder in found)}.")
    clock = clock or MonotonicClock()
    asked_s = clock.now()
    for holder in found:
        _ask(holder)
    ended = [_ended(holder, asked_s, clock) for holder in found]
    if as_json:
        typer.echo(json.dumps({"schema": "stribeck.stop/1", "ended": ended}))
        return
    for entry in ended:
        typer.echo(f"{entry['who']} let go after {entry['let_go_after_s']:.2f} s. {entry['said']}")


def _found(cell_path: Path | None, number: int | None) -> tuple[Holder, ...]:
    """Return whom to ask."""
    if (cell_path is None) != (number is None):
        raise UsageError("Give a cell and --axis, or neither: then every axis is asked to stop.")
    if cell_path is None or number is None:
        found, where = holders(lock_folder()), "this machine"
    else:
        cell = read_cell(cell_path)
        found = holders(lock_folder(), lock_names(cell, cell.axis_numbered(number)))
        where = f"axis {number} of {cell.robot} on this machine"
    if not found:
        raise InputError(f"No cycle owns {where} now; nothing was asked to stop.", _E_STOP)
    return found


def _ask(holder: Holder) -> None:
    try:
        os.kill(holder.pid, signal.SIGINT)
    except ProcessLookupError:
        return  # it has just ended
    except PermissionError as error:
        raise InputError(
            f"{holder.who} cannot be asked to stop: it is another user's.",
            f"Ask as that user, or as the administrator. {_E_STOP}",
        ) from error


def _ended(holder: Holder, asked_s: float, clock: Clock) -> dict[str, str | int | float]:
    """Wait until a process has let go of its axis; return what it said."""
    while is_held(holder.path):
        if clock.now() - asked_s > PATIENCE_S:
            raise StoppedError(
                f"{holder.who} was asked to stop {PATIENCE_S:.0f} s ago and still owns its axis: "
                "nobody knows whether the joint stands.",
                "Use the E-stop, then look at that program.",
            )
        clock.sleep_until(clock.now() + _LOOK_S)
    return {
        "pid": holder.pid,
        "who": holder.who,
        "let_go_after_s": clock.now() - asked_s,
        "said": word_left(holder.path) or "It had come to its end.",
    }
