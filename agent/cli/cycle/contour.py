"""`stribeck run --contour`: the travel at a creep, under a tight torque limit, before the stair."""

from __future__ import annotations

import json
import math
from pathlib import Path

import typer

from agent.cell.cell import Axis, Cell, read_cell
from agent.cli.cycle.run import show_dry_run
from agent.cli.terminal.talk import progress_bar, stop_on_signal, talker
from agent.cycle.contour import contour_of, creep_rad_s, creeping
from agent.cycle.heaviness import heaviness
from agent.errors import AgentError, InputError, StoppedError, UsageError
from agent.given_back import said_in
from agent.record.reading import read
from agent.wire.replay import clock_for
from agent.wire.wire import CycleRequest, drive_cycle


def dry_run_contour(cell_path: Path, number: int, torque_nm: float | None) -> None:
    """Say what a contour check would do; no bus is opened, nothing moves.

    Raises
    ------
    agent.errors.RefusedError
        Where it would exceed a limit.
    """
    cell, axis = _asked(cell_path, number, torque_nm)
    typer.echo(_limits(axis))
    show_dry_run(cell, axis, cell_path.parent / cell.recording.folder, contour_of(axis))


def run_contour(
    cell_path: Path, number: int, out: Path | None, torque_nm: float | None, *, as_json: bool
) -> None:
    """Creep over the travel and back, and say where the joint is heavier.

    Raises
    ------
    agent.errors.StoppedError
        Something stood in the way, or any other condition of a cycle did not hold; a note says
        where the joint was.
    """
    cell, axis = _asked(cell_path, number, torque_nm)
    own = cell_path.parent / cell.recording.folder
    folder = own if out is None else out
    request = CycleRequest(cell, axis, folder, trajectory=contour_of(axis), journal_folder=own)
    before = set(folder.glob("*-contour.parquet"))
    talker().print(_limits(axis))
    try:
        with stop_on_signal() as stop_requested, progress_bar(f"axis {number}") as progress:
            result = drive_cycle(
                request, clock_for(cell), stop_requested=stop_requested, progress=progress
            )
    except StoppedError as error:
        _note_where(error, set(folder.glob("*-contour.parquet")) - before)
        raise
    recording = read(result.recording)
    if restored := said_in(recording.metadata.extra):
        talker().print(restored)
    found = heaviness(recording.columns, recording.metadata.gear_ratio)
    if found is None:
        raise InputError(f"{result.recording} holds no place that was passed in both directions.")
    if as_json:
        typer.echo(json.dumps(found.to_json()))
        return
    typer.echo(f"The way is free. {found.sentence}")
    typer.echo(f"\nFiles:\n  recording  {result.recording}")


def _asked(cell_path: Path, number: int, torque_nm: float | None) -> tuple[Cell, Axis]:
    """Return the cell, and the axis under the check's limits."""
    if torque_nm is not None and not 0.0 < torque_nm < math.inf:
        raise UsageError(f"--torque-nm: expected a number above 0, got {torque_nm:g}.")
    cell = read_cell(cell_path)
    axis = cell.axis_numbered(number)
    if axis.drive_ is None:
        raise InputError(
            f"Axis {number} is run by a controller, which drives its own stair only: a contour "
            "check is that controller's business."
        )
    return cell, creeping(axis, torque_nm)


def _limits(axis: Axis) -> str:
    stair, limits = axis.stair, axis.limits
    return (
        f"Contour check: from {stair.arm_from_deg:g} to {stair.arm_to_deg:g} degrees of the arm "
        f"and back at {creep_rad_s(axis):.2f} rad/s of the motor; stops at "
        f"{limits.motor_torque_max_nm:.2f} N m, and "
        f"{limits.following_error_max_arm_deg:g} degrees of the arm behind."
    )


def _note_where(error: StoppedError, kept: set[Path]) -> None:
    """Say where the joint was when it was stopped, as its recording shows."""
    for path in kept:
        try:
            recording = read(path)
        except AgentError:
            return  # too short to be read: it had hardly begun
        arm_rad = recording.columns["position_rad"][-1] / recording.metadata.gear_ratio
        error.add_note(f"It stands at {math.degrees(arm_rad):.1f} degrees of the arm.")
