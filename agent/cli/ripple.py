"""`stribeck ripple`: at which orders the torque is periodic in the motor's position."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from agent.cli.outcome import signals_of
from agent.cli.talk import talker
from agent.errors import InputError
from agent.identify.ripple import Ripple, find_ripple
from agent.identify.ripple_line import RippleLine
from agent.numbers import scale_for, written
from agent.record.reading import read_all
from agent.record.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def run_ripple(
    patterns: Sequence[str], highest_order: float | None, picture: Path | None, *, as_json: bool
) -> None:
    """Scan recordings for ripple and print what stands out.

    Raises
    ------
    agent.errors.InputError
        A recording cannot be used, they are not of one axis, or an option makes no sense.
    """
    if highest_order is not None and not highest_order > 0.0:
        raise InputError(f"--highest-order: expected a number above 0, got {highest_order:g}.")
    recordings = read_all(patterns)
    one_axis(recordings)
    found = find_ripple([signals_of(r) for r in recordings], highest_order=highest_order)
    if picture is not None and found.decidable:
        from agent.report.figure_ripple import figure_ripple

        write_picture(picture, figure_ripple(found))
    typer.echo(json.dumps(found.to_json(), indent=2) if as_json else ripple_text(found))


def one_axis(recordings: Sequence[Recording]) -> None:
    """Refuse recordings of different axes.

    Raises
    ------
    agent.errors.InputError
        Naming the axes.
    """
    joints = {(r.metadata.robot, r.metadata.axis, r.metadata.gear_ratio) for r in recordings}
    if len(joints) > 1:
        names = "; ".join(f"{robot} axis {axis} (gear {gear:g})" for robot, axis, gear in joints)
        raise InputError(
            f"These recordings are not all of one axis: {names}.", "Take each axis by itself."
        )


def write_picture(path: Path, figure: Figure) -> None:
    """Write a figure as the file's name asks, SVG or PNG.

    Raises
    ------
    agent.errors.InputError
        The name ends otherwise.
    """
    import io

    from agent.record.atomic import publish

    kind = path.suffix.lower().removeprefix(".")
    if kind not in {"svg", "png"}:
        raise InputError(f"--picture: expected a name that ends in .svg or .png, got {path}.")
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind)
    publish({path: buffer.getvalue()}, overwrite=True)
    talker().print(f"The picture is in {path}.")


def ripple_text(found: Ripple) -> str:
    """Return what a technician reads: one line per order, or why there is none."""
    if not found.decidable:
        return "\n".join(f"{reason[0].upper()}{reason[1:]}." for reason in found.reasons)
    scanned = f"{found.order[0]:.3g} to {found.order[-1]:.4g}"
    passes = f"{found.passes} pass" + ("" if found.passes == 1 else "es")
    if not found.lines:
        lines = [f"No torque ripple stands out between orders {scanned} ({passes})."]
    else:
        lines = [
            f"Torque is periodic in motor position at {len(found.lines)} of the orders {scanned} "
            f"({passes}):",
            *(_row(line) for line in found.lines),
        ]
        reasons = dict.fromkeys(line.reason for line in found.lines if line.reason)
        lines += ["", *(f"Which effect it is stays undecided: {r}." for r in reasons)]
    lines += [f"Note: {note}." for note in found.notes]
    return "\n".join(lines).rstrip()


def _row(line: RippleLine) -> str:
    amplitude = line.amplitude_nm
    scale = scale_for("N m", (amplitude.value,))
    order, _, half = written(line.order_per_motor_rev)
    value, interval, _ = written(amplitude, scale.factor)
    arm = line.order_per_arm_rev.value
    per_arm = "" if arm == line.order_per_motor_rev.value else f", {arm:.5g} per arm turn"
    kind = "" if line.kind == "undecided" else f"  {line.kind}"
    return f"  {order:>9} ±{half} per motor turn{per_arm}: {value} {scale.unit} ({interval}){kind}"
