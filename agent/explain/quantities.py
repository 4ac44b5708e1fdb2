"""An effect's numbers under the names that a twin gives them, with their intervals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agent.explain.form import Form
from agent.explain.scene import Scene
from agent.identify.result import Parameter

_SETTLED = 1e-9
_NOT_NEEDED = "within the intervals of its form's numbers the twin does as well without it"


def as_in_twin(form: Form, scene: Scene, own: Mapping[str, Parameter]) -> Mapping[str, Parameter]:
    """Return a form's numbers as the extended twin holds them.

    What the twin's law calls otherwise is converted, and half an interval follows from moving every
    number of the form to the end of its own, the moves taken as independent.

    Parameters
    ----------
    form : Form
    scene : Scene
    own : mapping of str to Parameter
        The form's numbers as they were fitted.

    Returns
    -------
    mapping of str to Parameter
        The form's own where its twin has none, or more than one set of them.
    """
    values = {name: p.value for name, p in own.items()}
    tables = form.to_twin(scene, values)
    if len(tables) != 1:
        return own
    out: dict[str, Parameter] = {}
    for name, value in tables[0].items():
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            continue  # an instant is no quantity
        if name in own and own[name].value == value:
            out[name] = own[name]
        else:
            out[name] = _converted(form, scene, own, name, float(value))
    return out


def _converted(
    form: Form, scene: Scene, own: Mapping[str, Parameter], name: str, value: float
) -> Parameter:
    """Return one number of the twin's with the interval that the form's numbers give it."""
    values = {key: p.value for key, p in own.items()}
    scale = max(abs(value), 1e-12)
    square_low = square_high = 0.0
    for key, parameter in own.items():
        if not parameter.identified or parameter.ci95 is None:
            moved = _there(form, scene, values | {key: values[key] * 1.01 + 1e-9}, name)
            if parameter.identified or (
                moved is not None and abs(moved - value) <= _SETTLED * scale
            ):
                continue
            return Parameter.not_identified(parameter.reason, value)
        ends = [_there(form, scene, values | {key: end}, name) for end in parameter.ci95]
        if any(end is None for end in ends):
            return Parameter.not_identified(_NOT_NEEDED, value)
        moves = [end - value for end in ends if end is not None]
        square_low += min(*moves, 0.0) ** 2
        square_high += max(*moves, 0.0) ** 2
    if square_low == square_high == 0.0:
        return Parameter(value, None)
    return Parameter(
        value, (value - float(np.sqrt(square_low)), value + float(np.sqrt(square_high)))
    )


def _there(form: Form, scene: Scene, values: Mapping[str, float], name: str) -> float | None:
    """Return one number of the twin's; None where these values ask for a law without it."""
    tables = form.to_twin(scene, values)
    return float(tables[0][name]) if tables and name in tables[0] else None
