"""From a file, a folder or a glob to recordings: Parquet, CSV with its side file, Arrow stream.

What is read has been checked: needed columns in their units, at least 100 samples, increasing
time. NaN and infinite samples are kept, and the recording counts and masks them.
"""

from __future__ import annotations

import glob
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from agent.errors import InputError
from agent.record.recording import Metadata, Recording

if TYPE_CHECKING:
    import pyarrow as pa

PARQUET, CSV, STREAM = ".parquet", ".csv", ".arrows"


def read(path: str | Path) -> Recording:
    """Read one recording.

    Parameters
    ----------
    path : str or Path
        A Parquet file, a CSV file with its side file, or an Arrow IPC stream (``.arrows``), even
        one that is still being written or was never finished: every whole batch of it is read.

    Raises
    ------
    InputError
        One sentence with the file and, where there is one, the column and the row (the first row
        of data is row 1).
    """
    from agent.record import checks
    from agent.record.formats import arrow

    if not str(path).strip():
        raise _nameless()
    path = Path(path)
    where = str(path)
    try:
        table, metadata_text = _load(path, where)
    except OSError as error:
        raise InputError(f"{where}: cannot be read ({error.strerror or error}).") from error
    checks.check_names(table.column_names, where)
    columns = arrow.to_columns(table, where)
    checks.check(columns, where)
    if metadata_text is None:
        metadata = arrow.metadata_of(table, where)
    else:
        metadata = Metadata.loads(metadata_text, str(side_file(path)))
    return Recording(columns=columns, metadata=metadata, source=where)


def read_all(patterns: Sequence[str | Path]) -> tuple[Recording, ...]:
    """Read every recording that files, folders and globs name; see `find` for the order.

    Raises
    ------
    InputError
        From `find` or `read`.
    """
    return tuple(read(path) for path in find(patterns))


def find(patterns: Sequence[str | Path]) -> tuple[Path, ...]:
    """Return the files that files, folders and globs name, each once.

    The arguments keep their order; what one folder or glob names is sorted as people count
    (``run2`` before ``run10``). A folder is not searched below its first level (``**`` in a glob
    is). In folders and globs, files of other kinds are passed over, and of files that differ
    only in their suffix the Parquet file is preferred to its CSV export and its stream.

    Raises
    ------
    InputError
        When one of the arguments names nothing, saying what was looked for.
    """
    if not patterns:
        raise InputError("No recording was named.", "Name a file, a folder or a glob.")
    found: dict[Path, Path] = {}
    for pattern in patterns:
        for path in _expand(str(pattern)):
            found.setdefault(path.resolve(), path)
    return tuple(found.values())


def natural_key(path: Path) -> list[tuple[int, int, str]]:
    """Return a sort key under which numbers in names count as numbers."""
    parts = re.split(r"(\d+)", str(path).casefold())
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in parts if part]


def _load(path: Path, where: str) -> tuple[pa.Table, bytes | None]:
    """Return the table, and the side file's text for a format that needs one."""
    if path.is_dir():
        raise InputError(f"{where}: is a folder, not a recording.")
    if not path.exists():
        raise InputError(f"{where}: does not exist.")
    suffix = path.suffix.lower()
    if suffix == CSV:
        return _load_csv(path, where)
    if suffix == STREAM:
        from agent.record.streams import stream_file

        return stream_file.read_stream(path).table, None
    from agent.record.formats import parquet_file

    return parquet_file.read_table(path, where), None


def _load_csv(path: Path, where: str) -> tuple[pa.Table, bytes]:
    from agent.record.formats import csv_file

    if path.stat().st_size == 0:
        raise InputError(f"{where}: is empty (0 bytes).")
    table = csv_file.read_table(path, where)
    side = side_file(path)
    if not side.is_file():
        raise InputError(
            f"{where}: needs its side file {side.name} with the metadata (schema, robot, axis, "
            "gear_ratio), which is not there."
        )
    return table, side.read_bytes()


def _expand(pattern: str) -> list[Path]:
    """Return what one argument names, sorted."""
    if not pattern.strip():
        raise _nameless()
    path = Path(pattern)
    if path.is_dir():
        inside = _recordings(path.iterdir())
        if not inside:
            raise InputError(
                f"{pattern}: the folder holds no recording (looked for *{PARQUET}, *{CSV} with "
                f"its side file, *{STREAM})."
            )
        return inside
    if path.exists():
        return [path]
    if not glob.has_magic(pattern):
        raise InputError(f"{pattern}: does not exist.")
    # Path.glob would refuse the absolute patterns that a user may type
    matches = [Path(match) for match in glob.glob(pattern, recursive=True)]  # noqa: PTH207 - see above
    folders = [match for match in matches if match.is_dir()]
    inside = _recordings([*matches, *(p for folder in folders for p in folder.iterdir())])
    if not inside:
        raise InputError(
            f"{pattern}: matches no recording (looked for *{PARQUET}, *{CSV} with its side file, "
            f"*{STREAM})."
        )
    return inside


def _nameless() -> InputError:
    """Return the refusal of an empty name, as of a variable that was never set.

    A path that is empty would be the current folder, which nobody asked for.
    """
    return InputError("An empty name names no recording.", "The current folder is `.`.")


def _recordings(paths: Iterable[Path]) -> list[Path]:
    """Return those paths that look like recordings, one a name, sorted as people count."""
    best: dict[Path, Path] = {}
    ranks = {PARQUET: 0, STREAM: 1, CSV: 2}
    for path in paths:
        suffix = path.suffix.lower()
        if path.name.startswith(".") or suffix not in ranks or not path.is_file():
            continue
        if suffix == CSV and not side_file(path).is_file():
            continue
        key = path.with_suffix("")
        if key not in best or ranks[suffix] < ranks[best[key].suffix.lower()]:
            best[key] = path
    return sorted(best.values(), key=natural_key)


def side_file(path: Path) -> Path:
    """Return where the metadata of a CSV file stands."""
    return path.with_suffix(".json")
