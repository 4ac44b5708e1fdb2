"""Where a twin may be written: what a person wrote, and what was asked about, is never replaced."""

from __future__ import annotations

from pathlib import Path

from agent.errors import StorageError
from agent.physics.twin import TwinError, format_twin, parse_twin


def check_twin_place(path: Path, given: Path | None = None) -> None:
    """Refuse a name under which something is lost if a twin is written there.

    An empty file may be replaced, and a twin as `format_twin` writes it: that holds no comment, and
    the command that made it makes it again. Any other file stays.

    Parameters
    ----------
    path : Path
        The file to be written; free, or a file.
    given : Path, optional
        The twin that the command reads, which it does not replace either.

    Raises
    ------
    StorageError
        The file is the twin given, or was not written by stribeck as it stands.
    """
    if not path.is_file():
        return  # devices, pipes and folders are refused by whoever writes
    if given is not None and given.exists() and path.samefile(given):
        raise StorageError(
            f"{path} is the simulation to be explained, and the extended one would replace it.",
            "Name another folder.",
        )
    try:
        text = path.read_bytes().decode()
        ours = not text or format_twin(parse_twin(text)) == text
    except (OSError, UnicodeDecodeError, TwinError):
        ours = False
    if not ours:
        raise StorageError(
            f"{path} was not written by stribeck as it stands, and is not overwritten.",
            "Choose another name, or move that file away.",
        )
