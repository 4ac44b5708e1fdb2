"""How simulation and recordings are compared, and how that is proven.

Heavy imports are inside the commands.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.options import Json, Recordings


def add_commands(app: typer.Typer) -> None:
    """Add the commands to the application, as `--help` lists them."""
    app.command(short_help="what a simulation leaves out: located, named, modelled, proven")(
        explain
    )
    app.command(short_help="conceals effects, explains them blind, prints the score")(prove)
    app.command(short_help="a twin's torque beside a recording's own")(simulate)


def explain(
    twin: Annotated[Path, typer.Argument(metavar="TWIN.toml", help="What the simulation knows.")],
    recordings: Recordings,
    out: Annotated[Path, typer.Option(help="Where report, explanation and extended twin go.")],
    holdout: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="Prove it on these; repeatable."),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(metavar="CELL.toml", help="Plan the next experiment within its limits."),
    ] = None,
    json: Json = False,
) -> None:
    """Say where simulation and recordings differ, what physics is missing, and prove it."""
    from agent.cli.explain import run_explain

    run_explain(twin, recordings, holdout or [], out, as_json=json, cell=cell)


def prove(
    cases: Annotated[int, typer.Option(help="How many cases; 12 take about two minutes.")] = 12,
    seed: Annotated[
        int, typer.Option(help="First seed; below 10000 is for development and no score.")
    ] = 10000,
    full: Annotated[
        bool, typer.Option("--full", help="All 120 cases (docs/proof.md): a quarter of an hour.")
    ] = False,
    processes: Annotated[int, typer.Option(help="How many cases at a time.")] = 2,
    json: Json = False,
) -> None:
    """Conceal effects in simulated recordings, explain them blind, open the labels, score."""
    from agent.cli.prove import run_prove

    run_prove(cases, seed, full=full, processes=processes, as_json=json)


def simulate(
    twin: Annotated[Path, typer.Argument(metavar="TWIN.toml", help="The twin.")],
    recording: Annotated[str, typer.Argument(metavar="RECORDING", help="One recording.")],
    out: Annotated[Path, typer.Option(help="The recording to write (.parquet or .csv).")],
) -> None:
    """Add torque_simulated_nm: what the twin predicts for the recording's own motion."""
    from agent.cli.simulate import run_simulate

    run_simulate(twin, recording, out)
