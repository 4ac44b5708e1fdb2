"""`stribeck flexible`: what swings behind the gear, and what knowing it is worth."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import typer

from agent.cli.identify.flexible_fit import Choice, Flexible, can_predict, flexible_of, swings
from agent.cli.identify.flexible_text import flexible_text
from agent.cli.terminal.pictures import write_picture
from agent.cli.terminal.talk import talker
from agent.conclude.comparable import one_axis
from agent.errors import UsageError
from agent.record.reading import read_all


def run_flexible(
    patterns: Sequence[str],
    kind: str,
    validation: Sequence[str],
    picture: Path | None,
    *,
    as_json: bool,
) -> None:
    """Identify the flexible joint of one axis and print it.

    Raises
    ------
    agent.errors.InputError
        A recording or an option cannot be used, or the recordings are not of one axis.
    """
    choice = _choice(kind)
    recordings = read_all(patterns)
    unseen = read_all(validation) if validation else ()
    one_axis([*recordings, *unseen])
    found = flexible_of(recordings, unseen, choice)
    if picture is not None:
        _draw(found, picture)
    document = json.dumps(found.to_json(), indent=2, allow_nan=False)
    typer.echo(document if as_json else flexible_text(found))


def _choice(kind: str) -> Choice:
    for known in get_args(Choice):
        if kind == known:
            choice: Choice = known
            return choice
    raise UsageError(f"--kind: expected one of {', '.join(get_args(Choice))}, got {kind!r}.")


def _draw(found: Flexible, path: Path) -> None:
    """Draw the picture, or say why there is nothing to draw."""
    if not (swings(found.fit) and can_predict(found.fit)):
        talker().print("No picture is drawn: no flexible joint was identified.")
        return
    from agent.report.figures.flexible import figure_flexible
    from agent.report.figures.flexible_view import measured_response, telling_stretch

    first = found.sources[0]
    periodic = [s for s in found.sources if s.means and s.period_s == first.period_s]
    shown = [m for s in periodic for m in s.means] or [s.signals for s in found.sources]
    period_s = periodic[0].period_s if periodic else math.nan
    response = measured_response(found.fit, shown, period_s)
    drawable = {v.recording for v in found.validations}
    names = [s for s in found.unseen if s.name in drawable]
    drawn = names[0] if names else first.signals
    stretch = telling_stretch(found.fit, drawn, first.period_s)
    write_picture(path, figure_flexible(found.fit, response, stretch, unseen=bool(names)))
