"""How explanations are proven. Heavy imports are inside the command."""

from __future__ import annotations

from typing import Annotated

import typer

from agent.cli.terminal.options import Json


def add_command(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(short_help="conceals effects, explains them blind, prints the score")(prove)


def prove(
    cases: Annotated[int, typer.Option(help="How many cases; 12 take about two minutes.")] = 12,
    seed: Annotated[
        int, typer.Option(help="First seed; below 10000 is for development and no score.")
    ] = 10000,
    full: Annotated[
        bool, typer.Option("--full", help="All 120 cases (docs/proof.md): up to 45 minutes.")
    ] = False,
    processes: Annotated[int, typer.Option(help="How many cases at a time.")] = 2,
    json: Json = False,
) -> None:
    """Conceal effects in simulated recordings, explain them blind, open the labels, score."""
    from agent.cli.prove.prove import run_prove

    run_prove(cases, seed, full=full, processes=processes, as_json=json)
