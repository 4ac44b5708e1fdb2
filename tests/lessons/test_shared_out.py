"""Laws that only share out what has no name are none: their sizes reach over nothing beside it."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.forms.library import FORMS
from agent.explain.numbers.model import fit_model
from agent.explain.unnamed import may_be_the_unnamed
from agent.identify.result import Floats
from tests.lessons.test_worth import bare
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints


@pytest.mark.parametrize("one_sided_nm", [0.0, 0.1])
def test_a_brake_now_and_then_is_no_one_sided_friction(one_sided_nm: float) -> None:
    """It held more often on the way there than on the way back."""
    spells = np.random.default_rng(2).uniform(0.0, 60.0, 5)

    def brakes(points: SetPoints, _at: Conditions) -> Floats:
        time = np.arange(points.velocity_rad_s.shape[0]) / 250.0
        held = np.any(np.abs(time[:, np.newaxis] - spells) < 0.6, axis=1)
        return np.asarray(0.2 * held * np.sign(points.velocity_rad_s) + one_sided_nm)

    plain = bare(record(stair((20, 40, 60), 500.0, 60.0), brakes, Conditions(), 3))
    forms = [f for f in FORMS if f.effect in ("direction-asymmetry", "local-fault")]
    library = Library.of(plain.scene, plain.weighing, forms)
    sided = [f for f in forms if (f.effect, f.name) == ("direction-asymmetry", "Coulomb")]
    (found,) = Library.of(plain.scene, plain.weighing, sided).rank([])
    model = fit_model(library, TWIN, [Term(found, 0.0)])
    assert may_be_the_unnamed(library, model) is (one_sided_nm == 0.0)
