"""`stribeck catalogue` and `stribeck verify`: what a folder holds, and whether it still does."""

from __future__ import annotations

import datetime
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import typer

from agent.cli.terminal.exits import BAD_NEWS
from agent.cli.terminal.talk import talker
from agent.errors import InputError, UsageError
from agent.night.description import KINDS
from agent.record.catalogue.catalogue import Catalogue, RecordingRow, VerdictRow
from agent.record.catalogue.files import everything
from agent.record.catalogue.rows import in_utc
from agent.record.catalogue.schema import catalogue_url, is_there, shown
from agent.record.events_file import Event
from agent.record.reading import find
from agent.record.retention import MEGABYTE, Limits, apply_retention, plan_retention
from agent.record.verify import verify
from drivers.clock import wall_time_utc
from trajectories import lasting


def run_add(patterns: Sequence[str], folder: Path | None, url: str | None) -> None:
    """Seal recordings and take them into the catalogue; print their content hashes."""
    from agent.cli.record.keep import take

    if folder is not None:
        _insist(folder)
    for path in find(patterns):
        row = take(path, url, folder)
        typer.echo(f"{row.sha256}  {path}")


def run_list(
    folder: Path,
    robot: str | None,
    axis: int | None,
    newest: int | None,
    url: str | None,
    *,
    as_json: bool,
) -> None:
    """Print recordings with their newest verdict, oldest first.

    Raises
    ------
    agent.errors.InputError
        There is no catalogue: who reads makes none.
    """
    _insist_on_catalogue(folder, url)
    with Catalogue(folder, url) as catalogue:
        rows = catalogue.recordings(robot=robot, axis=axis, newest=newest)
        verdicts = {v.recording_sha256: v for v in catalogue.verdicts(robot=robot, axis=axis)}
    if as_json:
        document = [
            {**asdict(row), "verdict": asdict(v) if (v := verdicts.get(row.sha256)) else None}
            for row in rows
        ]
        typer.echo(json.dumps(document, indent=2))
        return
    for row in rows:
        typer.echo(_line(row, verdicts.get(row.sha256)))
    if not rows:
        whose = "" if robot is None else f" of {robot}"
        which = "" if axis is None else f"{'' if whose else ' of'} axis {axis}"
        talker().print(
            f"No recording{whose}{which} is in the catalogue; `stribeck catalogue rebuild` looks "
            "anew."
        )


def _line(row: RecordingRow, verdict: VerdictRow | None) -> str:
    warmth = row.gearbox_temperature_degc
    degrees = "" if warmth is None else f", {warmth:.1f} degC"
    says = "no verdict" if verdict is None else ("ALARM: " if verdict.alarm else "")
    says += "" if verdict is None else verdict.sentence
    return (
        f"{row.sha256[:12]}  {row.started_at or 'undated':<24}  {row.robot} axis {row.axis}  "
        f"{lasting(row.duration_s)}{degrees}  {row.path}\n              {says}"
    )


def run_rebuild(folder: Path, url: str | None) -> None:
    """Make the catalogue again from the folder's files.

    Raises
    ------
    agent.errors.InputError
        Where a file could not be taken; everything else was, first.
    """
    _insist(folder)
    with Catalogue(folder, url) as catalogue:
        built = catalogue.rebuild()
    typer.echo(
        f"{built.recordings} recordings, {built.estimates} estimates, {built.verdicts} verdicts, "
        f"{built.events} events."
    )
    for problem in built.problems:
        talker().print(problem)
    if built.problems:
        raise InputError(f"{len(built.problems)} files could not be taken (see above).")


def run_upgrade(folder: Path, url: str | None) -> None:
    """Bring the catalogue to this version's tables, and say from where to where.

    Raises
    ------
    agent.errors.InputError
        There is no catalogue.
    """
    _insist_on_catalogue(folder, url)
    with Catalogue(folder, url) as catalogue:
        before, now = catalogue.upgraded
    name = shown(catalogue_url(folder, url))
    typer.echo(f"{name}: {'made' if before is None else f'was at {before}'}, is at {now}.")


def run_note(
    folder: Path,
    kind: str,
    text: str,
    robot: str,
    axis: int | None,
    at: str,
    by: str,
    url: str | None,
) -> None:
    """Append an event of a person to the folder's events.

    Raises
    ------
    agent.errors.InputError
        No time, no word, a word that the night uses for its own, or nobody's joint.
    """
    _insist(folder)
    when = in_utc(at) if at else wall_time_utc()
    try:
        datetime.datetime.fromisoformat(when)
    except ValueError as error:
        raise UsageError(f"--at {at!r} is no time in ISO 8601.") from error
    if not text.strip():
        raise UsageError("A note without a word says nothing.", "Say it in one sentence.")
    if not kind.isidentifier() or kind in (*KINDS, "begun", "night"):
        raise UsageError(f"{kind!r} cannot be the kind of a note.", "Say swap, oil, or a word.")
    _insist_on_joint(folder, robot, axis, url)
    with Catalogue(folder, url) as catalogue:
        row = catalogue.record_event(Event(when, kind, text, robot, axis, by=by))
    typer.echo(f"{catalogue.folder / row.path}: line {row.line}")


