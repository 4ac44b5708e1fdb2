"""What recordings carry: payloads that they state and that differ, and what a kilogram adds.

A twin has one inertia and one gravity. Recordings with another payload differ from it by what is
known beforehand to be there: that is learnt first, and everything else is looked for beside it.
Else a few kilograms would hide all that is smaller, and no law of one joint would fit all of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.answer.amounts import percent
from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.result import Finding
from agent.explain.answer.said import Said
from agent.explain.choosing.materiality import MATERIAL, beyond
from agent.explain.rows.evidence import heldout, moments, weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats, Parameter
from agent.identify.rigid.linear import LinearFit, solve_blocks
from agent.numbers import scale_for, significant
from agent.physics.twin import Effect, Twin

EFFECT = "gravity-imbalance"
_OF = {
    "inertia_kg_m2": "inertia_kg_m2_per_kg",
    "gravity_sin_nm": "gravity_sin_nm_per_kg",
    "gravity_cos_nm": "gravity_cos_nm_per_kg",
}
_LOADED = np.array([BASE.index(name) for name in _OF])
_FOLDS = 3
_HALF = 0.5  # of the mismatch
_QUARTER = 0.25  # of the noise's energy
_SAME_KG = 1e-6


@dataclass(frozen=True)
class Loads:
    """What every further kilogram adds to the torque.

    Parameters
    ----------
    numbers : mapping of str to Parameter
        As the twin's effect holds them.
    reference_kg : float
        The payload for which the twin's own numbers hold.
    torque_nm : ndarray, shape (n,)
        What it adds at the table's rows.
    """

    numbers: Mapping[str, Parameter]
    reference_kg: float
    torque_nm: Floats

    def carried_by(self, twin: Twin) -> Twin:
        """Return a twin that knows the payloads."""
        numbers = {name: p.value for name, p in self.numbers.items()}
        entry = Effect(EFFECT, {**numbers, "reference_payload_kg": self.reference_kg})
        return replace(twin, effects=(*twin.effects, entry))


def payloads(runs: Sequence[Run]) -> tuple[float, ...]:
    """Return the payloads that recordings state, from light to heavy, each once."""
    stated = sorted(run.payload_kg for run in runs if math.isfinite(run.payload_kg))
    return tuple(x for i, x in enumerate(stated) if i == 0 or x - stated[i - 1] > _SAME_KG)


def knows_payloads(twin: Twin) -> bool:
    """Return whether a twin has a law for the payloads that recordings state."""
    return any("reference_payload_kg" in effect.parameters for effect in twin.effects)


def stated_by(twin: Twin) -> float:
    """Return the payload that a twin's file says its numbers hold for; NaN where it says none."""
    body = twin.extra.get("rigid_body", {})
    for table in (twin.extra, body if isinstance(body, Mapping) else {}):
        value = table.get("payload_kg")
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return float(value)
    return math.nan


