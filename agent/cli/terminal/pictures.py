"""A picture that a command was asked for with `--picture`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from agent.cli.terminal.talk import talker

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_picture(path: Path, figure: Figure) -> None:
    """Write a figure as the file's name asks, SVG or PNG."""
    import io

    from agent.record.atomic import publish

    buffer = io.BytesIO()
    figure.savefig(buffer, format=path.suffix.lower().removeprefix("."))
    publish({path: buffer.getvalue()}, overwrite=True)
    talker().print(f"The picture is in {path}.")
