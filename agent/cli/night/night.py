"""`stribeck night`: watch over a cell's nights, or do tonight's part; units for systemd."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import typer

from agent.cli.night.asked import Asked, asked_for
from agent.cli.night.cell import CellAttempts
from agent.cli.night.notify import sinks_of, told
from agent.cli.terminal.talk import stop_on_signal, talker
from agent.errors import AgentError, InputError
from agent.night import news
from agent.night.clock import MachineClock, stamp
from agent.night.night import Night
from agent.night.telling import Sink
from agent.record.atomic import make_folder, storage_error
from agent.record.catalogue.catalogue import Catalogue
from agent.record.events_file import Event, read_events
from agent.record.lock import try_lock


def run_night(cell_path: Path, night_file: Path | None, url: str | None, *, once: bool) -> None:
    """Watch over the nights until Ctrl-C or SIGTERM; or do what tonight's open windows ask for."""
    asked = asked_for(cell_path, night_file)
    make_folder(asked.folder)
    sinks = sinks_of(asked)  # a secret that is missing is known now, not in the night
    with ExitStack() as stack:
        stack.enter_context(_alone(asked))
        stop_requested = stack.enter_context(stop_on_signal())

        def stopped() -> bool:
            return stop_requested() is not None

        clock = MachineClock()
        events, problems = read_events(asked.folder)
        for problem in problems:
            talker().print(problem)
        attempts = CellAttempts(asked.path, asked.cell, asked.description, clock, stopped, url)
        for axis in asked.description.axis:
            attempts.needs(axis.number)  # a stair that cannot be driven is known now
        night = Night(
            asked.cell.robot,
            asked.description,
            attempts,
            clock,
            noting(asked, url, sinks),
            [event for _, event in events],
        )
        if once:
            night.tonight(stopped)
        else:
            _say_next(night, asked)
            night.run(stopped)


@contextlib.contextmanager
def _alone(asked: Asked) -> Iterator[None]:
    """Be the only program that watches over this cell's nights: two would try an axis twice.

    Raises
    ------
    agent.errors.InputError
        Another one does already.
    agent.errors.StorageError
        The folder cannot be written.
    """
    path = asked.folder / f".{asked.cell.robot}.night.lock"
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise storage_error(error, f"{path} cannot be made") from error
    try:
        if not try_lock(descriptor):
            raise InputError(
                f"The nights of {asked.cell.robot} are watched already, by another program.",
                "Let that end first: `systemctl list-timers` shows a timer.",
            )
        yield
    finally:
        os.close(descriptor)


def noting(asked: Asked, url: str | None, sinks: tuple[Sink, ...]) -> Callable[[Event], None]:
    """Return what records an event and tells it; whatever fails of that is said on stderr."""

    def note(event: Event) -> None:
        event = news.judged(event, _earlier(asked.folder))
        joint = event.robot if event.axis is None else f"{event.robot} axis {event.axis}"
        talker().print(f"{event.at}  {joint}  {event.kind}: {event.text}")
        try:
            with Catalogue(asked.folder, url) as catalogue:
                catalogue.record_event(event)
        except AgentError as error:
            talker().print(str(error))
        for delivery in told(event, sinks):
            talker().print(delivery.sentence)

    return note


def _earlier(folder: Path) -> list[Event]:
    """Return the folder's events; of a file that cannot be read none, and then all is news."""
    try:
        return [event for _, event in read_events(folder)[0]]
    except AgentError as error:
        talker().print(str(error))
        return []


def _say_next(night: Night, asked: Asked) -> None:
    zone = asked.description.zone
    for window in night.next_windows()[: len(asked.description.axis)]:
        begins, ends = (t.astimezone(zone) for t in (window.begins, window.ends))
        talker().print(
            f"Axis {window.axis} of {asked.cell.robot}: next window "
            f"{begins:%a %Y-%m-%d %H:%M} to {ends:%H:%M} ({asked.description.time_zone})."
        )


def show_plan(cell_path: Path, night_file: Path | None, *, as_json: bool) -> None:
    """Print the windows of the coming week, and what would keep an axis from running now."""
    asked = asked_for(cell_path, night_file)
    clock = MachineClock()
    attempts = CellAttempts(asked.path, asked.cell, asked.description, clock, lambda: False)
    night = Night(asked.cell.robot, asked.description, attempts, clock, lambda _event: None)
    windows = night.next_windows()
    blocked = {axis.number: attempts.blocked(axis.number) for axis in asked.description.axis}
    if as_json:
        document = [
            {
                "axis": w.axis,
                "night": w.night.isoformat(),
                "begins": stamp(w.begins),
                "ends": stamp(w.ends),
                "blocked": blocked[w.axis],
            }
            for w in windows
        ]
        typer.echo(json.dumps(document, indent=2))
        return
    zone = asked.description.zone
    for window in windows:
        begins, ends = (t.astimezone(zone) for t in (window.begins, window.ends))
        typer.echo(f"axis {window.axis}  {begins:%a %Y-%m-%d %H:%M} to {ends:%a %H:%M %Z}")
    for axis, reason in blocked.items():
        if reason:
            typer.echo(f"axis {axis} would be skipped now: {reason}.")
