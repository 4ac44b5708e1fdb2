"""How far numbers may be off where the arm's weight is held as the twin has it.

A hose may stand for a part of the weight, so that both are not fitted at once where the stroke does
not tell them apart. But a twin's weight is a number as others are, a few percent off; what follows
from that for a hose's stiffness is a large part of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model
from agent.explain.numbers.reach import Reach
from agent.explain.numbers.short_stroke import PAYLOAD
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.table import GRAVITY_AT
from agent.identify.result import Floats
from agent.physics.rigid_body import GRAVITY
from agent.physics.twin import Twin

_OFF = 0.025  # of the weight, one standard deviation: a twin's that was once identified
_USUAL = 2.0  # standard deviations
_SURE = 1.96


def reaching_over_the_weight(
    library: Library, columns: Floats, residual: Floats, reach: Reach
) -> Reach:
    """Return a reach that holds what a weight a few percent off would make of the numbers.

    How far off it is the recordings say as well, as far as they can: it is fitted beside the
    numbers, with what a twin's weight usually is off for as much as it is worth.

    Parameters
    ----------
    library : Library
        With a payload among its candidates, if it is a question.
    columns : ndarray, shape (m, p)
        Weighted derivatives of the prediction by the model's numbers.
    residual : ndarray, shape (m,)
        Weighted, what the model leaves.
    reach : Reach
    """
    payload = next((c for c in library.candidates if c.form is PAYLOAD), None)
    weight_nm = float(np.linalg.norm(library.scene.as_given[GRAVITY_AT]))
    if payload is None or not weight_nm > 0.0:
        return reach
    copies = np.linalg.lstsq(columns, payload.columns, rcond=None)[0]
    beyond = payload.columns - columns @ copies
    size = effective_size(library.scene.table, library.weighing, residual)
    noise = float(residual @ residual) / max(size, 1.0)
    information = beyond.T @ beyond / noise + np.eye(2) / (_OFF * weight_nm) ** 2
    off_nm = np.linalg.solve(information, beyond.T @ residual / noise)
    moved = -copies @ off_nm
    spread = np.sqrt(np.einsum("ij,jk,ik->i", copies, np.linalg.inv(information), copies))
    below = moved - np.hypot(reach.below, _SURE * spread)
    above = moved + np.hypot(reach.above, _SURE * spread)
    return replace(
        reach, below=np.minimum(reach.below, below), above=np.maximum(reach.above, above)
    )


def is_usual(twin: Twin, model: Model) -> bool:
    """Return whether the weight that a model refits is off by no more than a twin's usually is."""
    given = np.array([getattr(twin, name) for name in GRAVITY])
    off = np.array([model.base[name].value for name in GRAVITY]) - given
    return float(np.linalg.norm(off)) <= _USUAL * _OFF * float(np.linalg.norm(given))
