"""Every form of every effect, and which of them some recordings can show."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agent.explain import forms_dynamic, forms_position, forms_sliding
from agent.explain.form import Form
from agent.explain.table import Table

FORMS: tuple[Form, ...] = (*forms_sliding.FORMS, *forms_position.FORMS, *forms_dynamic.FORMS)

_MISSING: Mapping[str, str] = {
    "gearbox_temperature_degc": "the gearbox temperature was not recorded",
    "motor_temperature_degc": "the motor temperature was not recorded",
    "position_rad": "the position was not recorded",
    "elapsed_s": "the recordings do not say when they began",
}
_CONSTANT: Mapping[str, tuple[str, float]] = {
    "gearbox_temperature_degc": ("the gearbox temperature hardly changed", 2.0),
    "motor_temperature_degc": ("the motor temperature hardly changed", 2.0),
}


def judgeable(table: Table) -> tuple[tuple[Form, ...], dict[str, str]]:
    """Return the forms that a table can show, and for every other effect why not.

    Parameters
    ----------
    table : Table
    """
    reasons = {name: words for name, words in _MISSING.items() if not table.has(name)}
    for name, (words, least) in _CONSTANT.items():
        values = table.rows[name][table.used]
        if name not in reasons and float(np.ptp(values)) < least:
            reasons[name] = words
    shown = tuple(f for f in FORMS if not any(need in reasons for need in f.needs))
    effects = {f.effect for f in shown}
    out = {}
    for form in FORMS:
        if form.effect not in effects:
            why = next(reasons[need] for need in form.needs if need in reasons)
            out[form.effect] = f"{why}, so {form.effect} cannot be judged"
    return shown, out