def without_unknown_loads(
    twin: Twin, runs: Sequence[Run], holdout: Sequence[Run]
) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return the hold-outs whose payload can be predicted, and why the others cannot.

    What a kilogram adds is known from two payloads at least, or to the twin.
    """
    known = payloads(runs)
    if len(known) != 1 or knows_payloads(twin):
        return tuple(holdout), ()
    kept, reasons = [], []
    for run in holdout:
        if not abs(run.payload_kg - known[0]) > _SAME_KG:  # nor where it is not known
            kept.append(run)
            continue
        reasons.append(
            f"{run.name} was left out of the proof: it carries {run.payload_kg:g} kg, and all "
            f"recordings to learn from carry {known[0]:g} kg, which does not say what another "
            "payload adds"
        )
    return tuple(kept), tuple(reasons)


def loads_of(twin: Twin, table: Table, beside_nm: Floats | None = None) -> Loads | None:
    """Return what payloads add that the twin does not know; None where that is not worth a word.

    Parameters
    ----------
    twin : Twin
    table : Table
        Of the twin as given.
    beside_nm : ndarray, shape (n,), optional
        What effects that were found add beside the twin; NaN where a recording does not say.
    """
    if beside_nm is not None:
        said = np.isfinite(beside_nm)
        table, beside_nm = replace(table, used=table.used & said), np.where(said, beside_nm, 0.0)
    known = payloads(table.runs)
    kinds = _LOADED[table.carried[_LOADED]]
    if len(known) < 2 or not kinds.size or table.simulated:
        return None
    reference = stated_by(twin)
    unstated = reference if math.isfinite(reference) else known[0]
    fit = _worth_fitting(twin, table, beside_nm, table.base[:, kinds] * _above(table, unstated))
    if fit is None:
        return None
    first = int(np.count_nonzero(table.carried))  # behind the twin's own numbers
    per_kg, moved = fit.theta[first:], np.zeros(len(BASE))
    moved[table.carried] = fit.theta[:first]
    if not math.isfinite(reference):
        # Of the payloads that are there, the one for which the twin's numbers need least moving.
        reference = min(
            known,
            key=lambda kg: float(
                np.sum((table.base[:, kinds] @ (moved[kinds] + per_kg * (kg - unstated))) ** 2)
            ),
        )
    numbers = {
        _OF[BASE[kind]]: Parameter(
            float(fit.theta[at]), (float(fit.ci95[at][0]), float(fit.ci95[at][1]))
        )
        for at, kind in enumerate(kinds, start=first)
    }
    torque = _above(table, reference)[:, 0] * (table.base[:, kinds] @ per_kg)
    return Loads(numbers, reference, np.asarray(torque))


def _above(table: Table, reference_kg: float) -> Floats:
    """Return by how much more than a payload every row carries, shape (n, 1); 0 if not known."""
    weight_kg = np.array([run.payload_kg for run in table.runs])
    above = np.where(np.isfinite(weight_kg), weight_kg - reference_kg, 0.0)
    return np.asarray(above[table.run][:, np.newaxis])


def _worth_fitting(
    twin: Twin, table: Table, beside_nm: Floats | None, more: Floats
) -> LinearFit | None:
    """Return the fit of the twin's own numbers, then of what is proportional to the payloads.

    None where that explains too little of recordings that it has not seen to be worth a word.
    """
    target = table.target_nm if beside_nm is None else table.target_nm - beside_nm
    weighing = weigh(table, np.where(table.used, refit(table, beside_nm)[1], 0.0))
    base = weighing.weighted(table.base)[:, table.carried]
    columns = np.concatenate((base, weighing.weighted(more)), axis=1)
    aim, starts = weighing.weighted(target), weighing.starts
    if starts.size <= columns.shape[1]:
        return None
    fold = np.arange(starts.size) % _FOLDS
    plain = heldout(moments(base, aim, starts), fold)
    full = heldout(moments(columns, aim, starts), fold)
    least = MATERIAL * float(plain.sum())
    if knows_payloads(twin):  # a law's number is put right where it costs half the noise
        least = max(least, _QUARTER * float(full.sum()))
    if beyond(plain - full, least) < 0.0:
        return None
    blocks = np.zeros(aim.shape[0], dtype=np.int64)
    blocks[starts] = 1
    return solve_blocks(columns, columns, aim, np.cumsum(blocks))


def differs_unsaid(table: Table) -> str:
    """Return that recordings differ as payloads do which nobody has stated; nothing otherwise.

    Where inertia and gravity that each recording has for itself remove half of what is left.

    Parameters
    ----------
    table : Table
    """
    kinds, runs = _LOADED[table.carried[_LOADED]], np.unique(table.run[table.used])
    if not kinds.size or runs.size < 2 or len(payloads(table.runs)) > 1:
        return ""
    weighing = weigh(table, np.where(table.used, refit(table)[1], 0.0))
    base = weighing.weighted(table.base)[:, table.carried]
    own = [
        weighing.weighted(table.base[:, kinds] * (table.run == r)[:, np.newaxis]) for r in runs[1:]
    ]
    columns, aim = np.concatenate((base, *own), axis=1), weighing.weighted(table.target_nm)
    fold = np.arange(weighing.starts.size) % _FOLDS
    plain = heldout(moments(base, aim, weighing.starts), fold)
    full = heldout(moments(columns, aim, weighing.starts), fold)
    if beyond(plain - full, _HALF * float(plain.sum())) < 0.0:
        return ""
    return (
        "inertia and gravity differ from recording to recording, as they do where the arm carries "
        "something else: with payload_kg in the recordings' metadata that is told apart"
    )


def load_finding(loads: Loads, given_nm: Floats, left_nm: Floats, floor_nm: float) -> Finding:
    """Return the finding that the simulation does not know what its recordings carry.

    Parameters
    ----------
    loads : Loads
    given_nm, left_nm : ndarray, shape (m,)
        What the twin as given leaves, and what it leaves once it knows the payloads.
    floor_nm : float
    """
    before = max(float(np.mean(given_nm**2)) - floor_nm**2, 1e-300)
    after = max(float(np.mean(left_nm**2)) - floor_nm**2, 0.0)
    share = min(max(1.0 - after / before, 0.0), 1.0)
    return Finding(
        effect=EFFECT,
        rank=1,
        probability=1.0,
        energy_share=share,
        where=(),
        said=Said(
            "The simulation does not know what the recordings say that the arm carries: beyond "
            f"{loads.reference_kg:g} kg every kilogram adds {_per_kg(loads.numbers)}.",
            worth=f"This explains {percent(share)} of the difference to the simulation as given.",
        ),
        parameters=loads.numbers,
        holdout_rmse_without_nm=float(np.sqrt(np.mean(given_nm**2))),
        form=OWN_NUMBER,
    )


def _per_kg(numbers: Mapping[str, Parameter]) -> str:
    """Return what a kilogram adds: gravity at its greatest, and inertia."""
    parts = []
    gravity = [p.value for name, p in numbers.items() if name.startswith("gravity")]
    if gravity:
        parts.append(_amount(math.hypot(*gravity), "N m", "of gravity's torque"))
    inertia = numbers.get("inertia_kg_m2_per_kg")
    if inertia is not None:
        parts.append(_amount(inertia.value, "kg m²", "of inertia"))
    return " and ".join(parts)


def _amount(value: float, unit: str, of: str) -> str:
    scale = scale_for(unit, (value,))
    return f"{significant(value * scale.factor, 3)} {scale.unit} {of}"


def said_of(runs: Sequence[Run], twin: Twin, loads: Loads | None) -> tuple[str, ...]:
    """Return what is to be borne in mind of the payloads that recordings state."""
    known, stated = payloads(runs), stated_by(twin)
    out = []
    silent = [run.name for run in runs if not math.isfinite(run.payload_kg)]
    if loads is not None:
        groups = "; ".join(
            f"{kg:g} kg: {', '.join(r.name for r in runs if abs(r.payload_kg - kg) <= _SAME_KG)}"
            for kg in known
        )
        out.append(
            f"the recordings carry different payloads ({groups}), and the simulation's own "
            f"numbers are taken to hold for {loads.reference_kg:g} kg: what another payload adds "
            "to inertia and gravity was learnt first, and everything else is judged beside it"
        )
        if silent:
            out.append(
                f"{', '.join(silent)} do{'es' if len(silent) == 1 else ''} not say what the arm "
                f"carries, and {'is' if len(silent) == 1 else 'are'} taken to carry "
                f"{loads.reference_kg:g} kg"
            )
    elif (
        len(known) == 1
        and not knows_payloads(twin)
        and math.isfinite(stated)
        and abs(known[0] - stated) > _SAME_KG
    ):
        out.append(
            f"the simulation's numbers are for {stated:g} kg, and the recordings carry "
            f"{known[0]:g} kg: where its inertia or gravity is wrong, that is why"
        )
    return tuple(out)
