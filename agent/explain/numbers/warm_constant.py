"""A torque constant that falls as the magnets warm, and at which warmth it is the simulation's own.

Data sheets give it cold. A fit finds it at the mean temperature of the recordings, a little off in
all of the twin's numbers alike; that is no second error beside the law.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.search import Library
from agent.explain.numbers.factor import factor_column
from agent.explain.numbers.model import Model

_CONSTANT, _PER_K = "torque-constant-error", "factor_per_k"
_MOTOR_T = "motor_temperature_degc"
_BEYOND = 0.25  # of the recorded temperatures' range, on either side


def right_at_degc(library: Library, model: Model) -> float | None:
    """Return at which of the motor's temperatures a torque constant that falls is the twin's own.

    Parameters
    ----------
    library : Library
    model : Model
        Base and effects fitted together.

    Returns
    -------
    float or None
        None where no such law was found, or that is far from what was recorded.
    """
    scene = library.scene
    for term, numbers in zip(model.terms, model.parameters, strict=True):
        if term.scored.form.effect != _CONSTANT or _PER_K not in numbers:
            continue
        columns = [factor_column(library), *(t.candidate.columns for t in model.terms)]
        # All of the twin's torque grows by as much as its constant is less.
        more = float(np.linalg.lstsq(np.concatenate(columns, axis=1), library.target)[0][0])
        low, high = scene.span(_MOTOR_T)
        margin = _BEYOND * (high - low)
        at = scene.mean(_MOTOR_T) + more / (1.0 + more) / numbers[_PER_K].value
        if low - margin <= at <= high + margin:
            return at
    return None
