"""What many commands ask for, in the same words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.errors import InputError

Json = Annotated[bool, typer.Option("--json", help="Write the result to stdout as JSON.")]
Recordings = Annotated[
    list[str], typer.Argument(metavar="RECORDING...", help="Files, folders or globs.")
]


def place(name: str) -> Path:
    """Return the folder or file that an argument names; an empty one would be the current folder.

    Raises
    ------
    agent.errors.InputError
        The name is empty, as of a variable that was never set.
    """
    if not name.strip():
        raise InputError("An empty name names no folder.", "The current folder is `.`.")
    return Path(name)
