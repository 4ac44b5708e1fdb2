"""`stribeck night install`: the units are shown first, and installed only when that was seen."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import typer

from agent.cli.night.asked import asked_for
from agent.cli.terminal.talk import talker
from agent.errors import InputError
from agent.night.units import Units, units
from agent.record.atomic import publish

SYSTEM = Path("/etc/systemd/system")


def run_install(
    cell_path: Path, night_file: Path | None, *, show: bool, folder: Path | None
) -> None:
    """Show the units; install them where `show` is not asked for and the person agrees.

    Raises
    ------
    agent.errors.InputError
        The cell or its night cannot be used, or systemd refuses.
    """
    asked = asked_for(cell_path, night_file)
    made = units(
        asked.cell.robot,
        asked.description,
        asked.path.resolve(),
        asked.night_file.resolve(),
        _program(),
    )
    place = folder or SYSTEM
    for path, text in made.files(place).items():
        typer.echo(f"# {path}\n{text}")
    if show:
        talker().print("Nothing was installed. Leave --show out to install these two files.")
        return
    typer.confirm("Install these two files and start the timer?", abort=True, err=True)
    publish({path: text.encode() for path, text in made.files(place).items()}, overwrite=True)
    if folder is None:
        _start(made)
    else:
        talker().print(f"Written to {folder}; systemd was told nothing.")


def _program() -> Path:
    """Return this product's command, as the service shall call it."""
    beside = Path(sys.executable).with_name("stribeck")
    found = str(beside) if beside.exists() else shutil.which("stribeck")
    if found is None:
        raise InputError("The command `stribeck` is not on the PATH, so no service can call it.")
    return Path(found)


def _start(made: Units) -> None:
    for command in (["daemon-reload"], ["enable", "--now", f"{made.name}.timer"]):
        try:
            subprocess.run(["systemctl", *command], check=True)
        except (OSError, subprocess.CalledProcessError) as error:
            raise InputError(
                f"The files are written, but systemctl {' '.join(command)} failed: {error}.",
                "Without systemd, let `stribeck night CELL.toml` run.",
            ) from error
    talker().print(f"`systemctl list-timers {made.name}.timer` says when it runs next.")
