"""Makes a file of a recording in its own process: ``python -m agent.web.convert KIND FROM TO``.

The page stays small and quick beside it: what plots, or loads a whole recording, happens here.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Mapping
from pathlib import Path


def to_csv(recording: Path, out: Path) -> None:
    """Write the recording's columns as CSV; its metadata stand in the Parquet file."""
    from agent.record.formats import csv_file, parquet_file

    out.write_bytes(csv_file.to_bytes(parquet_file.read_table(recording, str(recording))))


def to_mdf4(recording: Path, out: Path) -> None:
    """Write the recording as MDF 4 with its units and metadata."""
    from agent.record.export import export
    from agent.record.reading import read

    out.unlink(missing_ok=True)  # an export replaces nothing; the page has made an empty file
    export(read(recording), out, "mdf4")


def to_pdf(recording: Path, out: Path) -> None:
    """Write the one-page report."""
    from agent.web.pdf import write_pdf

    write_pdf(recording, out)


KINDS: Mapping[str, Callable[[Path, Path], None]] = {
    "csv": to_csv,
    "mdf4": to_mdf4,
    "pdf": to_pdf,
}


def available() -> tuple[str, ...]:
    """Return the kinds that can be made with what is installed here."""
    there = importlib.util.find_spec("asammdf") is not None
    return tuple(kind for kind in KINDS if kind != "mdf4" or there)


def main() -> None:
    """Make one file; the exit code says whether it is there."""
    kind, recording, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    KINDS[kind](recording, out)


if __name__ == "__main__":
    main()
