"""A picture that a command was asked for with `--picture`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from agent.cli.terminal.talk import talker
from agent.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_picture(path: Path, figure: Figure) -> None:
    """Write a figure as the file's name asks, SVG or PNG.

    Raises
    ------
    agent.errors.InputError
        The name ends otherwise.
    """
    import io

    from agent.record.atomic import publish

    kind = path.suffix.lower().removeprefix(".")
    if kind not in {"svg", "png"}:
        raise InputError(f"--picture: expected a name that ends in .svg or .png, got {path}.")
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind)
    publish({path: buffer.getvalue()}, overwrite=True)
    talker().print(f"The picture is in {path}.")
