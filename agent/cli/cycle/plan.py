"""`stribeck plan`: the stair that tells most in the time there is, printed and drawn."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import typer

from agent.cell.cell import Axis, Cell, read_cell
from agent.cli.cycle.plan_aliases import aliases_document, planned_aliases
from agent.cli.cycle.plan_outlook import Outlook, outlook_of
from agent.cli.cycle.plan_words import basis, can_see, cannot_see, in_short, rows
from agent.cycle.plan import stair_of
from agent.record.atomic import check_folder, make_folder, publish
from trajectories import lasting, summarise
from trajectories.summary import Summary

SCHEMA = "stribeck.plan/1"


def run_plan(
    cell_path: Path,
    number: int,
    seconds: float | None,
    out: Path,
    *,
    noise_nm: float,
    dwell_s: float,
    as_json: bool,
    with_aliases: bool = False,
) -> None:
    """Design the stair, write trajectory and picture, and say what it can and cannot see.

    Without `seconds` nothing is designed or written: `with_aliases` then asks the cell's own stair.

    Raises
    ------
    typer.BadParameter
        Neither `seconds` nor `with_aliases`.
    agent.errors.InputError
        The cell does not say what joint to expect.
    """
    cell = read_cell(cell_path)
    axis = cell.axis_numbered(number)
    if seconds is None:
        if not with_aliases:
            raise typer.BadParameter(
                "How long may the stair last? Give it, or --aliases to ask the cell's own stair "
                "what it cannot tell apart.",
                param_hint="--seconds",
            )
        _say_aliases(cell, axis, as_json=as_json)
        return
    check_folder(out)
    outlook = outlook_of(cell, axis, seconds, noise_nm=noise_nm, dwell_s=dwell_s)
    trajectory_path, picture_path = out / "plan.json", out / "plan.html"
    _write(outlook, trajectory_path, picture_path, axis)
    confused = planned_aliases(cell, axis, outlook.trajectory) if with_aliases else None
    if as_json:
        document = _document(outlook)
        if confused is not None:
            document["aliases"] = confused.to_json()
        typer.echo(json.dumps(document, indent=2, allow_nan=False))
        return
    typer.echo(plan_in_words(outlook, axis))
    if confused is not None:
        typer.echo("\n".join(["", *confused.lines()]))
    typer.echo("\nFiles:")
    typer.echo(f"  {'plan':<10} {trajectory_path}")
    typer.echo(f"  {'picture':<10} {picture_path}")
    typer.echo(
        f"\nDrive it with: stribeck run {cell_path} --axis {number} --trajectory {trajectory_path}"
    )


def _say_aliases(cell: Cell, axis: Axis, *, as_json: bool) -> None:
    """Say what the cell's own stair cannot tell apart."""
    stair = stair_of(axis)
    if as_json:
        typer.echo(json.dumps(aliases_document(cell, axis, stair), indent=2, allow_nan=False))
        return
    head = f"{cell.robot}, axis {axis.number}: the cell's own stair of {lasting(stair.duration_s)}."
    typer.echo("\n".join([head, "", *planned_aliases(cell, axis, stair).lines()]))


def plan_in_words(outlook: Outlook, axis: Axis) -> str:
    """Return the plan as a technician reads it in a terminal."""
    motion = _motion_of(outlook, axis)
    lines = [f"{outlook.robot}, axis {outlook.axis}: plan, nothing moves."]
    lines += [one for one in in_short(outlook, fits=not motion.excesses) if one]
    lines += ["", *motion.lines()]
    lines += ["", "Speeds in the order in which they are held, a stroke a line (then mirrored):"]
    lines += [f"  {stroke}" for stroke in _strokes(outlook)]
    lines += ["", "Expected 95 % intervals, if the joint is as assumed:"]
    lines += [f"  {label:<40} {value:>18}  {width}" for label, value, width in rows(outlook)]
    lines += ["", "This plan can see:", *(f"  - {one}" for one in can_see(outlook))]
    lines += ["", "It cannot see:", *(f"  - {one}" for one in cannot_see(outlook))]
    lines += ["", basis(outlook)]
    return "\n".join(lines)


def _motion_of(outlook: Outlook, axis: Axis) -> Summary:
    return summarise(
        outlook.trajectory, axis.motor_limits, axis.torque_model, gear_ratio=axis.gear_ratio
    )


def _strokes(outlook: Outlook) -> list[str]:
    """Return each stroke's speeds and dwells."""
    parameters = outlook.trajectory.parameters
    counts, speeds, dwells = (
        parameters[key] for key in ("speeds_a_stroke", "speeds_rad_s", "dwells_s")
    )
    assert isinstance(counts, tuple)
    assert isinstance(speeds, tuple)
    assert isinstance(dwells, tuple)
    held = [f"{v:.3g} rad/s for {d:.2f} s" for v, d in zip(speeds, dwells, strict=True)]
    out, first = [], 0
    for count in counts:
        out.append(", ".join(held[first : first + int(count)]))
        first += int(count)
    return out


def _write(outlook: Outlook, trajectory: Path, picture: Path, axis: Axis) -> None:
    """Write both files, or none of them."""
    from agent.report.plan import plan_html

    html = plan_html(
        outlook.trajectory,
        outlook.design.expectation,
        outlook.nominal,
        title=f"Plan of {lasting(outlook.trajectory.duration_s)}",
        robot=outlook.robot,
        axis=outlook.axis,
        gear_ratio=axis.gear_ratio,
        in_short=in_short(outlook, fits=not _motion_of(outlook, axis).excesses),
        rows=rows(outlook),
        can_see=can_see(outlook),
        cannot_see=cannot_see(outlook),
        basis=basis(outlook),
    )
    make_folder(trajectory.parent)
    document = json.dumps(outlook.trajectory.to_json(), indent=1)
    publish({trajectory: f"{document}\n".encode(), picture: html.encode()}, overwrite=True)


def _document(outlook: Outlook) -> dict[str, Any]:
    """Return the plan for programs; what the motion does not carry has no interval."""
    seen = outlook.design.expectation
    return {
        "schema": SCHEMA,
        "robot": outlook.robot,
        "axis": outlook.axis,
        "trajectory": outlook.trajectory.to_json(),
        "expected": {
            name: {
                "assumed": outlook.nominal[name],
                "half_ci95": half if math.isfinite(half) else None,
                "seen": outlook.sees(name),
            }
            for name, half in outlook.half_widths.items()
        },
        "friction_curve": {
            "velocity_rad_s": seen.speed_rad_s.tolist(),
            "standard_error_nm": seen.point_error_nm.tolist(),
        },
        "visible_rise_nm": seen.visible_rise_nm,
        "visible_rise_at_one_speed_nm": seen.visible_rise_at_one_speed_nm,
        "stribeck_range_rad_s": outlook.stribeck_range_rad_s,
        "plain_stair_s": outlook.design.plain_s,
        "intervals_over_plain": outlook.beside_plain,
        "can_see": can_see(outlook),
        "cannot_see": cannot_see(outlook),
        "basis": basis(outlook),
    }
