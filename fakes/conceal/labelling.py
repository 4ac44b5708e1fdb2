"""What a label says: effects, where they live, and which share of the mismatch is whose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from fakes.conceal.compared import BANDS_HZ, compared, low_passed
from fakes.conceal.concealment import Basis, Region
from fakes.conceal.kernel import arm_loads_nm
from fakes.conceal.measure import Floats, Seen
from fakes.conceal.outsiders import PREFIX
from fakes.conceal.refit import Motion
from fakes.conceal.rehearsal import Rehearsal, known_numbers
from fakes.conceal.small import Put, all_in, difference_nm
from fakes.conceal.truth import Truth

MATERIAL = 0.02
"""Share of the residual's energy from which a nuisance is worth naming, and naming it is right."""

VISIBLE = 0.2
"""Of an effect's greatest torque: there its place ends."""

HARD_RAD = 2e-4
"""Of the motor: contacts that slip after so little are as good as rigid to an encoder."""

_BINS = 200
_OF_THE_RUNS = frozenset({"recording", "gearbox_temperature_degc", "motor_temperature_degc"})


def describe(rehearsal: Rehearsal, small: Sequence[Put], large: Sequence[Put]) -> dict[str, Any]:
    """Return what is true of a case, ready for JSON.

    ``energy_share`` of an effect is what the refitted structure's squared residual loses when this
    effect alone is taken away, over what it loses when all are; correlated effects need not sum to
    one. ``energy_share_by_band`` says the same of what is compared in a band of so many hertz, for
    the effects of a mixture: one alone has all of it in every band. Nuisances are logged with the
    mean square by which they move the residual, and its share of all of it, noise included.
    """
    robot = rehearsal.robot
    basis = _common_basis(large)
    without = rehearsal.fit(rehearsal.see(all_in(robot.truth, small)), basis).rms_nm ** 2
    seen = rehearsal.see(all_in(robot.truth, [*small, *large]))
    everything = rehearsal.fit(seen, basis)
    excess = max(everything.rms_nm**2 - without, 0.0)
    reach = _reach(rehearsal, seen, all_in(robot.truth, [*small, *large]))
    found = []
    for index, put in enumerate(large):
        rest = [*small, *large[:index], *large[index + 1 :]]
        left = rehearsal.fit(rehearsal.see(all_in(robot.truth, rest)), basis).rms_nm ** 2
        share = (everything.rms_nm**2 - left) / excess if excess > 0.0 else 0.0
        found.append(_entry(rehearsal, put, small, large, reach) | {"energy_share": share})
        if put.concealment.effect == "backlash":
            found[-1]["where"] = [r.to_json() for r in _under_loads(rehearsal, small, large, index)]
    if len(large) > 1 and basis != "commanded":
        for entry, shares in zip(found, _in_bands(rehearsal, small, large, basis), strict=True):
            entry["energy_share_by_band"] = shares
    residual = everything.rms_nm**2 + rehearsal.floor_nm**2
    nuisances = []
    for put in small:
        energy = put.moved_nm[basis] ** 2
        nuisances.append(
            _entry(rehearsal, put, small, large, reach)
            | {
                "energy_nm2": energy,
                "share_of_residual": energy / residual,
                "counts_as_true": energy >= MATERIAL * residual,
            }
        )
    if all(put.concealment.effect != "joint-flexibility" for put in large):
        nuisances.append(_own_spring(rehearsal, residual))
    if all(put.concealment.effect != "presliding-hysteresis" for put in large):
        nuisances.append(_own_yielding(rehearsal, residual))
    return {
        "effects": found,
        "nuisances": nuisances,
        "noise_floor_nm": rehearsal.floor_nm,
        "basis": basis,
        "excess_nm": excess**0.5,
        "snr_reached": excess**0.5 / rehearsal.floor_nm,
        "structure_left_nm": without**0.5,
        "base": known_numbers(robot.truth),
        "refitted": everything.numbers,
        "gear_ratio": robot.truth.gear_ratio,
        "sensing": asdict(robot.sensing),
        "expected_verdict": _verdict(large),
    }


