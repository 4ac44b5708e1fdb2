"""`stribeck reversals`: what the joint does where it turns round."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import typer

from agent.cli.terminal.pictures import write_picture
from agent.conclude.comparable import one_axis
from agent.conclude.outcome import signals_of
from agent.identify.result import Parameter
from agent.identify.reversals.identification import identify_reversals
from agent.identify.reversals.result import PreslidingFit, ReversalFit
from agent.identify.reversals.sentence import angle_scale, scale_of
from agent.numbers import parameter_label, scale_for, significant, written
from agent.record.reading import read_all

_LABELS = {
    "space_constant_rad": "Travel before it slips",
    "stiffness_nm_per_rad": "Stiffness at the turn",
    "damping_nm_s_per_rad": "Damping of the contacts",
    "fast_nm": "Fast element",
    "slow_nm": "Slow element, taken away",
    "fast_share": "Fast travel as a share of the slow",
    "wind_up_rad": "Wind-up from one side to the other",
    "motor_coulomb_nm": "Coulomb friction of the motor",
    "arm_coulomb_nm": "Coulomb friction of the arm",
    "arm_inertia_kg_m2": "Inertia of the arm",
    "static_extra_nm": "Extra friction at standstill",
    "backlash_rad": "Clearance (backlash)",
    "lost_motion_rad": "Lost motion",
    "compliance_rad_per_nm": "Compliance of the gear",
    "encoder_skew_s": "Arm's encoder behind the motor's",
}


def run_reversals(patterns: Sequence[str], picture: Path | None, *, as_json: bool) -> None:
    """Identify presliding and clearance from recordings and print them.

    Raises
    ------
    agent.errors.InputError
        A recording cannot be used, or they are not of one axis.
    """
    recordings = read_all(patterns)
    one_axis(recordings)
    found = identify_reversals([signals_of(r) for r in recordings])
    if picture is not None and found.traces:
        from agent.report.figures.reversals import figure_reversals

        write_picture(picture, figure_reversals(found))
    typer.echo(json.dumps(found.to_json(), indent=2) if as_json else reversals_text(found))


def reversals_text(found: ReversalFit) -> str:
    """Return what a technician reads: the sentence, the laws beside each other, the numbers.

    Where no law tells, there are no numbers of one, and nothing is told of what was not asked.
    """
    lines = [found.sentence, *([] if found.reasons else _law_lines(found))]
    lines += _clearance_lines(found) if found.decidable else []
    lines += [f"Note: {note}." for note in found.notes]
    return "\n".join(lines)


def _law_lines(found: ReversalFit) -> list[str]:
    lines = ["", f"Error at reversals left out ({found.reversals} reversals):"]
    lines += [_law(fit) for fit in found.laws]
    selected = found.selected
    if selected is not None:
        lines += ["", f"Parameters ({selected.law}, motor side):"]
        lines += [_row(name, p) for name, p in selected.parameters.items()]
    return lines


def _clearance_lines(found: ReversalFit) -> list[str]:
    lines = ["", f"Between motor and arm ({found.clearance.source.replace('-', ' ')}):"]
    named = found.clearance.named()
    if len({p.reason for p in named.values()}) == 1 and not any(
        p.identified for p in named.values()
    ):
        named = {"backlash_rad": found.clearance.backlash_rad}
    lines += [
        _row(name, p)
        for name, p in named.items()
        if p.identified or name == "backlash_rad" or found.clearance.source == "arm-encoder"
    ]
    return lines


def _law(fit: PreslidingFit) -> str:
    scale = scale_for("N m", (fit.heldout_rmse_nm,))
    error = f"{significant(fit.heldout_rmse_nm * scale.factor, 3)} {scale.unit}"
    return f"  {'*' if fit.selected else ' '} {fit.law:<15} {error:<12} {fit.reason}"


def _row(name: str, parameter: Parameter) -> str:
    label = _LABELS.get(name) or parameter_label(name)
    if not parameter.identified:
        return f"  {label:<36} {parameter.reason}"
    if name == "compliance_rad_per_nm":
        # The names' units know no reciprocal stiffness: an angle for each N m.
        scale = angle_scale(parameter.value)
        value, interval, _ = written(parameter, scale.factor)
        return f"  {label:<36} {value:>9} {scale.unit + '/(N m)':<12} ({interval})"
    scale = scale_of(name, parameter.value)
    value, interval, _ = written(parameter, scale.factor)
    return f"  {label:<36} {value:>9} {scale.unit:<12} ({interval})"
