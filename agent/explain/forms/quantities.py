"""An effect's numbers under the names that a twin gives them, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent.explain.forms.form import Form
from agent.explain.rows.scene import Scene
from agent.identify.result import Parameter
from agent.physics.twin import TwinError

_Entry = Mapping[str, Any]

_SETTLED = 1e-9
_FROM_ELSEWHERE = 0.3  # of an interval: moved along all of it, the law's number moves by less
_NO_LAW = "the simulation's own law predicts no better with it"
NOT_NEEDED = "within the intervals of its form's numbers the twin does as well without it"
"""Why a number of the twin is not identified where an end of an interval is no effect at all."""


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
        The form's own where its twin has none, or more than one set of them. Where the law of a
        hidden state predicts no better with any, not identified: what the simulation of it does
        not bear out is no measurement. Nor is one of two numbers whose product alone is known.
    """
    values = {name: p.value for name, p in own.items()}
    tables = form.to_twin(scene, values)
    if not tables and form.at_edges:
        return {
            key: Parameter.not_identified(_NO_LAW, _possible(form, key, p))
            for key, p in own.items()
        }
    if len(tables) != 1:
        return own
    # A trial point that stands for a coefficient has no interval beside the coefficient's.
    trial = () if form.point_of is None else form.nonlinear
    free = {key: p for key, p in own.items() if key not in trial}
    moved = {key: _moved(form, scene, values, key, p) for key, p in free.items()}
    out: dict[str, Parameter] = {}
    as_product = form.known_as_product(own)
    for name, value in tables[0].items():
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            continue  # an instant is no quantity
        if name in own and own[name].value == value:
            out[name] = own[name]
        elif as_product:
            out[name] = Parameter.not_identified(as_product, float(value))
        else:
            out[name] = _converted(free, moved, name, float(value))
    return out


def _possible(form: Form, name: str, found: Parameter) -> float:
    """Return a number, or none where physics does not have it: no arm has less than no inertia."""
    sign = form.sign(form.linear.index(name)) if name in form.linear else 0
    return found.value if sign * found.value >= 0.0 else math.nan


def _moved(
    form: Form, scene: Scene, values: Mapping[str, float], key: str, parameter: Parameter
) -> Sequence[_Entry]:
    """Return the twin's numbers with one of the form's at either end of its interval.

    A number without an interval is nudged, to see which of the twin's depend on it.
    """
    if not parameter.identified or parameter.ci95 is None:
        ends: Sequence[float] = (values[key] * 1.01 + 1e-9,)
    else:
        ends = parameter.ci95
    return [_entry(form, scene, {**values, key: end}) for end in ends]


def _entry(form: Form, scene: Scene, values: Mapping[str, float]) -> _Entry:
    """Return the twin's numbers; nothing where its law refuses such, as an arm without inertia."""
    try:
        tables = form.to_twin(scene, values)
    except TwinError:
        return {}
    return tables[0] if tables else {}


def _converted(
    own: Mapping[str, Parameter], moved: Mapping[str, Sequence[_Entry]], name: str, value: float
) -> Parameter:
    """Return one number of the twin's with the interval that the form's numbers give it."""
    scale = max(abs(value), 1e-12)
    square_low = square_high = 0.0
    for key, parameter in own.items():
        if not parameter.identified or parameter.ci95 is None:
            nudged = _there(moved[key][0], name)
            if parameter.identified or (
                nudged is not None and abs(nudged - value) <= _SETTLED * scale
            ):
                continue
            return Parameter.not_identified(parameter.reason, value)
        ends = [_there(entry, name) for entry in moved[key]]
        if any(end is None for end in ends):
            return Parameter.not_identified(NOT_NEEDED, value)
        moves = [end - value for end in ends if end is not None]
        square_low += min(*moves, 0.0) ** 2
        square_high += max(*moves, 0.0) ** 2
    if max(square_low, square_high) <= (_FROM_ELSEWHERE * _half_width(own.get(name))) ** 2:
        return _around(value, own.get(name))
    return Parameter(
        value, (value - float(np.sqrt(square_low)), value + float(np.sqrt(square_high)))
    )


def _half_width(own: Parameter | None) -> float:
    return 0.0 if own is None or own.ci95 is None else 0.5 * (own.ci95[1] - own.ci95[0])


def _around(value: float, own: Parameter | None) -> Parameter:
    """Return a number that the law has from elsewhere, as widely known as the form's own of it."""
    if own is None or own.ci95 is None:
        return Parameter(value, None)
    low, high = own.ci95
    return Parameter(value, (value - (own.value - low), value + (high - own.value)))


def _there(entry: _Entry, name: str) -> float | None:
    """Return one number of the twin's; None where the values asked for a law without it."""
    return float(entry[name]) if name in entry else None
