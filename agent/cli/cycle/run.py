"""`stribeck run`: one cycle on a real axis, from the cell's description to the verdict."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import typer

from agent.cell.cell import Axis, Cell, read_cell
from agent.cli.cycle.dry_run_text import judged_in_words
from agent.cli.identify.summary import summary
from agent.cli.record.keep import keep
from agent.cli.terminal.talk import progress_bar, stop_on_signal, talker
from agent.conclude.outcome import conclude
from agent.cycle.axis_lock import owned
from agent.cycle.plan import NAMED, plan_cycle
from agent.cycle.preflight import before_the_bus
from agent.cycle.runner import Progress
from agent.errors import InputError, RefusedError
from agent.given_back import said_in
from agent.record.reading import read
from agent.replayed import Replayed
from agent.wire.replay import clock_for
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.errors import why_unreadable
from drivers.ports import SyncAccount
from trajectories import Trajectory, TrajectoryError, summarise


def dry_run_axis(
    cell_path: Path, number: int, *, reverse: bool, trajectory_path: Path | None = None
) -> None:
    """Say what a cycle would do, with its margins; no bus is opened, nothing moves.

    Raises
    ------
    agent.errors.RefusedError
        Where the cycle would exceed a limit.
    """
    cell = read_cell(cell_path)
    axis = cell.axis_numbered(number)
    asked = asked_for(axis, trajectory_path)
    show_dry_run(cell, axis, cell_path.parent / cell.recording.folder, asked, reverse=reverse)


def show_dry_run(
    cell: Cell, axis: Axis, folder: Path, asked: Trajectory | None, *, reverse: bool = False
) -> None:
    """Print what a cycle would do and each precondition, as far as it can be judged by now.

    Parameters
    ----------
    cell, axis : Cell, Axis
        Whose joint.
    folder : pathlib.Path
        Where a recording would go.
    asked : Trajectory, optional
        In place of the cell's stair.
    reverse : bool
        Whether it would be driven backward in time.

    Raises
    ------
    agent.errors.RefusedError
        Where the cycle would exceed a limit.
    """
    number = axis.number
    cycle = plan_cycle(cell, axis, reverse=reverse, trajectory=asked)
    plan = summarise(
        cycle.trajectory, axis.motor_limits, axis.torque_model, gear_ratio=axis.gear_ratio
    )
    typer.echo("\n".join([f"{cell.robot}, axis {number}: dry run, nothing moves.", *plan.lines()]))
    with owned(cell, axis) as no_other_owner:
        judged = (*before_the_bus(cell, axis, cycle, folder), no_other_owner)
        typer.echo("\n".join(["", *judged_in_words(cell, axis, judged)]))
    if plan.excesses:
        raise RefusedError("What would be driven does not fit the axis's limits.")


def asked_for(axis: Axis, what: Path | None) -> Trajectory | None:
    """Return what `--trajectory` asks for: a document, or a name where no such file exists.

    Parameters
    ----------
    axis : agent.cell.axis.Axis
        A named trajectory is made from its numbers.
    what : pathlib.Path, optional
        A file, or one of `agent.cycle.plan.NAMED`; None asks for the cell's stair.

    Raises
    ------
    agent.errors.InputError
        Where it is neither.
    trajectories.TrajectoryError
        Where the axis cannot drive what is named.
    """
    if what is not None and not what.exists():
        made = NAMED.get(str(what))
        if made is not None:
            return made(axis)
        raise InputError(
            f"The trajectory {what} cannot be read: there is no such file.",
            f"Give a file that `stribeck plan` wrote, or a name: {', '.join(NAMED)}.",
        )
    return read_trajectory(what)


def read_trajectory(path: Path | None) -> Trajectory | None:
    """Read a `stribeck.trajectory/1` document; None where no path is given.

    Raises
    ------
    agent.errors.InputError
        Where the file cannot be read, or describes no trajectory.
    """
    if path is None:
        return None
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        return Trajectory.from_json(document)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"The trajectory {path} cannot be read: {why_unreadable(error)}."
        ) from error
    except TrajectoryError as error:
        raise InputError(f"{path} is not a trajectory: {error}.") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON: {error}.") from error


def run_axis(
    cell_path: Path,
    number: int,
    out: Path | None,
    *,
    reverse: bool,
    as_json: bool,
    trajectory_path: Path | None = None,
    shown: Callable[[str], AbstractContextManager[Progress]] = progress_bar,
) -> None:
    """Drive one cycle and conclude; `shown` is where its progress is shown."""
    cell = read_cell(cell_path)
    axis = cell.axis_numbered(number)
    own = cell_path.parent / cell.recording.folder
    request = CycleRequest(
        cell,
        axis,
        own if out is None else out,
        reverse,
        asked_for(axis, trajectory_path),
        journal_folder=own,
    )
    with stop_on_signal() as stop_requested, shown(f"axis {number}") as progress:
        result = drive_cycle(
            request, clock_for(cell), stop_requested=stop_requested, progress=progress
        )
    account = result.account
    talker().print(
        f"Recorded {account.received} of {account.expected} samples, {account.lost} lost, "
        f"{account.late} late, {account.not_asked} not asked for in time, "
        f"jitter {account.jitter_s * 1e3:.2f} ms{_received(account)}."
    )
    recording = read(result.recording)
    if restored := said_in(recording.metadata.extra):
        talker().print(restored)
    replayed = Replayed.from_metadata(recording.metadata.extra, recording.source)
    if replayed is not None:
        talker().print(replayed.sentence)
    conclusion = conclude([recording])
    json_path = conclusion.write_json(result.recording.with_suffix(".estimate.json"))
    report_path = conclusion.write_report(result.recording.with_suffix(".report.html"))
    keep(result.recording, conclusion)
    if as_json:
        typer.echo(conclusion.json())
        return
    typer.echo(summary(conclusion.estimate))
    typer.echo("\nFiles:")
    for what, path in (
        ("recording", result.recording),
        ("estimate", json_path),
        ("report", report_path),
    ):
        typer.echo(f"  {what:<10} {path}")


def _received(account: SyncAccount) -> str:
    """Say what the kernel dropped, and what it granted, where anybody can tell."""
    if account.dropped_by_kernel is None or account.receive_buffer_bytes is None:
        return ""
    return (
        f"; the kernel dropped {account.dropped_by_kernel} frames, with "
        f"{account.receive_buffer_bytes // 1024} KiB to keep them in"
    )
