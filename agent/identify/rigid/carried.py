"""Which columns of the rigid body a motion carries, and why it does not carry the others."""

from __future__ import annotations

import numpy as np

from agent.identify.result import Floats
from agent.identify.rigid.rows import Rows
from agent.physics.rigid_body import GRAVITY, PARAMETERS

INFLATION = 1000.0  # a parameter's variance against that with all other columns orthogonal
_LEAKS = 0.03  # of one part of gravity: what the other one has of it at most where it is left out
_DROP_FIRST = (*GRAVITY, "inertia_kg_m2", "torque_offset_nm", "viscous_nm_s_per_rad")


def left_out(rows: Rows) -> dict[str, str]:
    """Return the columns that this motion does not carry, with the reason for each."""
    reasons: dict[str, str] = {}
    if not np.isfinite(rows.arm_stroke_rad):
        for name in GRAVITY:
            reasons[name] = "no position was recorded"
    if rows.inertia_hidden:
        reasons["inertia_kg_m2"] = rows.inertia_hidden
    while True:
        kept = [i for i, name in enumerate(PARAMETERS) if name not in reasons]
        inflation = dict(
            zip(
                [PARAMETERS[i] for i in kept],
                variance_inflation(rows.some(kept)).tolist(),
                strict=True,
            )
        )
        mixed = [name for name in _DROP_FIRST if inflation.get(name, 0.0) > INFLATION]
        if not mixed:
            return reasons
        constant = [name for name in GRAVITY if name in mixed]
        if len(constant) == 1 and _is_constant(constant[0], kept, rows):
            reasons[constant[0]] = _mixed_reason(constant[0], rows, alone=True)
            continue
        for name in GRAVITY if mixed[0] in GRAVITY else mixed[:1]:
            reasons[name] = _mixed_reason(name, rows)


def _is_constant(name: str, kept: list[int], rows: Rows) -> bool:
    """Return whether one part of gravity can go without the other one having to stand in for it.

    About the angle at which the arm hangs, its cosine hardly changes and its sine does: that is
    told on any stroke. Where both change, leaving one out would bend the other.
    """
    others = [i for i in kept if PARAMETERS[i] != name]
    share = np.linalg.lstsq(rows.some(others), rows.some([PARAMETERS.index(name)]), rcond=None)[0]
    leaks = [share[others.index(i)] for i in others if PARAMETERS[i] in GRAVITY]
    return bool(leaks) and abs(float(leaks[0][0])) < _LEAKS


def variance_inflation(columns: Floats) -> Floats:
    """Return how much each parameter's variance grows because the columns are not orthogonal.

    Diagonal of the inverse of the columns' Gram matrix, columns scaled to unit length: 1 for an
    orthogonal column, infinite for one that the others make up. No mean is taken away: the
    constant is one of the columns.

    Parameters
    ----------
    columns : ndarray, shape (N, p)
    """
    gram = columns.T @ columns
    length = np.sqrt(np.diag(gram))
    out = np.full(columns.shape[1], np.inf)
    alive = length > 0.0
    unit = gram[np.ix_(alive, alive)] / np.outer(length[alive], length[alive])
    values, vectors = np.linalg.eigh(unit)
    usable = np.maximum(values, 1e-13)
    out[alive] = np.einsum("ij,j->i", vectors**2, 1.0 / usable)
    return out


def _mixed_reason(name: str, rows: Rows, *, alone: bool = False) -> str:
    """Say why a column cannot be told from the others."""
    if name in GRAVITY:
        degrees = np.degrees(rows.arm_stroke_rad)
        part = {"gravity_sin_nm": "this sine", "gravity_cos_nm": "this cosine"}[name]
        return (
            f"on a stroke of {degrees:.3g} degrees of the arm, {part if alone else 'gravity'} "
            "cannot be told from a constant torque"
        )
    constant = (
        "moving one way, a constant torque cannot be told from friction"
        if rows.one_way
        else "on this motion a constant torque cannot be told from gravity and friction together"
    )
    return {
        "inertia_kg_m2": "the acceleration cannot be told from the other columns",
        "torque_offset_nm": constant,
        "viscous_nm_s_per_rad": "at one speed, viscous friction cannot be told from Coulomb",
    }[name]
