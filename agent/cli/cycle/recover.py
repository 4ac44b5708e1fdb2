"""`stribeck recover`: finish what a kill or a power cut has left behind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import typer

from agent.cli.terminal.talk import talker
from agent.errors import InputError
from agent.given_back import not_yet
from agent.record.streams.recover import recover


def run_recover(places: Sequence[Path]) -> None:
    """Finish every unfinished recording in `places`; print the finished files.

    Raises
    ------
    agent.errors.InputError
        Where a stream could not be finished; the others were, first.
    """
    outcomes = [outcome for place in places for outcome in recover(place)]
    for outcome in outcomes:
        talker().print(outcome.sentence)
        if outcome.recording is not None:
            typer.echo(str(outcome.recording))
    for place in places:
        for waits in not_yet(place if place.is_dir() else place.parent):
            talker().print(waits)
    if not outcomes:
        talker().print("Nothing to recover: no unfinished recording was found.")
    stuck = [o for o in outcomes if o.outcome in ("unreadable", "name taken")]
    if stuck:
        raise InputError(f"{len(stuck)} of {len(outcomes)} could not be finished (see above).")