def _under_loads(
    rehearsal: Rehearsal, small: Sequence[Put], large: Sequence[Put], index: int
) -> list[Region]:
    """Return the loads on the gear under which an effect shows, as a comparison sees it.

    Where its torque is a fifth of its greatest, or more. When a gap is crossed depends on the
    motion, and how far, so that it is read off what the joint does with it and without it.
    """
    truth, hertz = all_in(rehearsal.robot.truth, [*small, *large]), BANDS_HZ[-1]
    without = all_in(rehearsal.robot.truth, [*small, *large[:index], *large[index + 1 :]])
    seen, period_s = rehearsal.see(truth), 1.0 / rehearsal.robot.sensing.sample_rate_hz
    rows = compared(seen, truth.gear_ratio, period_s, hertz)
    one, other = (rehearsal.banded(t, truth, hertz).residual_nm for t in (truth, without))
    added = np.concatenate([(a - b)[r] for a, b, r in zip(one, other, rows, strict=True)])
    load = np.concatenate(
        [
            low_passed(_gear_load_nm(truth, s.motion)[:, np.newaxis], period_s, hertz)[r, 0]
            for s, r in zip(seen, rows, strict=True)
        ]
    )
    edges = np.linspace(float(load.min()), float(load.max()), _BINS + 1)
    index_of = np.clip(np.searchsorted(edges, load, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(index_of, minlength=_BINS)
    mean = np.bincount(index_of, np.abs(added), _BINS) / np.maximum(count, 1)
    energy = np.bincount(index_of, added**2, _BINS)
    there = np.flatnonzero(count)
    visible = (mean[there] >= VISIBLE * mean.max()).astype(np.int8)
    ends = np.flatnonzero(np.diff(visible, prepend=0, append=0))
    parts = [there[begin:end] for begin, end in zip(ends[::2], ends[1::2], strict=True)]
    return [
        Region("load_torque_nm", float(edges[part[0]]), float(edges[part[-1] + 1]))
        for part in parts
        if energy[part].sum() >= MATERIAL * energy.sum()
    ]


def _in_bands(
    rehearsal: Rehearsal, small: Sequence[Put], large: Sequence[Put], basis: Basis
) -> list[list[dict[str, float]]]:
    """Return every effect's share of what a mixture leaves in each band, where it is compared."""
    every = all_in(rehearsal.robot.truth, [*small, *large])
    plain = all_in(rehearsal.robot.truth, small)
    rest = [
        all_in(rehearsal.robot.truth, [*small, *large[:index], *large[index + 1 :]])
        for index in range(len(large))
    ]
    out: list[list[dict[str, float]]] = [[] for _ in large]
    for hertz in BANDS_HZ:
        whole, none, *others = (
            rehearsal.banded(truth, every, hertz, basis).rms_nm ** 2
            for truth in (every, plain, *rest)
        )
        for shares, left in zip(out, others, strict=True):
            share = (whole - left) / (whole - none) if whole > none else 0.0
            shares.append({"up_to_hz": hertz, "energy_share": share})
    return out


def _own_spring(rehearsal: Rehearsal, residual_nm2: float) -> dict[str, Any]:
    """Return what a stiff gear leaves after all: no joint is rigid."""
    truth = rehearsal.robot.truth
    energy = rehearsal.fit(rehearsal.see(truth)).rms_nm ** 2
    return {
        "effect": "joint-flexibility",
        "also": [],
        "form": "the stiff gear's own",
        "basis": "refitted",
        "snr": energy**0.5 / rehearsal.floor_nm,
        "parameters": {"stiffness_nm_per_rad": truth.stiffness_nm_per_rad},
        "where": [],
        "energy_nm2": energy,
        "share_of_residual": energy / residual_nm2,
        "counts_as_true": energy >= MATERIAL * residual_nm2,
    }


def _own_yielding(rehearsal: Rehearsal, residual_nm2: float) -> dict[str, Any]:
    """Return what it changes that all contacts give way before they slip, if only a little."""
    truth = rehearsal.robot.truth
    yields, hard = (
        rehearsal.fit(rehearsal.see(each))
        for each in (truth, truth._replace(presliding_rad=HARD_RAD))
    )
    energy = difference_nm(rehearsal, yields, hard) ** 2
    return {
        "effect": "presliding-hysteresis",
        "also": [],
        "form": "the contacts' own",
        "basis": "refitted",
        "snr": energy**0.5 / rehearsal.floor_nm,
        "parameters": {"sliding_travel_rad": 2.0 * truth.presliding_rad},
        "where": [],
        "energy_nm2": energy,
        "share_of_residual": energy / residual_nm2,
        "counts_as_true": energy >= MATERIAL * residual_nm2,
    }


def _common_basis(large: Sequence[Put]) -> Basis:
    """Return the basis on which all effects together show."""
    bases = {put.concealment.basis for put in large}
    if "as-given" in bases:
        return "as-given"
    return "commanded" if "commanded" in bases else "refitted"


def _verdict(large: Sequence[Put]) -> str:
    if not large:
        return "no-mismatch"
    outside = [put.concealment.effect.startswith(PREFIX) for put in large]
    if all(outside):
        return "unexplained"
    return "partly-explained" if any(outside) else "explained"


def _entry(
    rehearsal: Rehearsal,
    put: Put,
    small: Sequence[Put],
    large: Sequence[Put],
    reach: Mapping[str, tuple[float, float]],
) -> dict[str, Any]:
    truth = all_in(rehearsal.robot.truth, [*small, *large])
    concealment = put.concealment
    return {
        "effect": concealment.effect,
        "also": list(concealment.also),
        "form": concealment.form,
        "basis": concealment.basis,
        "snr": put.snr,
        "parameters": dict(concealment.parameters(truth)),
        "where": [_driven(region, reach).to_json() for region in concealment.where(truth)],
    }


def _reach(
    rehearsal: Rehearsal, seen: Sequence[Seen], truth: Truth
) -> dict[str, tuple[float, float]]:
    """Return how far the runs reach along each variable: all but a thousandth at either end."""
    states = [run.state for run in rehearsal.runs]
    motions = [s.motion for s in seen]
    arm = np.concatenate([m.position_rad for m in motions]) / truth.gear_ratio
    load = np.concatenate([_gear_load_nm(truth, m) for m in motions])
    return {
        "recording": (0.0, len(states) - 1.0),
        "gearbox_temperature_degc": (
            min(s.oil_degc for s in states),
            max(s.oil_degc for s in states),
        ),
        "motor_temperature_degc": (
            min(s.winding_degc for s in states),
            max(s.winding_degc for s in states),
        ),
        "arm_position_rad": _nearly_all(arm),
        "load_torque_nm": _nearly_all(load),
    }


def _gear_load_nm(truth: Truth, motion: Motion) -> Floats:
    """Return the load on the gear, shape (n,).

    What the arm weighs, is pulled and dragged by, and resists when it is accelerated.
    """
    direction = np.sign(motion.velocity_rad_s)
    held = arm_loads_nm(truth, motion.position_rad / truth.gear_ratio, direction)
    behind_gear = truth.arm_inertia_kg_m2 + truth.tool_inertia_kg_m2
    return held + behind_gear * motion.acceleration_rad_s2 + truth.arm_coulomb_nm * direction


def _nearly_all(values: Floats) -> tuple[float, float]:
    low, high = np.quantile(values, [0.001, 0.999])
    return float(low), float(high)


def _driven(region: Region, reach: Mapping[str, tuple[float, float]]) -> Region:
    """Return the region as far as the runs reach."""
    low, high = reach.get(region.variable, (-math.inf, math.inf))
    if region.variable in _OF_THE_RUNS:
        return Region(region.variable, low, high)
    return Region(region.variable, max(region.low, low), min(region.high, high))
