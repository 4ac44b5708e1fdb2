"""The record's commands: parse and call. Heavy imports are inside them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="A folder of recordings.")]
Url = Annotated[
    str | None,
    typer.Option(
        "--catalogue",
        metavar="URL",
        help="sqlite:///FILE or postgresql://...; else STRIBECK_CATALOGUE, else in the folder.",
    ),
]
Recordings = Annotated[
    list[str], typer.Argument(metavar="RECORDING...", help="Files, folders or globs.")
]
Json = Annotated[bool, typer.Option("--json", help="Write the result to stdout as JSON.")]

catalogue = typer.Typer(
    name="catalogue",
    help="What recordings, estimates, verdicts and events there are; files are the truth.",
    no_args_is_help=True,
)


@catalogue.command(short_help="seal recordings and take them in")
def add(
    recordings: Recordings,
    folder: Annotated[
        Path | None, typer.Option(help="Whose catalogue; else each recording's own folder.")
    ] = None,
    url: Url = None,
) -> None:
    """Write each recording's content hash beside it, protect it, and take it in."""
    from agent.cli.catalogue import run_add

    run_add(recordings, folder, url)


@catalogue.command("list", short_help="recordings with their verdicts")
def list_(
    folder: Folder,
    robot: Annotated[str | None, typer.Option(help="Of this robot only.")] = None,
    axis: Annotated[int | None, typer.Option(help="Of this axis only.")] = None,
    newest: Annotated[int | None, typer.Option(min=1, help="Not more than so many.")] = None,
    url: Url = None,
    json: Json = False,
) -> None:
    """List what the catalogue holds, oldest first."""
    from agent.cli.catalogue import run_list

    run_list(folder, robot, axis, newest, url, as_json=json)


@catalogue.command(short_help="make the catalogue again from the files")
def rebuild(folder: Folder, url: Url = None) -> None:
    """Make the catalogue of a folder again from its files."""
    from agent.cli.catalogue import run_rebuild

    run_rebuild(folder, url)


@catalogue.command(short_help="bring an older catalogue to this version")
def upgrade(folder: Folder, url: Url = None) -> None:
    """Bring an older catalogue to this version's tables; opening one does the same."""
    from agent.cli.catalogue import run_upgrade

    run_upgrade(folder, url)


@catalogue.command(short_help="what may go by age or size; a dry run first")
def retain(
    folder: Folder,
    days: Annotated[float | None, typer.Option(min=0.0, help="Keep so many days.")] = None,
    max_mb: Annotated[float | None, typer.Option(min=0.0, help="Keep so many megabytes.")] = None,
    apply: Annotated[bool, typer.Option("--apply", help="Remove them; else say only.")] = False,
    url: Url = None,
) -> None:
    """Say which recordings may go; never those of an alarm or a baseline."""
    from agent.cli.catalogue import run_retain

    run_retain(folder, days, max_mb, url, apply=apply)


def verify(
    folder: Folder,
    recompute: Annotated[
        bool, typer.Option("--recompute", help="Compute each verdict again and compare.")
    ] = False,
    json: Json = False,
) -> None:
    """Check every recording against its content hash, and every verdict against its recording."""
    from agent.cli.catalogue import run_verify

    run_verify(folder, recompute=recompute, as_json=json)


def add_commands(app: typer.Typer) -> None:
    """Add these commands to the command line."""
    app.add_typer(catalogue, short_help="what recordings and verdicts there are")
    app.command(short_help="are the recordings what was recorded?")(verify)
