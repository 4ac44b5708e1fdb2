"""How cycles are asked for: planned, driven, finished after a power cut.

Heavy imports are inside the commands.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import Json, place


def add_commands(app: typer.Typer) -> None:
    """Add the commands to the application, as `--help` lists them."""
    app.command(short_help="one cycle on a real axis, up to the verdict")(run)
    app.command(short_help="the best stair for the time there is")(plan)
    app.command(short_help="finish what a kill or power cut left")(recover)
    app.command("example-cell", short_help="an example CELL.toml, every key explained")(
        example_cell
    )


def run(
    cell: Annotated[
        Path, typer.Argument(parser=place, metavar="CELL.toml", help="The cell's description.")
    ],
    axis: Annotated[int, typer.Option(help="Number of the axis.")],
    out: Annotated[
        Path | None, typer.Option(parser=place, help="Where the files go; else the cell's folder.")
    ] = None,
    reverse: Annotated[
        bool, typer.Option("--reverse", help="Drive the reversed stair (validation run).")
    ] = False,
    trajectory: Annotated[
        Path | None,
        typer.Option(
            parser=place, metavar="PLAN.json", help="Drive this (`plan --out`), or `triangle`."
        ),
    ] = None,
    contour: Annotated[
        bool,
        typer.Option("--contour", help="Creep over the travel instead: is the way free, and even?"),
    ] = False,
    torque_nm: Annotated[
        float | None, typer.Option(help="Torque limit of --contour; else from what is expected.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would be driven; open no bus.")
    ] = False,
    json: Json = False,
) -> None:
    """Drive one cycle on a real axis: preflight, stair, recording, estimate, verdict."""
    from agent.cli.cycle.run import dry_run_axis, run_axis

    if torque_nm is not None and not contour:
        raise typer.BadParameter("--torque-nm belongs to --contour")
    if dry_run and json:
        raise typer.BadParameter("--dry-run says in words what would be driven: leave out --json")
    if contour:
        from agent.cli.cycle.contour import dry_run_contour, run_contour

        if reverse or trajectory is not None:
            raise typer.BadParameter("--contour drives its own way")
        if dry_run:
            dry_run_contour(cell, axis, torque_nm)
        else:
            run_contour(cell, axis, out, torque_nm, as_json=json)
    elif dry_run:
        dry_run_axis(cell, axis, reverse=reverse, trajectory_path=trajectory)
    else:
        run_axis(cell, axis, out, reverse=reverse, as_json=json, trajectory_path=trajectory)


def plan(
    cell: Annotated[
        Path, typer.Argument(parser=place, metavar="CELL.toml", help="The cell's description.")
    ],
    axis: Annotated[int, typer.Option(help="Number of the axis.")],
    seconds: Annotated[
        float | None,
        typer.Option(
            min=1.0, max=3600.0, help="How long the stair may last; not needed for --aliases."
        ),
    ] = None,
    out: Annotated[
        Path,
        typer.Option(
            parser=place, help="Folder for plan.json (for `run --trajectory`) and the picture."
        ),
    ] = Path("stribeck-plan"),
    noise_nm: Annotated[
        float,
        typer.Option(
            min=1e-9, max=1000.0, help="Torque noise to reckon with: white, and as much coloured."
        ),
    ] = 0.02,
    dwell_s: Annotated[
        float,
        typer.Option(
            min=0.02,
            max=3600.0,
            help="No speed is held for less; 0.7 and more where the arm is soft.",
        ),
    ] = 0.5,
    aliases: Annotated[
        bool,
        typer.Option(
            "--aliases",
            help="Say what the cycle cannot tell apart; without --seconds, the cell's own.",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Design the stair that tells most in the time there is; say what it can and cannot see."""
    from agent.cli.cycle.plan import run_plan

    run_plan(
        cell,
        axis,
        seconds,
        out,
        noise_nm=noise_nm,
        dwell_s=dwell_s,
        as_json=json,
        with_aliases=aliases,
    )


def recover(
    recordings: Annotated[
        list[str], typer.Argument(metavar="FOLDER|FILE...", help="Where a run was cut off.")
    ],
) -> None:
    """Finish the recordings that a kill or a power cut has left behind."""
    from agent.cli.cycle.recover import run_recover

    run_recover([place(name) for name in recordings])


def example_cell() -> None:
    """Print an example CELL.toml with every key explained; it is not commissioned."""
    from importlib.resources import files

    typer.echo(files("agent.examples").joinpath("cell.toml").read_text(encoding="utf-8"), nl=False)
