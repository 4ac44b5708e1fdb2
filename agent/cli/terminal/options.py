"""What many commands ask for, in the same words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.errors import InputError, UsageError

PICTURES = (".svg", ".png")

Json = Annotated[bool, typer.Option("--json", help="Write the result to stdout as JSON.")]
Recordings = Annotated[
    list[str], typer.Argument(metavar="RECORDING...", help="Files, folders or globs.")
]


def place(name: str | Path) -> Path:
    """Return the folder or file that an argument names; an empty one would be the current folder.

    Raises
    ------
    agent.errors.InputError
        The name is empty, as of a variable that was never set.
    """
    if not str(name).strip():
        raise InputError("An empty name names no file or folder.", "The current folder is `.`.")
    return Path(name)


def _picture(name: str) -> Path:
    """Return the file that a picture goes to, known to be one before anything is computed for it.

    Raises
    ------
    agent.errors.UsageError
        Its name ends otherwise than in a kind of picture.
    """
    if Path(name).suffix.lower() not in PICTURES:
        raise UsageError(
            f"--picture: expected a name that ends in {' or '.join(PICTURES)}, got {name!r}."
        )
    return Path(name)


Picture = Annotated[
    Path | None,
    typer.Option(
        parser=_picture, metavar="FILE", help="Write the picture to this file (.svg or .png)."
    ),
]
