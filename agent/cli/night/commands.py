"""The night's commands: parse and call. Heavy imports are inside them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from agent.cli.terminal.options import place

Cell = Annotated[
    Path, typer.Argument(parser=place, metavar="CELL.toml", help="The cell's description.")
]
NightFile = Annotated[
    Path | None,
    typer.Option(
        "--night",
        parser=place,
        metavar="FILE",
        help="The night's description; else CELL.night.toml.",
    ),
]


class _CellFirst(TyperGroup):
    """A group whose first word may be a cell: `stribeck night CELL.toml` is `... run ...`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and not args[0].startswith("-") and args[0] not in self.commands:
            args = ["run", *args]
        return super().parse_args(ctx, args)


night = typer.Typer(
    name="night",
    cls=_CellFirst,
    help="Nightly cycles in quiet windows: `stribeck night CELL.toml` watches over them.",
    no_args_is_help=True,
)


@night.command(short_help="watch over the nights (the default)")
def run(
    cell: Cell,
    night_file: NightFile = None,
    catalogue: Annotated[
        str | None, typer.Option(metavar="URL", help="As for `stribeck catalogue`.")
    ] = None,
    once: Annotated[
        bool, typer.Option("--once", help="Do what the windows open now ask for, then end.")
    ] = False,
) -> None:
    """Run each axis once in its quiet window; what was missed is said and not caught up."""
    from agent.cli.night.night import run_night

    run_night(cell, night_file, catalogue, once=once)


@night.command(short_help="the windows of the coming week")
def plan(
    cell: Cell,
    night_file: NightFile = None,
    json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
) -> None:
    """Print when the axes would run, and what would keep them from it now; nothing moves."""
    from agent.cli.night.night import show_plan

    show_plan(cell, night_file, as_json=json)


@night.command(short_help="units for systemd, shown first")
def install(
    cell: Cell,
    night_file: NightFile = None,
    show: Annotated[bool, typer.Option("--show", help="Show the units, install nothing.")] = False,
    folder: Annotated[
        Path | None,
        typer.Option(parser=place, help="Write the units here, and tell systemd nothing."),
    ] = None,
) -> None:
    """Show the timer and the service, ask, and install them."""
    from agent.cli.night.install import run_install

    run_install(cell, night_file, show=show, folder=folder)


@night.command(short_help="an example of the night's file, every key explained")
def example() -> None:
    """Print an example CELL.night.toml with every key explained."""
    from importlib.resources import files

    text = files("agent.examples").joinpath("cell.night.toml").read_text(encoding="utf-8")
    typer.echo(text, nl=False)


def notify(
    cell: Cell,
    night_file: NightFile = None,
) -> None:
    """Send a test message to everybody whom the night would tell, and say who got it."""
    from agent.cli.night.notify import run_notify

    run_notify(cell, night_file)


def add_commands(app: typer.Typer) -> None:
    """Add these commands to the command line."""
    app.add_typer(night, short_help="cycles in quiet windows, by themselves")
    app.command(short_help="a test message to whom the night would tell")(notify)
