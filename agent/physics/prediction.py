"""How a twin predicts torque: motion corrected, torques summed, and what the drive reports of it.

1. What distorts the measured motion (a late velocity, a resolver's error) is taken out of it.
2. Rigid body, gravity and friction, and what every effect adds; the arm behind spring and gap is
   simulated once.
3. What the drive makes of the sum: torque constant, limit, offset, delay.

Each step is kept apart, so that the parts add up to the whole.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.physics import rigid_body
from agent.physics.effects import (
    CARRIED,
    CORRECTED,
    HOLDING,
    REPORTED,
    SLIDING,
    YIELDING,
    Base,
    Boundary,
    Form,
    Motion,
    along_the_way,
    numbers_of,
)
from agent.physics.effects.carried import carried_parts_nm
from agent.physics.twin import DrivingFrictionError, Twin

Floats = NDArray[np.float64]
Smooth = Callable[[Floats], Floats]

PLAIN_PARTS: Mapping[str, tuple[str, ...]] = {
    "rigid-body": ("inertia_kg_m2",),
    "gravity": rigid_body.GRAVITY,
    "friction": ("coulomb_nm", "viscous_nm_s_per_rad"),
}
"""The parts of a plain twin and the parameters of thesis (4.5) that they are made of."""


@dataclass(frozen=True)
class _Entry:
    """One effect of a twin, resolved; `label` is its id, numbered where it comes again."""

    label: str
    id: str
    form: Form
    numbers: dict[str, float]


def predict_parts(twin: Twin, motion: Motion, smooth: Smooth | None = None) -> dict[str, Floats]:
    """Return the torque by part, each shape (n,); their sum is the prediction.

    Raises
    ------
    ValueError
        As `agent.physics.twin.Twin.predict_parts` says.
    """
    entries = _entries(twin)
    parts = _plain_parts(twin, motion)
    for entry in _in_order(entries, CORRECTED):
        if entry.form.corrected is None:
            continue
        before, motion = motion, entry.form.corrected(entry.numbers, motion)
        parts[entry.label] = _plain_nm(twin, motion) - _plain_nm(twin, before)
        # An arm that is carried is driven by the corrected motion, and lags by itself.
        if entry.form.added_nm is not None and not any(e.id in CARRIED for e in entries):
            parts[entry.label] += _added_nm(entry, before, _base(twin, entries, before))
    base = _base(twin, entries, motion)
    own = (*CARRIED, *CORRECTED)
    added = [e for e in entries if e.form.added_nm is not None and e.id not in own]
    held = {e.label: _added_nm(e, motion, base) for e in added if (e.id, e.form.name) in HOLDING}
    if held:
        base = replace(base, held_more_nm=_sum(held))
    for entry in sorted(added, key=lambda e: e.id == YIELDING):
        if entry.label in held:
            parts[entry.label] = held[entry.label]
            continue
        if entry.id == YIELDING:
            # Stribeck's level is known at rest, too: it stands among the base's boundaries.
            sliding = [parts[e.label] for e in added if e.id in SLIDING - {"stribeck"}]
            more = along_the_way(np.sum(sliding, axis=0), motion.direction) if sliding else None
            base = replace(base, sliding_more_nm=more)
        parts[entry.label] = _added_nm(entry, motion, base)
    yields = any(e.id == YIELDING for e in entries)
    base = replace(base, aged_more_nm=_aged_nm(added, motion, base), yields=yields)
    flexible, gap = (_numbers_of_one(entries, name) for name in CARRIED)
    parts |= carried_parts_nm(flexible, gap, motion, base)
    _refuse_driving_friction(entries, parts, motion)
    total = _sum(parts)
    for entry in _in_order(entries, REPORTED):
        if entry.form.reported_nm is None:
            continue
        before_nm, total = total, entry.form.reported_nm(entry.numbers, motion, total)
        parts[entry.label] = total - before_nm
    return parts if smooth is None else {name: smooth(part) for name, part in parts.items()}


def _entries(twin: Twin) -> list[_Entry]:
    """Return the twin's effects with their forms and numbers, or refuse them by name."""
    entries: list[_Entry] = []
    for effect in twin.effects:
        form, numbers = numbers_of(effect.id, effect.parameters)
        again = 1 + sum(e.id == effect.id for e in entries)
        if again > 1 and effect.id in CARRIED:
            raise ValueError(f"{effect.id} is there twice, and there is one arm")
        label = effect.id if again == 1 else f"{effect.id} {again}"
        entries.append(_Entry(label, effect.id, form, numbers))
    return entries


