"""How `stribeck monitor` is asked for. Heavy imports are inside."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import place


def add_commands(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(short_help="has friction changed over months, at equal temperature? why?")(monitor)


def monitor(
    history: Annotated[
        list[str],
        typer.Argument(metavar="HISTORY...", help="A joint's cycles: files, folders or globs."),
    ],
    baseline: Annotated[
        int | None,
        typer.Option(min=3, help="How many of the first cycles are healthy; else chosen by rule."),
    ] = None,
    siblings: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="Of joints of the same kind, which teach; several."),
    ] = None,
    events: Annotated[
        Path | None,
        typer.Option(
            parser=place, metavar="FILE", help="Swaps, oil changes; else events.toml beside them."
        ),
    ] = None,
    detector: Annotated[
        str, typer.Option(help="cusum, thesis, 3-sigma and others (docs/detection.md).")
    ] = "cusum",
    low_speed: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=10000.0,
            help="Where the low-speed part ends, rad/s; else a third of the fastest.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(parser=place, help="Folder for report.html and monitor.json.")
    ] = None,
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Keep what each recording came to.")
    ] = True,
    explain: Annotated[
        bool,
        typer.Option("--explain", help="Ask explain what an alarm is; half a minute a joint."),
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Write the result to stdout as JSON.")
    ] = False,
) -> None:
    """Tell wear from temperature, load and age over months of cycles; exit code 1 on an alarm."""
    from agent.cli.history.monitor import MonitorRequest, run_monitor

    request = MonitorRequest(
        history, baseline, events, detector, low_speed, cache, explain, tuple(siblings or ())
    )
    run_monitor(request, out, as_json=json)
