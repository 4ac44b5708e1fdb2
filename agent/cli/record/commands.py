"""The record's commands: parse and call. Heavy imports are inside them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import Json, Recordings, place

Folder = Annotated[
    Path, typer.Argument(metavar="FOLDER", parser=place, help="A folder of recordings.")
]
Url = Annotated[
    str | None,
    typer.Option(
        "--catalogue",
        metavar="URL",
        help="sqlite:///FILE or postgresql://...; else STRIBECK_CATALOGUE, else in the folder.",
    ),
]

catalogue = typer.Typer(
    name="catalogue",
    help="What recordings, estimates, verdicts and events there are; files are the truth.",
    no_args_is_help=True,
)


@catalogue.command(short_help="seal recordings and take them in")
def add(
    recordings: Recordings,
    folder: Annotated[
        Path | None,
        typer.Option(parser=place, help="Whose catalogue; else each recording's own folder."),
    ] = None,
    url: Url = None,
) -> None:
    """Write each recording's content hash beside it, protect it, and take it in."""
    from agent.cli.record.catalogue import run_add

    run_add(recordings, folder, url)


@catalogue.command("list", short_help="recordings with their verdicts")
def list_(
    folder: Folder,
    robot: Annotated[str | None, typer.Option(help="Of this robot only.")] = None,
    axis: Annotated[int | None, typer.Option(help="Of this axis only.")] = None,
    newest: Annotated[
        int | None, typer.Option(min=1, max=1_000_000_000, help="Not more than so many.")
    ] = None,
    url: Url = None,
    json: Json = False,
) -> None:
    """List what the catalogue holds, oldest first."""
    from agent.cli.record.catalogue import run_list

    run_list(folder, robot, axis, newest, url, as_json=json)


@catalogue.command(short_help="make the catalogue again from the files")
def rebuild(folder: Folder, url: Url = None) -> None:
    """Make the catalogue of a folder again from its files."""
    from agent.cli.record.catalogue import run_rebuild

    run_rebuild(folder, url)


@catalogue.command(short_help="bring an older catalogue to this version")
def upgrade(folder: Folder, url: Url = None) -> None:
    """Bring an older catalogue to this version's tables; opening one does the same."""
    from agent.cli.record.catalogue import run_upgrade

    run_upgrade(folder, url)


@catalogue.command(short_help="what may go by age or size; a dry run first")
def retain(
    folder: Folder,
    days: Annotated[
        float | None, typer.Option(min=0.0, max=100000.0, help="Keep so many days.")
    ] = None,
    max_mb: Annotated[
        float | None, typer.Option(min=0.0, max=1e12, help="Keep so many megabytes.")
    ] = None,
    apply: Annotated[bool, typer.Option("--apply", help="Remove them; else say only.")] = False,
    url: Url = None,
) -> None:
    """Say which recordings may go; never those of an alarm or a baseline."""
    from agent.cli.record.catalogue import run_retain

    run_retain(folder, days, max_mb, url, apply=apply)


@catalogue.command(short_help="write down a swap, an oil change, anything")
def note(
    folder: Folder,
    kind: Annotated[str, typer.Argument(help="swap, oil, relubrication, or a word of your own.")],
    text: Annotated[str, typer.Argument(help="One sentence.")],
    robot: Annotated[str, typer.Option(help="Whose.")],
    axis: Annotated[int | None, typer.Option(help="Which axis; else the whole robot.")] = None,
    at: Annotated[str, typer.Option(help="When, ISO 8601; else now.")] = "",
    by: Annotated[str, typer.Option(help="Who did it.")] = "",
    url: Url = None,
) -> None:
    """Append an event to the folder's events; a swap or an oil change begins a new baseline."""
    from agent.cli.record.catalogue import run_note

    run_note(folder, kind, text, robot, axis, at, by, url)


def verify(
    folder: Folder,
    recompute: Annotated[
        bool, typer.Option("--recompute", help="Compute each verdict again and compare.")
    ] = False,
    json: Json = False,
) -> None:
    """Check every recording against its content hash, and every verdict against its recording."""
    from agent.cli.record.catalogue import run_verify

    run_verify(folder, recompute=recompute, as_json=json)


def export(
    recording: Annotated[str, typer.Argument(metavar="RECORDING", help="One recording.")],
    kind: Annotated[str, typer.Option("--format", help="csv or mdf4.")] = "csv",
    out: Annotated[
        Path | None, typer.Option(parser=place, help="The file; else beside the recording.")
    ] = None,
) -> None:
    """Write a recording as CSV with its side file, or as MDF 4, with units."""
    from agent.cli.record.export import run_export

    run_export(recording, kind, out)


def import_(
    file: Annotated[
        Path, typer.Argument(parser=place, metavar="FILE.csv", help="As the studio has saved it.")
    ],
    robot: Annotated[str, typer.Option(help="Whose joint.")],
    axis: Annotated[int, typer.Option(help="Number of the axis.")],
    gear_ratio: Annotated[float, typer.Option(min=1.0, max=1e6, help="Motor turns per arm turn.")],
    mapping: Annotated[
        str, typer.Option(help="A shipped mapping, or MAPPING.toml (docs/record.md).")
    ] = "epos-studio",
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=NUMBER", help="What the mapping asks for; repeatable."),
    ] = None,
    time_zone: Annotated[
        str, typer.Option(help="Of the studio's computer, such as Europe/Berlin.")
    ] = "UTC",
    payload_kg: Annotated[
        float | None, typer.Option(min=0.0, max=1e6, help="What the arm carried, kg.")
    ] = None,
    notes: Annotated[str, typer.Option(help="Anything a reader should know.")] = "",
    out: Annotated[
        Path | None, typer.Option(parser=place, help="The recording; else FILE.parquet beside it.")
    ] = None,
) -> None:
    """Read a drive studio's CSV through a mapping; bad lines are named, nothing is guessed."""
    from agent.cli.record.export import parameters_of, run_import
    from agent.record.importing.studio import Joint

    parameters = parameters_of(set_ or [])
    joint = Joint(robot, axis, gear_ratio, parameters, time_zone, payload_kg, notes)
    run_import(file, mapping, joint, out)


def add_commands(app: typer.Typer) -> None:
    """Add these commands to the command line."""
    app.add_typer(catalogue, short_help="what recordings and verdicts there are")
    app.command(short_help="are the recordings what was recorded?")(verify)
    app.command(short_help="a recording as CSV or MDF 4")(export)
    app.command("import", short_help="a drive studio's CSV as a recording")(import_)
