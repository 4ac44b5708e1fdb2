"""A drift that was found in a recording without a date has nothing that a twin could count from."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from agent.explain.forms.drift import FORMS

DRIFTS = FORMS


def scene(started_s: float) -> Any:
    """Return what the drift's entries ask of a scene of one recording."""
    table = SimpleNamespace(runs=(SimpleNamespace(started_s=started_s),))
    return SimpleNamespace(
        table=table, mean=lambda _name: 10.0, full=lambda _name: np.array([0.0, 20.0])
    )


@pytest.mark.parametrize("form", DRIFTS, ids=lambda form: form.name)
def test_a_drift_is_written_with_its_date_or_not_at_all(form: Any) -> None:
    values = dict.fromkeys((*form.linear, *form.nonlinear), 1.0)
    assert form.to_twin(cast(Any, scene(math.nan)), values) == ()
    (entry,) = form.to_twin(cast(Any, scene(1.7e9)), values)
    (dated,) = (value for name, value in entry.items() if name.endswith("_at"))
    assert dated.startswith("2023-11-14T22:13")
