"""Two laws that together bend a twin's number below zero are found, though neither leaves a joint.

Friction that bends down with speed takes viscous friction below zero in every fit without it; so no
stronger law beside it leaves a joint that could be, and without that one it is too weak to be seen.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.search import Library
from agent.explain.forms.library import FORMS
from agent.explain.numbers.anew import chosen_anew
from agent.explain.numbers.resting import is_possible
from agent.identify.result import Floats
from tests.lessons.test_worth import bare
from tests.science.explain_joint import Conditions, record, stair
from trajectories import SetPoints


def bends(points: SetPoints) -> Floats:
    speed = points.velocity_rad_s
    return np.asarray(-np.sqrt(np.abs(speed) / 60.0) * np.sign(speed))


def library_of_both(ripple_nm: float) -> Library:
    def missing(points: SetPoints, _at: Conditions) -> Floats:
        return bends(points) + ripple_nm * np.cos(3.0 * points.position_rad)

    plain = bare(record(stair((2, 5, 10, 20, 40, 60), 100.0, 30.0), missing, Conditions(), 4))
    named = {("torque-ripple", "one order"), ("viscous-nonlinear", "power law")}
    forms = [form for form in FORMS if (form.effect, form.name) in named]
    return Library.of(plain.scene, plain.weighing, forms)


def test_a_strong_law_beside_which_no_joint_is_left_is_found_with_the_one_that_bends() -> None:
    library = library_of_both(0.4)
    assert not is_possible(library, ())
    found, choice = chosen_anew(library)
    effects = {term.scored.form.effect for term in choice.terms}
    assert effects == {"torque-ripple", "viscous-nonlinear"}
    assert is_possible(found, choice.candidates)
    assert not found.lenient


def test_a_joint_that_no_pair_makes_possible_has_no_name_either() -> None:
    library = library_of_both(0.4)
    ripples = tuple(c for c in library.candidates if c.form.effect == "torque-ripple")
    alone = Library.of(library.scene, library.weighing, list({c.form: None for c in ripples}))
    assert not chosen_anew(alone)[1].terms
