"""How simulation and recordings are compared.

Heavy imports are inside the commands.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import Json, Recordings, place


def add_commands(app: typer.Typer) -> None:
    """Add the commands to the application, as `--help` lists them."""
    app.command(short_help="what a simulation leaves out: located, named, modelled, proven")(
        explain
    )
    app.command(short_help="a twin's torque beside a recording's own")(simulate)


def explain(
    twin: Annotated[
        Path, typer.Argument(parser=place, metavar="TWIN.toml", help="What the simulation knows.")
    ],
    recordings: Recordings,
    out: Annotated[
        Path, typer.Option(parser=place, help="Where report, explanation and extended twin go.")
    ],
    holdout: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="Prove it on these; repeatable."),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(
            parser=place, metavar="CELL.toml", help="Plan the next experiment within its limits."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Say where simulation and recordings differ, what physics is missing, and prove it."""
    from agent.cli.explain.explain import run_explain

    run_explain(twin, recordings, holdout or [], out, as_json=json, cell=cell)


def simulate(
    twin: Annotated[Path, typer.Argument(parser=place, metavar="TWIN.toml", help="The twin.")],
    recording: Annotated[str, typer.Argument(metavar="RECORDING", help="One recording.")],
    out: Annotated[
        Path, typer.Option(parser=place, help="The recording to write (.parquet or .csv).")
    ],
) -> None:
    """Add torque_simulated_nm: what the twin predicts for the recording's own motion."""
    from agent.cli.explain.simulate import run_simulate

    run_simulate(twin, recording, out)
