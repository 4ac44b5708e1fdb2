"""How `stribeck stop` is asked for. Heavy imports are inside."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import place


def add_commands(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(short_help="Stop test (not an E-stop): end a running cycle at rest")(stop)


def stop(
    cell: Annotated[
        Path | None,
        typer.Argument(parser=place, metavar="[CELL.toml]", help="Whose axis; else every one."),
    ] = None,
    axis: Annotated[int | None, typer.Option(help="Number of the axis.")] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say whom it would ask; ask nobody.")
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Write the result to stdout as JSON.")
    ] = False,
) -> None:
    """Stop test (not an E-stop): ask the cycle that owns an axis to come to rest, and wait.

    Needs no access to the bus: the running cycle itself stops its joint, measures the standstill,
    gives the drive back and keeps the recording.
    """
    from agent.cli.cycle.stop import stop as ask_to_stop

    ask_to_stop(cell, axis, dry_run=dry_run, as_json=json)
