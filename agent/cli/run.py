"""`stribeck run`: one cycle on a real axis, from the cell's description to the verdict."""

from __future__ import annotations

from pathlib import Path

import typer

from agent.cell import read_cell
from agent.cli.outcome import conclude
from agent.cli.summary import summary
from agent.cli.talk import progress_bar, stop_on_signal, talker
from agent.cycle.plan import stair_of
from agent.errors import RefusedError
from agent.record.reading import read
from agent.wire import CycleRequest, drive_cycle
from drivers.clock import MonotonicClock
from trajectories import summarise


def dry_run_axis(cell_path: Path, number: int, *, reverse: bool) -> None:
    """Say what a cycle would do, with its margins; no bus is opened, nothing moves.

    Raises
    ------
    agent.errors.RefusedError
        Where the cycle would exceed a limit.
    """
    cell = read_cell(cell_path)
    axis = cell.axis_numbered(number)
    trajectory = stair_of(axis, reverse=reverse)
    plan = summarise(trajectory, axis.motor_limits, axis.torque_model, gear_ratio=axis.gear_ratio)
    typer.echo("\n".join([f"{cell.robot}, axis {number}: dry run, nothing moves.", *plan.lines()]))
    if not axis.commissioned:
        typer.echo("The axis is not commissioned: `stribeck run` would refuse it.")
    if plan.excesses:
        raise RefusedError("The stair does not fit the axis's limits.")


def run_axis(
    cell_path: Path, number: int, out: Path | None, *, reverse: bool, as_json: bool
) -> None:
    """Drive one cycle and conclude."""
    cell = read_cell(cell_path)
    axis = cell.axis_numbered(number)
    folder = out if out is not None else cell_path.parent / cell.recording.folder
    request = CycleRequest(cell, axis, folder, reverse)
    with stop_on_signal() as stop_requested, progress_bar(f"axis {number}") as progress:
        result = drive_cycle(
            request, MonotonicClock(), stop_requested=stop_requested, progress=progress
        )
    account = result.account
    talker().print(
        f"Recorded {account.received} of {account.expected} samples, {account.lost} lost, "
        f"{account.late} late, jitter {account.jitter_s * 1e3:.2f} ms."
    )
    conclusion = conclude([read(result.recording)])
    json_path = conclusion.write_json(result.recording.with_suffix(".estimate.json"))
    report_path = conclusion.write_report(result.recording.with_suffix(".report.html"))
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
