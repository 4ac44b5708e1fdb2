"""The torque that laws in proportion to it take for the joint's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.choosing.candidate import Known
from tests.science.explain_joint import Conditions, library_of, nothing, record, stair


def test_a_law_in_proportion_to_the_torque_is_none_of_what_it_rests_on() -> None:
    """Known beside a late torque, such a ripple asked for the torque that it is a part of."""
    library = library_of([record(stair([12.0, 35.0]), nothing, Conditions(), 1)])
    ripples = [c for c in library.candidates if c.form.effect == "torque-ripple"]
    forms = {c.form: c for c in ripples if c.form.rests_on_numbers}
    assert forms
    known = tuple(Known(c, np.full(c.columns.shape[1], 0.01)) for c in forms.values())
    scene = replace(library.scene, beside=known)
    assert np.isfinite(scene.predicted_nm).all()
    own = library.scene.predicted_nm
    assert 0.0 < np.std(scene.predicted_nm - own) < 0.1 * np.std(own)
