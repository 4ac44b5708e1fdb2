"""The commands. Heavy imports are inside them, so that `--help` is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.cycle.commands import add_commands as add_cycle_commands
from agent.cli.cycle.stop_command import add_commands as add_stop_command
from agent.cli.devices.commands import add_commands as add_device_commands
from agent.cli.explain.commands import add_commands as add_explain_commands
from agent.cli.fleet.commands import fleet_app
from agent.cli.history.commands import add_commands as add_history_commands
from agent.cli.history.monitor_command import add_commands as add_monitor_command
from agent.cli.identify.commands import add_commands as add_identify_commands
from agent.cli.night.commands import add_commands as add_night_commands
from agent.cli.page.commands import add_commands as add_page_commands
from agent.cli.prove.commands import add_command as add_prove_command
from agent.cli.record.commands import add_commands as add_record_commands
from agent.cli.terminal.options import place

app = typer.Typer(
    name="stribeck",
    help="Friction of industrial robot joints: drive the stair, record, estimate, explain.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
)


def _tell_version(asked: bool) -> None:
    """Print which version this is, as every recording has it, and end."""
    if asked:
        from importlib.metadata import version

        typer.echo(f"stribeck {version('stribeck')}")
        raise typer.Exit


@app.callback()
def options(
    debug: Annotated[bool, typer.Option("--debug", help="Show a traceback on errors.")] = False,
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", callback=_tell_version, is_eager=True),
    ] = False,
) -> None:
    """Friction of industrial robot joints: drive the stair, record, estimate, explain."""


@app.command(short_help="the whole story on a simulated joint, no hardware")
def demo(
    out: Annotated[Path, typer.Option(parser=place, help="Where the files go.")] = Path(
        "stribeck-demo"
    ),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated robot.")] = 1,
) -> None:
    """Show the whole story on a simulated robot joint on a virtual CAN bus; no hardware."""
    from agent.cli.demo.demo import run_demo

    run_demo(out, seed)


add_cycle_commands(app)
add_identify_commands(app)
add_explain_commands(app)
add_prove_command(app)
add_device_commands(app)
add_history_commands(app)
add_monitor_command(app)
add_stop_command(app)
add_page_commands(app)
add_record_commands(app)
app.add_typer(fleet_app, short_help="recordings of many robots, on one machine or many")
add_night_commands(app)
