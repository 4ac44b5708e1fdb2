"""What a technician reads of a flexible joint: the finding first, then the numbers behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from agent.cli.identify.flexible_fit import Considered, Flexible, swings
from agent.cli.identify.flexible_periods import Source
from agent.identify.flexible.result import FlexibleFit, Start
from agent.numbers import (
    parameter_label,
    parameter_unit,
    scale_for,
    scales_for,
    significant,
    written,
)

_SHOWN = 6  # minima
_SAME = 1e-3  # relative difference of what starts leave that one minimum may have


def flexible_text(found: Flexible) -> str:
    """Return what a technician reads: the finding first, then the numbers behind it."""
    fit = found.fit
    if not fit.decidable:
        lines = [f"Not identified: {reason}." for reason in fit.reasons]
        return "\n".join(lines + _averages(found.sources))
    lines = [sentence(fit), "", "Parameters, motor side (95 % interval):"]
    scales = scales_for(fit.parameters.items())
    for name, parameter in fit.parameters.items():
        label = f"  {parameter_label(name):<38}"
        if not parameter.identified:
            lines.append(f"{label} not identified: {parameter.reason}")
            continue
        own = scale_for(parameter_unit(name), (parameter.value,))
        scale = own if own.unit.endswith("s") else scales.get(parameter_unit(name), own)
        value, interval, _ = written(parameter, scale.factor)
        lines.append(f"{label} {value:>9} {scale.unit:<10} ({interval})".rstrip())
    lines += [f"Note: {note}." for note in (n.rstrip(".") for n in fit.notes)]
    lines += ["", *_averages(found.sources), *_models(found.considered), *_starts(fit.starts)]
    return "\n".join([*lines, "", *_validation(found)])


def sentence(fit: FlexibleFit) -> str:
    """Say in one sentence what swings behind the gear, and what knowing it is worth."""
    scale = scale_for("N m", (fit.rigid_rmse_nm,))
    left, rigid = (
        f"{significant(scale.factor * value, 3)} {scale.unit}"
        for value in (fit.rmse_nm, fit.rigid_rmse_nm)
    )
    if not swings(fit):
        return (
            f"Not identified: a {fit.kind} joint leaves {left} of the torque where a rigid one "
            f"leaves {rigid}, but the recordings do not say where it swings; record a triangle "
            "wave of velocity with high jerk, ten periods or more."
        )
    what = "the arm swings" if fit.kind == "two-mass" else "gear and arm swing"
    several = "s" if fit.kind == "three-mass" else ""
    return (
        f"Behind the motor {what} at {_frequencies(fit, 'antiresonance')} Hz (antiresonance"
        f"{several}) and {_frequencies(fit, 'resonance')} Hz (resonance{several}); the flexible "
        f"joint leaves {left} of the torque where a rigid one leaves {rigid}. The recordings show "
        f"swings up to {significant(fit.cutoff_hz, 2)} Hz: what swings faster counts as a part of "
        "these masses."
    )


def _frequencies(fit: FlexibleFit, name: str) -> str:
    numbers = ("",) if fit.kind == "two-mass" else ("_1", "_2")
    return " and ".join(significant(fit.parameters[f"{name}{n}_hz"].value, 3) for n in numbers)


def _averages(sources: Sequence[Source]) -> list[str]:
    """Say which recordings were averaged over how many periods."""
    out = []
    for source in sources:
        if source.scatter is None:
            continue
        scale = scale_for("N m", (source.scatter.torque_nm,))
        scatter = significant(scale.factor * source.scatter.torque_nm, 2)
        out.append(
            f"{source.signals.name}: {source.scatter.periods} periods of "
            f"{significant(source.period_s, 4)} s are averaged; their torque differs by "
            f"{scatter} {scale.unit} rms from one to the next."
        )
    return out


def _models(considered: Sequence[Considered]) -> list[str]:
    """Say which models were tried and which one was taken."""
    if len(considered) < 2:
        return []
    lines = ["Models tried (torque left):"]
    for model in considered:
        name = f"{model.kind}, {model.friction} friction" + (", gravity" if model.gravity else "")
        left = "not decidable"
        if math.isfinite(model.rmse_nm):
            scale = scale_for("N m", (model.rmse_nm,))
            left = f"{significant(scale.factor * model.rmse_nm, 3)} {scale.unit}"
        lines.append(f"  {name:<48} {left}{'   <- taken' if model.taken else ''}")
    return lines


def _starts(starts: Sequence[Start]) -> list[str]:
    """Say where the starts of the search ended: one line for every minimum."""
    first = next((s for s in starts if s.origin == "frequency-response"), None)
    groups: list[list[Start]] = []
    for start in sorted(starts, key=lambda s: (s.outcome != "best", s.rmse_nm)):
        last = groups[-1][0] if groups else None
        same = (
            last is not None
            and last.outcome == start.outcome
            and start.rmse_nm <= (1.0 + _SAME) * last.rmse_nm
        )
        if same:
            groups[-1].append(start)
        else:
            groups.append([start])
    words = {
        "best": "the minimum that is kept",
        "local": "local minimum, discarded",
        "unfinished": "given up above the one that is kept",
    }
    lines = [f"Starts of the search ({len(starts)}; torque left):"]
    for group in groups[:_SHOWN]:
        scale = scale_for("N m", (group[0].rmse_nm,))
        left = f"{significant(scale.factor * group[0].rmse_nm, 3)} {scale.unit}"
        note = ", with the one from the frequency response" if first in group else ""
        lines.append(f"  {left:>12}  {_starts_in(group):<10} {words[group[0].outcome]}{note}")
    rest = [start for group in groups[_SHOWN:] for start in group]
    if rest:
        lines.append(f"  {'more':>12}  {_starts_in(rest):<10} elsewhere, discarded")
    return lines


def _starts_in(group: Sequence[Start]) -> str:
    return f"{len(group)} start" + ("" if len(group) == 1 else "s")


def _validation(found: Flexible) -> list[str]:
    """Return the table of the runs that the fit has not seen (thesis 4.3.1)."""
    lines = [f"Not validated: {reason}." for reason in found.not_validated]
    if not found.unseen:
        return [*lines, "Not validated: name runs that the fit has not seen with --validation."]
    if not found.validations:
        return lines
    shown = [v.flexible.torque_rmse_nm for v in found.validations]
    scale = scale_for("N m", (*shown, *(v.rigid.torque_rmse_nm for v in found.validations)))
    width = max(len("Runs not seen"), *(len(v.recording) for v in found.validations))
    left = f"torque left, {scale.unit}"
    lines += [
        f"{'Runs not seen':<{width}}  {left:^19}  {'torque fit, %':^17}  {'velocity fit, %':^17}",
        f"{'':<{width}}  {'flexible':>9} {'rigid':>9}" + f"  {'flexible':>8} {'rigid':>8}" * 2,
    ]
    for v in found.validations:
        row = f"{v.recording:<{width}} "
        for joint in (v.flexible, v.rigid):
            row += f" {significant(scale.factor * joint.torque_rmse_nm, 3):>9}"
        for name in ("torque_fit_percent", "velocity_fit_percent"):
            flexible, rigid = getattr(v.flexible, name), getattr(v.rigid, name)
            row += f"  {flexible:>8.1f} {rigid:>8.1f}"
        lines.append(row)
    lines.append(
        "Torque: what the measured motion needs. Velocity: simulated from the measured torque."
    )
    return lines