def _insist_on_joint(folder: Path, robot: str, axis: int | None, url: str | None) -> None:
    """Refuse a joint that nothing in the folder is of: a name mistyped would change nothing.

    The catalogue is asked first, and then the files, which are the truth.
    """
    known: set[tuple[str, int]] = set()
    if is_there(catalogue_url(folder, url)):
        with Catalogue(folder, url) as catalogue:
            known = _joints([*catalogue.recordings(), *catalogue.verdicts()])
    if not _is_among(robot, axis, known):
        found = everything(folder)
        known |= _joints([*found.recordings, *found.verdicts])
    if _is_among(robot, axis, known):
        return
    robots = sorted({name for name, _ in known})
    axes = sorted(number for name, number in known if name == robot)
    if axes:
        here = f"only of axis {', '.join(map(str, axes))}"
    else:
        here = f"only of {', '.join(robots)}" if robots else "nor of any other robot"
    joint = robot if axis is None else f"{robot} axis {axis}"
    raise InputError(f"{folder}: holds no recording of {joint}, {here}.")


def _joints(rows: Sequence[RecordingRow | VerdictRow]) -> set[tuple[str, int]]:
    return {(row.robot, row.axis) for row in rows}


def _is_among(robot: str, axis: int | None, known: set[tuple[str, int]]) -> bool:
    return any(robot == name and axis in (None, number) for name, number in known)


def run_retain(
    folder: Path, days: float | None, megabytes: float | None, url: str | None, *, apply: bool
) -> None:
    """Say what would go and why the rest stays; remove it only where that was asked for.

    Raises
    ------
    agent.errors.InputError
        Neither limit was given, or there is no catalogue.
    """
    if days is None and megabytes is None:
        raise UsageError("Nothing was asked for.", "Give --days, --max-mb or both.")
    _insist_on_catalogue(folder, url)
    with Catalogue(folder, url) as catalogue:
        built = catalogue.rebuild()  # files are the truth, above all before one is removed
        if built.problems:
            for problem in built.problems:
                talker().print(problem)
            raise InputError("Nothing is removed while files cannot be read (see above).")
        fates = plan_retention(catalogue, Limits(days, megabytes), wall_time_utc())
        for fate in fates:
            word = ("removed" if apply else "would go") if fate.goes else "stays"
            typer.echo(f"{word:<8}  {fate.recording.path}: {fate.why}")
        going = [f for f in fates if f.goes]
        freed = sum(f.recording.size_bytes for f in going)
        if apply:
            freed = apply_retention(catalogue, fates)
    more = "" if apply or not going else " This was a dry run; --apply removes them."
    talker().print(
        f"{len(going)} of {len(fates)} recordings, {freed / MEGABYTE:.1f} MB "
        f"{'removed' if apply else 'would go'}.{more}"
    )


def run_verify(folder: Path, *, recompute: bool, as_json: bool) -> None:
    """Check every recording and verdict below a folder; exit 1 where one does not hold."""
    from agent.cli.record import keep as catalogue_keep

    checked = verify(folder, catalogue_keep.recompute if recompute else None)
    wrong = [c for c in checked if not c.holds]
    unsealed = [c for c in checked if c.holds and not c.sealed]
    if as_json:
        typer.echo(json.dumps([{**asdict(c), "path": str(c.path)} for c in checked], indent=2))
    else:
        for item in checked:
            typer.echo(f"{'ok    ' if item.holds else 'BROKEN'}  {item.sentence}")
    note = f" {len(unsealed)} were never sealed: `stribeck catalogue add`." if unsealed else ""
    talker().print(f"{len(checked)} checked, {len(wrong)} do not hold.{note}")
    if wrong:
        raise typer.Exit(BAD_NEWS)


def _insist(folder: Path) -> None:
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder.")


def _insist_on_catalogue(folder: Path, url: str | None) -> None:
    """Refuse a folder without a catalogue: who reads, or tries, makes none."""
    _insist(folder)
    where = catalogue_url(folder, url)
    if not is_there(where):
        raise InputError(
            f"There is no catalogue {shown(where)}.",
            f"`stribeck catalogue rebuild {folder}` makes one from the folder's files.",
        )
