"""A folder's files as the catalogue's rows: of one recording, or of everything below the folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from agent.errors import InputError
from agent.record.catalogue.rows import (
    EstimateRow,
    RecordingRow,
    VerdictRow,
    estimate_row,
    recording_row,
    relative,
    verdict_row,
)
from agent.record.reading import CSV, PARQUET, natural_key, side_file
from agent.record.verdict_file import ESTIMATE_SUFFIX as ESTIMATE
from agent.record.verdict_file import SUFFIX as VERDICT
from agent.record.verdict_file import estimate_path, verdict_path

Row = TypeVar("Row", RecordingRow, EstimateRow, VerdictRow)


@dataclass(frozen=True)
class Files:
    """The rows of files, and a sentence for every file that could not be taken."""

    recordings: tuple[RecordingRow, ...] = ()
    estimates: tuple[EstimateRow, ...] = ()
    verdicts: tuple[VerdictRow, ...] = ()
    problems: tuple[str, ...] = ()


def beside(file: Path, folder: Path) -> Files:
    """Return the rows of one recording, its estimate and its verdict; a bad file raises."""
    recording = recording_row(file, folder)
    estimate, verdict = estimate_path(file), verdict_path(file)
    return Files(
        (recording,),
        (estimate_row(estimate, recording, folder),) if estimate.exists() else (),
        (verdict_row(verdict, folder),) if verdict.exists() else (),
    )


def everything(folder: Path) -> Files:
    """Return the rows of every file below a folder."""
    problems: list[str] = []
    recordings = _taken(lambda f: recording_row(f, folder), recordings_below(folder), problems)
    verdicts = _taken(lambda f: verdict_row(f, folder), _files(folder, VERDICT), problems)
    # the recording, or what retention has left of it
    owners: dict[str, RecordingRow | VerdictRow] = {
        row.path.removesuffix(VERDICT): row for row in verdicts
    }
    owners |= {Path(row.path).with_suffix("").as_posix(): row for row in recordings}

    def of(file: Path) -> EstimateRow:
        owner = owners.get(relative(file, folder).removesuffix(ESTIMATE))
        if owner is None:
            raise InputError(f"{file}: the recording that it belongs to is not there.")
        return estimate_row(file, owner, folder)

    estimates = _taken(of, _files(folder, ESTIMATE), problems)
    return Files(tuple(recordings), tuple(estimates), tuple(verdicts), tuple(problems))


def _taken(make: Callable[[Path], Row], files: Iterable[Path], problems: list[str]) -> list[Row]:
    """Return a row for each file that can be read; the others' reasons go to `problems`."""
    rows = []
    for file in files:
        try:
            rows.append(make(file))
        except InputError as error:
            problems.append(str(error))
    return rows


def recordings_below(folder: Path) -> tuple[Path, ...]:
    """Return the files below a folder that look like finished recordings, sorted as people count.

    A CSV file is one when its side file is there and no Parquet file has its name; hidden files
    and folders are passed over.
    """
    parquet = {file.with_suffix(""): file for file in _files(folder, PARQUET)}
    others = [
        file
        for file in _files(folder, CSV)
        if file.with_suffix("") not in parquet and side_file(file).is_file()
    ]
    return tuple(sorted([*parquet.values(), *others], key=natural_key))


def _files(folder: Path, suffix: str) -> list[Path]:
    """Return the visible files below a folder whose names end so, sorted as people count."""
    found = [
        path
        for path in folder.rglob(f"*{suffix}")
        if path.is_file()
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    ]
    return sorted(found, key=natural_key)
