"""An explanation's errors against its noise: tiles, table and proof, as they are written."""

from __future__ import annotations

import math
from dataclasses import dataclass

from agent.explain.answer.result import Explanation, Fit, Holdout
from agent.numbers import Scale, fixed, scale_for, significant, units_unbroken
from agent.report.explanation.words import percent
from agent.report.rows import Tile

_AT_FLOOR = 1.05
"""Up to here an error is the noise: the verdicts' own threshold."""


@dataclass(frozen=True)
class ErrorRow:
    """One stage of the simulation: its error on the data fitted, and on data not seen."""

    label: str
    rmse: str
    fit: str
    unseen_rmse: str
    unseen_fit: str


def tiles(explanation: Explanation) -> tuple[Tile, ...]:
    """Return the key numbers: error before and after, noise, and how much was removed."""
    before, refitted, after = stages(explanation)
    floor_nm, scale = explanation.floor.value_nm, error_scale(explanation)
    shown = [
        _tile("Error as given", before.rmse_nm, scale, _refitted(refitted, scale)),
        _tile("Error with the findings", after.rmse_nm, scale, _times_floor(after, floor_nm))
        if explanation.findings
        else None,
        _tile("Noise floor", floor_nm, scale, _routes(explanation, scale)),
        _removed(explanation),
    ]
    return tuple(tile for tile in shown if tile is not None)


def stages(explanation: Explanation) -> tuple[Fit, Fit, Fit]:
    """Return given, refitted and extended on data not seen; on the data fitted without such."""
    holdout = explanation.holdout
    if holdout is None:
        return explanation.baseline, explanation.refitted, explanation.extended
    return holdout.baseline, holdout.refitted, holdout.extended


def judged_on(explanation: Explanation) -> str:
    """Say which data the key errors are of."""
    holdout = explanation.holdout
    return "the data fitted" if holdout is None else holdout.source


def error_scale(explanation: Explanation) -> Scale:
    """Return the one unit in which this explanation's errors and its noise are written."""
    fits = (explanation.baseline, explanation.refitted, explanation.extended)
    return scale_for("N m", [fit.rmse_nm for fit in (*fits, *stages(explanation))])


def in_scale(value_nm: float, scale: Scale) -> str:
    """Write a torque in a unit that is given."""
    return f"{significant(value_nm * scale.factor, 3)} {scale.unit}"


def error_rows(explanation: Explanation) -> tuple[str, tuple[ErrorRow, ...]]:
    """Return the unit, and the error of every stage as written."""
    fitted = (explanation.baseline, explanation.refitted, explanation.extended)
    unseen = stages(explanation) if explanation.holdout else (Fit(), Fit(), Fit())
    scale = error_scale(explanation)
    labels = ("Simulation as given", "Its numbers refitted", "Extended by the findings")
    rows = [
        ErrorRow(
            label,
            significant(seen.rmse_nm * scale.factor, 3),
            fixed(seen.fit_percent, 1),
            significant(proof.rmse_nm * scale.factor, 3),
            fixed(proof.fit_percent, 1),
        )
        for label, seen, proof in zip(labels, fitted, unseen, strict=True)
        if math.isfinite(seen.rmse_nm) or math.isfinite(proof.rmse_nm)
    ]
    if math.isfinite(explanation.floor.value_nm):
        noise = significant(explanation.floor.value_nm * scale.factor, 3)
        rows.append(ErrorRow("Noise floor", noise, "", noise if explanation.holdout else "", ""))
    return scale.unit, tuple(rows)


def proof_facts(explanation: Explanation) -> tuple[tuple[str, str], ...]:
    """Return the proof as label and text, with its own null test."""
    holdout = explanation.holdout
    if holdout is None:
        return ()
    facts = [("Judged on", holdout.source)]
    if math.isfinite(holdout.improvement_percent):
        facts.append(("Error removed", improvement_in_words(holdout)))
    if math.isfinite(holdout.floor_ratio):
        facts.append(
            ("What is left", f"{significant(holdout.floor_ratio, 3)} times the noise floor")
        )
    if holdout.blocks:
        facts.append(("Blocks predicted better", f"{holdout.wins} of {holdout.blocks}"))
    if math.isfinite(holdout.placebo_percent):
        facts.append(("Placebo (shifted axes)", f"{percent(holdout.placebo_percent, 1)} removed"))
    facts.append(("Looks like noise", "yes" if holdout.white else "no, structure is left"))
    return tuple(facts)


def improvement_in_words(holdout: Holdout) -> str:
    """Return how much of the error was removed, with its interval."""
    text = percent(holdout.improvement_percent, 1)
    if holdout.improvement_ci95_percent is not None:
        low, high = holdout.improvement_ci95_percent
        text += f" (95 %: {fixed(low, 1)} to {fixed(high, 1)})"
    return text


def floor_rows(explanation: Explanation) -> tuple[tuple[str, str, str], ...]:
    """Return the routes to the noise floor: name, value, how it is taken."""
    floor, scale = explanation.floor, error_scale(explanation)
    routes = (
        (
            "Repeated passes",
            floor.repeats_nm,
            "the same motion driven again: what differs is noise",
        ),
        ("Neighbouring samples", floor.neighbours_nm, "what one sample has that the next has not"),
        ("Standstill", floor.standstill_nm, "torque while the joint stands still"),
    )
    return tuple(
        (name, in_scale(value, scale) if math.isfinite(value) else "not there", how)
        for name, value, how in routes
    )


def _removed(explanation: Explanation) -> Tile | None:
    holdout = explanation.holdout
    if (
        holdout is None
        or not explanation.findings
        or not math.isfinite(holdout.improvement_percent)
    ):
        return None
    interval = holdout.improvement_ci95_percent
    return Tile(
        "Error removed",
        fixed(holdout.improvement_percent, 1),
        "%",
        "" if interval is None else f"95 %: {fixed(interval[0], 1)} to {fixed(interval[1], 1)}",
    )


def _tile(label: str, value_nm: float, scale: Scale, detail: str) -> Tile | None:
    if not math.isfinite(value_nm):
        return None
    number = significant(value_nm * scale.factor, 3)
    return Tile(label, number, scale.unit, units_unbroken(detail))


def _refitted(refitted: Fit, scale: Scale) -> str:
    if not math.isfinite(refitted.rmse_nm):
        return ""
    return f"numbers refitted: {in_scale(refitted.rmse_nm, scale)}"


def _times_floor(fit: Fit, floor_nm: float) -> str:
    if not floor_nm > 0.0:
        return ""
    ratio = fit.rmse_nm / floor_nm
    return "the noise floor" if ratio <= _AT_FLOOR else f"{significant(ratio, 3)} times the noise"


def _routes(explanation: Explanation, scale: Scale) -> str:
    floor = explanation.floor
    routes = [
        value
        for value in (floor.repeats_nm, floor.neighbours_nm, floor.standstill_nm)
        if math.isfinite(value)
    ]
    if len(routes) < 2:
        return "one route"
    low, high = (significant(end * scale.factor, 3) for end in (min(routes), max(routes)))
    return f"{low} to {high} {scale.unit} by {len(routes)} routes"