def _in_order(entries: Sequence[_Entry], order: Sequence[str]) -> list[_Entry]:
    return [entry for effect in order for entry in entries if entry.id == effect]


def _numbers_of_one(entries: Sequence[_Entry], effect: str) -> dict[str, float] | None:
    return next((entry.numbers for entry in entries if entry.id == effect), None)


def _refuse_driving_friction(
    entries: Sequence[_Entry], parts: Mapping[str, Floats], motion: Motion
) -> None:
    """Refuse a drift that has been carried on until friction would drive the joint."""
    levels = [e.label for e in entries if e.id in ("friction-drift", "wrong-number", "stribeck")]
    if any(e.id == "friction-drift" for e in entries):
        friction = parts["friction"] + sum(parts[label] for label in levels)
        if np.any(friction * motion.direction < 0.0):
            raise DrivingFrictionError(
                "effects: friction-drift: carried on to this recording it leaves friction below"
                " zero; the drift is known only near the recordings that it was found in."
            )


def _added_nm(entry: _Entry, motion: Motion, base: Base) -> Floats:
    assert entry.form.added_nm is not None
    try:
        return entry.form.added_nm(entry.numbers, motion, base)
    except ValueError as error:
        raise ValueError(f"{entry.label}: {error}") from error


def _aged_nm(added: Sequence[_Entry], motion: Motion, base: Base) -> Floats | None:
    """Return what age adds to the level of dry friction, shape (n,); None where it is not known."""
    ages = [entry for entry in added if entry.id == "friction-drift"]
    if not ages:
        return None
    dry = (
        {n: 0.0 if n.startswith("viscous") else value for n, value in entry.numbers.items()}
        for entry in ages
    )
    more = [
        _added_nm(replace(entry, numbers=own), motion, base)
        for entry, own in zip(ages, dry, strict=True)
    ]
    return along_the_way(np.sum(more, axis=0), motion.direction)


def _base(twin: Twin, entries: Sequence[_Entry], motion: Motion) -> Base:
    """Return the numbers that effects lean on, with what other effects say of the same numbers."""

    def extra(effect: str, name: str) -> float:
        return sum(e.numbers.get(name, 0.0) for e in entries if e.id == effect) + sum(
            e.numbers.get(f"{name}_per_kg", 0.0)
            * motion.payload_beyond_kg(e.numbers["reference_payload_kg"])
            for e in entries
            if e.id == effect and "reference_payload_kg" in e.numbers
        )

    names = ("static_extra_nm", "stribeck_velocity_rad_s", "exponent")
    return Base(
        twin.gear_ratio,
        twin.inertia_kg_m2,
        twin.coulomb_nm + extra("wrong-number", "coulomb_extra_nm"),
        twin.gravity_sin_nm + extra("gravity-imbalance", "gravity_sin_nm"),
        twin.gravity_cos_nm + extra("gravity-imbalance", "gravity_cos_nm"),
        tuple(Boundary(*(e.numbers[n] for n in names)) for e in entries if e.id == "stribeck"),
        extra("gravity-imbalance", "inertia_kg_m2"),
    )


def _plain_parts(twin: Twin, motion: Motion) -> dict[str, Floats]:
    """Return rigid body, gravity and friction, each shape (n,)."""
    if motion.position_rad is None and (twin.gravity_sin_nm or twin.gravity_cos_nm):
        raise ValueError("gravity needs a motor position, and none was given")
    columns = rigid_body.regressor(
        motion.position_rad,
        motion.velocity_rad_s,
        motion.acceleration_rad_s2,
        motion.direction,
        twin.gear_ratio,
    )
    out = {}
    for part, names in PLAIN_PARTS.items():
        chosen = [rigid_body.PARAMETERS.index(name) for name in names]
        out[part] = columns[:, chosen] @ np.array([getattr(twin, name) for name in names])
    return out


def _plain_nm(twin: Twin, motion: Motion) -> Floats:
    return _sum(_plain_parts(twin, motion))


def _sum(parts: Mapping[str, Floats]) -> Floats:
    return np.asarray(np.sum(list(parts.values()), axis=0), dtype=np.float64)
