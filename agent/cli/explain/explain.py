"""`stribeck explain`: where a simulation and recordings differ, what that is, what it is worth."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

import typer

from agent.cli.explain.simulate import read_twin
from agent.cli.identify.twin_file import check_twin_place
from agent.cli.terminal.talk import talker
from agent.conclude.comparable import check_recordings
from agent.conclude.explanation import explained
from agent.errors import InputError
from agent.explain.answer.result import Explanation
from agent.physics.twin import Twin, format_twin
from agent.record.atomic import check_folder, make_folder, publish
from agent.record.reading import read_all
from agent.record.recording import Recording
from trajectories import AxisLimits

NEXT_FILE = "next-experiment.json"
TWIN_FILE = "twin.toml"


def run_explain(
    twin_path: Path,
    patterns: Sequence[str],
    holdout: Sequence[str],
    out: Path,
    *,
    as_json: bool,
    cell: Path | None = None,
) -> None:
    """Explain recordings, write explanation.json, twin.toml and report.html, print the answer.

    Raises
    ------
    agent.errors.InputError
        Twin or recordings cannot be used, are not of one axis, or a hold-out is among the
        recordings to learn from.
    agent.errors.StorageError
        `out` holds the twin given as its twin.toml, or one that a person wrote.
    """
    twin = read_twin(twin_path)
    check_twin_place(out / TWIN_FILE, twin_path)
    check_folder(out)
    recordings = read_all(patterns)
    unseen = read_all(holdout) if holdout else ()
    check_recordings(twin, twin_path, recordings, unseen)
    count = f"{len(recordings)} recording{'s' * (len(recordings) != 1)}"
    talker().print(f"Explaining {count}, {len(unseen)} held out ...")
    limits = None if cell is None else limits_of(cell, twin)
    found = explained(twin, twin_path, recordings, unseen, limits)
    write_explanation(out, found, twin, recordings)
    if as_json:
        typer.echo(json.dumps(found.to_json(), indent=2))
        return
    from agent.cli.explain.text import explanation_text

    next_file = str(out / NEXT_FILE) if _has_next(found) else ""
    typer.echo(explanation_text(found, axis=twin.axis, next_file=next_file))
    learnt = "extended twin" if found.twin is not None else "twin as given (nothing was learnt)"
    talker().print(f"Open {out / 'report.html'}; the {learnt} is {out / 'twin.toml'}.")


def limits_of(cell_path: Path, twin: Twin) -> AxisLimits:
    """Return what a cell allows the twin's axis, for the next experiment to be planned within.

    Raises
    ------
    agent.errors.InputError
        The cell has no such axis, or one with another gear.
    """
    from agent.cell.cell import read_cell

    axis = read_cell(cell_path).axis_numbered(twin.axis)
    if not math.isclose(axis.gear_ratio, twin.gear_ratio, rel_tol=1e-6):
        raise InputError(
            f"{cell_path}: axis {twin.axis} has gear ratio {axis.gear_ratio:g}, the twin "
            f"{twin.gear_ratio:g}.",
            "Give the cell that the recordings were driven in.",
        )
    return axis.motor_limits


def _has_next(found: Explanation) -> bool:
    return found.next_experiment is not None and found.next_experiment.trajectory is not None


def write_explanation(
    out: Path, found: Explanation, twin: Twin, recordings: Sequence[Recording]
) -> None:
    """Write everything into a folder; what was there under these names is replaced."""
    from agent.report.explanation.page import write_explanation_page

    make_folder(out)
    files = {
        out / "explanation.json": json.dumps(found.to_json(), indent=2).encode(),
        out / TWIN_FILE: format_twin(found.twin or twin).encode(),
    }
    following = found.next_experiment
    next_file = ""
    if following is not None and following.trajectory is not None:
        files[out / NEXT_FILE] = json.dumps(dict(following.trajectory), indent=2).encode()
        next_file = str(out / NEXT_FILE)
    else:
        # An earlier explanation's experiment would be driven for this one.
        (out / NEXT_FILE).unlink(missing_ok=True)
    publish(files, overwrite=True)
    about = recordings[0].metadata
    write_explanation_page(
        out / "report.html",
        found,
        robot=about.robot,
        axis=about.axis,
        next_file=next_file,
        metadata=about.to_json(),
    )
