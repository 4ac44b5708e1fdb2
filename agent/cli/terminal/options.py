"""What many commands ask for, in the same words."""

from __future__ import annotations

from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Write the result to stdout as JSON.")]
Recordings = Annotated[
    list[str], typer.Argument(metavar="RECORDING...", help="Files, folders or globs.")
]
