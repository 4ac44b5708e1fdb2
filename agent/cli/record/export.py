"""`stribeck export` and `stribeck import`: recordings to and from other programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import typer

from agent.cli.terminal.talk import talker
from agent.errors import UsageError
from agent.record.export import SUFFIXES, Format, export
from agent.record.importing.mapping import load_mapping
from agent.record.importing.studio import Joint, import_csv
from agent.record.reading import PARQUET, read
from agent.record.writing import write
from trajectories import lasting


def run_export(recording: str, kind: str, out: Path | None) -> None:
    """Write a recording in another format and print where.

    Raises
    ------
    agent.errors.InputError
        No such format, or the recording cannot be had in it.
    """
    known: dict[str, Format] = {name: name for name in get_args(Format)}
    if kind not in known:
        raise UsageError(f"There is no format {kind!r}; expected {' or '.join(known)}.")
    what = read(recording)
    path = out or Path(recording).with_suffix(SUFFIXES[kind])
    typer.echo(str(export(what, path, known[kind])))


def run_import(file: Path, mapping: str, joint: Joint, out: Path | None) -> None:
    """Read a drive studio's CSV and write it as a recording.

    Raises
    ------
    agent.errors.InputError
        From the mapping or the file, with the lines that are bad.
    """
    recording = import_csv(file, load_mapping(mapping), joint)
    path = write(recording, out or file.with_suffix(PARQUET))
    talker().print(
        f"{len(recording)} samples over {lasting(recording['time_s'][-1])}; columns "
        f"{', '.join(recording.columns)}."
    )
    if not recording.metadata.started_at:
        talker().print("The file does not say when it was recorded; histories need that.")
    typer.echo(str(path))


def parameters_of(pairs: Sequence[str]) -> dict[str, float]:
    """Return `NAME=NUMBER` arguments as a mapping.

    Raises
    ------
    agent.errors.InputError
        One is none.
    """
    found = {}
    for pair in pairs:
        name, equals, number = pair.partition("=")
        try:
            value = float(number)
        except ValueError as error:
            raise UsageError(f"--set expects NAME=NUMBER, got {pair!r}.") from error
        if not equals or not name.strip() or not math.isfinite(value):
            raise UsageError(f"--set expects NAME=NUMBER, got {pair!r}.")
        found[name.strip()] = value
    return found
