"""`stribeck ripple`: at which orders the torque is periodic in the motor's position."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import typer

from agent.cli.terminal.pictures import write_picture
from agent.conclude.comparable import one_axis
from agent.conclude.outcome import signals_of
from agent.errors import InputError, UsageError
from agent.identify.result import Parameter
from agent.identify.ripple.change import GONE, OrderChange, RippleChange, compare_ripple
from agent.identify.ripple.identification import Ripple, find_ripple
from agent.identify.ripple.line import RippleLine
from agent.identify.ripple.sentence import motion_sentence
from agent.numbers import scale_for, written
from agent.record.reading import read_all
from agent.record.recording import Recording

_COMPARED = 10  # orders in the table of anticogging
_FAMILY = 3  # orders: two are multiples of one another too easily
_OFF = 0.02  # of the first: as far as slow passes of few turns set orders apart
_STUTTER = (
    "Stutter: by so much the motor runs ahead of an even turning and falls behind it, in turn, at "
    "this order (17.5 mrad are 1 degree)."
)


def run_ripple(
    patterns: Sequence[str], highest_order: float | None, picture: Path | None, *, as_json: bool
) -> None:
    """Scan recordings for ripple and print what stands out.

    Raises
    ------
    agent.errors.InputError
        A recording cannot be used, they are not of one axis, or an option makes no sense.
    """
    if highest_order is not None and not 0.0 < highest_order < math.inf:
        raise UsageError(f"--highest-order: expected a number above 0, got {highest_order:g}.")
    recordings = read_all(patterns)
    one_axis(recordings)
    off, on = _by_anticogging(recordings)
    found = find_ripple([signals_of(r) for r in off], highest_order=highest_order)
    changes: tuple[RippleChange, ...] = ()
    if on:
        changes = compare_ripple(
            [signals_of(r) for r in off], [signals_of(r) for r in on], highest_order
        )
    if picture is not None and found.decidable:
        from agent.report.figures.ripple import figure_ripple

        write_picture(picture, figure_ripple(found, changes))
    if as_json:
        compared = [{**c.to_json(), "sentence": motion_sentence(c)} for c in changes]
        document = {**found.to_json(), "anticogging": compared}
        typer.echo(json.dumps(document, indent=2))
    else:
        typer.echo("\n".join((ripple_text(found), *change_text(changes, compared=bool(on)))))


def _by_anticogging(
    recordings: Sequence[Recording],
) -> tuple[list[Recording], list[Recording]]:
    """Return the recordings without and with anticogging, by what their trajectory says.

    Only where there are both is there something to compare; else all stand together.
    """

    def compensated(recording: Recording) -> bool | None:
        trajectory = recording.metadata.trajectory
        inner = trajectory.get("parameters")
        own = inner if isinstance(inner, Mapping) else {}
        said = trajectory.get("anticogging", own.get("anticogging"))
        return said if isinstance(said, bool) else None

    off = [r for r in recordings if compensated(r) is False]
    on = [r for r in recordings if compensated(r) is True]
    if not (off and on):
        return list(recordings), []
    if len(off) + len(on) < len(recordings):
        raise InputError(
            "Some of these recordings say whether anticogging was on, and some do not.",
            "Take those that do (trajectory.anticogging in the metadata), or the others, alone.",
        )
    return off, on


def ripple_text(found: Ripple) -> str:
    """Return what a technician reads: one line per order, or why there is none."""
    if not found.decidable:
        return "\n".join(f"{reason[0].upper()}{reason[1:]}." for reason in found.reasons)
    scanned = f"{found.order[0]:.3g} to {found.order[-1]:.4g}"
    passes = f"{found.passes} pass" + ("" if found.passes == 1 else "es")
    if not found.lines:
        lines = [f"No torque ripple stands out among the orders {scanned} ({passes})."]
    else:
        lines = [
            f"Torque is periodic in motor position at {len(found.lines)} of the orders {scanned} "
            f"({passes}):",
            *(_row(line) for line in found.lines),
        ]
        family, base = multiples([line.order_per_motor_rev for line in found.lines])
        if family:
            named = ", ".join(_order(order) for order in family)
            lines += ["", f"Multiples of {_order(base)}: {named}."]
        if any(_moves(line) for line in found.lines):
            lines += ["", _STUTTER]
        reasons = dict.fromkeys(line.reason for line in found.lines if line.reason)
        lines += ["", *(f"Which effect it is stays undecided: {r}." for r in reasons)]
    lines += [f"Note: {note}." for note in found.notes]
    return "\n".join(lines).rstrip()


def multiples(orders: Sequence[Parameter]) -> tuple[list[float], float]:
    """Return the orders that are whole multiples of one of them, rising, and of which.

    At least three, and half of all multiples up to the last: of a low order nearly everything is a
    multiple by chance. Empty and 0 where there are none.
    """
    best: tuple[list[float], float] = ([], 0.0)
    for base in (order.value for order in orders):
        family = sorted(o.value for o in orders if _is_multiple(o, base))
        complete = 2 * len(family) >= round(max(family, default=0.0) / base)
        if len(family) >= max(_FAMILY, len(best[0]) + 1) and complete:
            best = family, base
    return best


def _is_multiple(order: Parameter, base: float) -> bool:
    times = round(order.value / base)
    low, high = order.ci95 if order.ci95 is not None else (order.value, order.value)
    reach = max(0.5 * (high - low), _OFF * base)
    return times >= 1 and abs(order.value - times * base) <= reach


def _moves(line: RippleLine) -> bool:
    """Tell whether the position stutters at this order beyond its noise."""
    stutter = line.stutter_rad
    return stutter.identified and stutter.ci95 is not None and stutter.ci95[0] > 0.0


def _order(order: float) -> str:
    return f"{round(order, 1):g}"


def change_text(changes: Sequence[RippleChange], *, compared: bool) -> list[str]:
    """Return the table of what anticogging does to torque and motion at each order."""
    if not compared:
        return []
    if not changes:
        return ["", "With and without anticogging: no slow pass of the same speed in both."]
    lines = []
    for change in changes:
        lines += [
            "",
            f"Anticogging off → on at {change.velocity_rad_s:.3g} rad/s "
            f"({change.passes[0]} and {change.passes[1]} passes):",
            f"  {'order':>7}  {'torque, mN m':<24}{'position stutter, mrad':<24}",
        ]
        lines += [_change_row(order) for order in change.orders[:_COMPARED]]
    return [*lines, "", *(motion_sentence(change) for change in changes)]


def _change_row(order: OrderChange) -> str:
    torque = _change(*order.torque_nm, order.torque_left)
    stutter = _change(*order.stutter_rad, order.stutter_left, gone=order.motion == GONE)
    return f"  {order.order_per_motor_rev:>7.2f}  {torque:<24}{stutter}"


def _change(off: Parameter, on: Parameter, left: Parameter, *, gone: bool = False) -> str:
    """Return one quantity before and after, in thousandths; what drowns in noise has a limit."""
    if off.ci95 is None or on.ci95 is None:
        return f"not identified: {off.reason or on.reason}"
    if gone or on.ci95[0] <= 0.0:
        return f"{1e3 * off.value:.3g} → below {1e3 * on.ci95[1]:.2g}"
    share = f" ({100.0 * left.value:.0f} %)" if left.identified else ""
    return f"{1e3 * off.value:.3g} → {1e3 * on.value:.3g}{share}"


def _row(line: RippleLine) -> str:
    amplitude = line.amplitude_nm
    scale = scale_for("N m", (amplitude.value,))
    order, _, half = written(line.order_per_motor_rev)
    value, interval, _ = written(amplitude, scale.factor)
    arm = line.order_per_arm_rev.value
    per_arm = "" if arm == line.order_per_motor_rev.value else f", {arm:.5g} per arm turn"
    kind = "" if line.kind == "undecided" else f"  {line.kind}"
    moves = f"; stutter {1e3 * line.stutter_rad.value:.3g} mrad" if _moves(line) else ""
    size = f"{value} {scale.unit} ({interval})"
    return f"  {order:>9} ±{half} per motor turn{per_arm}: {size}{kind}{moves}"
