"""Friction that falls with warmth, down to what the twin says: its number is right, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.forms.library import FORMS
from agent.explain.numbers.model import fit_model
from agent.explain.numbers.wrong import wrong_numbers
from agent.identify.result import Floats
from tests.lessons.test_worth import bare
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, record, stair
from trajectories import SetPoints


@pytest.mark.parametrize(("given", "said"), [(1.0, []), (0.7, ["wrong-number"])])
def test_a_number_to_which_friction_falls_with_warmth_is_not_called_wrong(
    given: float, said: list[str]
) -> None:
    """Warmer than all recordings the twin would be right: it lacks what oil adds, and no more."""

    def adds(points: SetPoints, at: Conditions) -> Floats:
        return np.asarray(0.01 * np.exp((20.0 - at.gearbox_degc) / 12.0) * points.velocity_rad_s)

    runs = [
        record(stair((5, 20, 60), 100.0, 12.0), adds, Conditions(gearbox_degc=t), k)
        for k, t in enumerate((20.0, 25.0, 30.0, 35.0))
    ]
    twin = replace(TWIN, viscous_nm_s_per_rad=given * TWIN.viscous_nm_s_per_rad)
    plain = bare(*runs, twin=twin)
    library = Library.of(
        plain.scene, plain.weighing, [form for form in FORMS if form.name == "viscosity"]
    )
    choice = choose(library)
    model = fit_model(library, twin, choice.terms)
    numbers = wrong_numbers(library, twin, model, choice.candidates, NOISE_NM)
    assert [number.effect for number in numbers] == said
