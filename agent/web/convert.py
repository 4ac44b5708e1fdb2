"""Makes a file of a recording in its own process: ``python -m agent.web.convert KIND FROM TO``.

The page stays small and quick beside it: what plots, or loads a whole recording, happens here.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Mapping
from pathlib import Path


def to_csv(recording: Path, out: Path) -> None:
    """Write the recording as CSV; its metadata stand in the Parquet file and in the estimate."""
    from agent.record import csv_file, parquet_file

    out.write_bytes(csv_file.to_bytes(parquet_file.read_table(recording, str(recording))))


KINDS: Mapping[str, Callable[[Path, Path], None]] = {"csv": to_csv}


def available() -> tuple[str, ...]:
    """Return the kinds that can be made with what is installed here."""
    return tuple(kind for kind in KINDS if kind != "mdf4" or importlib.util.find_spec("asammdf"))


def main() -> None:
    """Make one file; the exit code says whether it is there."""
    kind, recording, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    KINDS[kind](recording, out)


if __name__ == "__main__":
    main()
