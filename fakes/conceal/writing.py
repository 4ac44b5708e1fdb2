"""A case on disk, as a user would have it: recordings, hold-outs and a twin. Never the label."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fakes.conceal.case import ConcealedCase, ConcealedRun

Writer = Callable[[ConcealedRun, Path], Path]
"""Writes one run beside the path given, which has no suffix, and returns the file's path."""


@dataclass(frozen=True)
class WrittenCase:
    """Where the files of a case are."""

    twin: Path
    training: tuple[Path, ...]
    holdout: tuple[Path, ...]


def write_case(case: ConcealedCase, folder: Path, writer: Writer | None = None) -> WrittenCase:
    """Write a case: ``twin.toml``, ``training/run-01.csv`` and so on, ``holdout/run-08.csv``.

    Parameters
    ----------
    case : ConcealedCase
        The case.
    folder : Path
        Where to; it is made.
    writer : callable, optional
        Writes one run in another format (Parquet, say); without it, CSV and JSON as in contract
        section 2.
    """
    write = writer or write_csv
    written: dict[str, list[Path]] = {"training": [], "holdout": []}
    for run in case.runs:
        part = "holdout" if run.is_holdout else "training"
        (folder / part).mkdir(parents=True, exist_ok=True)
        written[part].append(write(run, folder / part / run.name))
    twin = folder / "twin.toml"
    twin.write_text(case.twin_toml, encoding="utf-8")
    return WrittenCase(twin, tuple(written["training"]), tuple(written["holdout"]))


def write_csv(run: ConcealedRun, stem: Path) -> Path:
    """Write one run as ``<stem>.csv`` with its metadata in ``<stem>.json``."""
    text = [
        (f'"{v}"' for v in values) if values.dtype.kind == "U" else (f"{v:.9g}" for v in values)
        for values in (np.asarray(column) for column in run.columns.values())
    ]
    path = stem.with_suffix(".csv")
    lines = [",".join(run.columns), *map(",".join, zip(*text, strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    document = json.dumps(run.metadata, indent=2, allow_nan=False)
    stem.with_suffix(".json").write_text(document, encoding="utf-8")
    return path
