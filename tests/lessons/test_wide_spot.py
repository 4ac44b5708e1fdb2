"""A tight spot as wide as half of the stroke, in another form than ours, is told in its width."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.choosing import choice
from agent.explain.choosing.choice import choose
from agent.explain.choosing.entry import cancelling
from agent.explain.choosing.search import Library
from agent.explain.forms.library import FORMS
from agent.identify.result import Floats
from tests.lessons.test_worth import bare
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, Conditions, record, stair
from trajectories import SetPoints


def test_a_wide_spot_is_not_cut_to_a_narrow_one() -> None:
    def cosine(points: SetPoints, _at: Conditions) -> Floats:
        away = np.clip((points.position_rad / GEAR_RATIO - 0.2) / 0.8, -1.0, 1.0)
        return np.asarray(0.1 * (1.0 + np.cos(np.pi * away)) * np.sign(points.velocity_rad_s))

    plain = bare(record(stair((10, 30, 60), 200.0, 40.0), cosine, Conditions(), 1))
    spots = tuple(f for f in FORMS if f.name == "tight spot")
    library = Library.of(plain.scene, plain.weighing, spots)
    (term,) = choose(library, rivals=False).terms
    centre, width = term.candidate.point
    assert abs(centre - 0.2) < 0.05
    assert 0.25 < width < 0.35  # a bell like a raised cosine: 0.36 of its half width
    left = library.residual([term.candidate]) / library.weighing.weight
    assert np.std(left) < 0.8 * NOISE_NM


def spot_beside_an_offset() -> Library:
    def both(points: SetPoints, _at: Conditions) -> Floats:
        away = (points.position_rad / GEAR_RATIO - 0.6) / 0.1
        return np.asarray(0.05 + 0.05 * np.exp(-0.5 * away**2))

    plain = bare(record(stair((10, 30, 60), 200.0, 30.0), both, Conditions(), 1))
    forms = tuple(f for f in FORMS if f.effect in ("local-fault", "torque-offset"))
    return Library.of(plain.scene, plain.weighing, forms)


def test_a_spot_that_made_up_for_an_offset_gives_it_back() -> None:
    """Found first, a spot near the stroke's end is wide enough to stand for the offset, too."""
    spot, offset = choose(spot_beside_an_offset(), rivals=False).terms
    assert (spot.scored.form.name, offset.scored.form.name) == ("bump", "constant")
    np.testing.assert_allclose(spot.candidate.point, (0.6, 0.1), rtol=0.05)
    np.testing.assert_allclose(offset.scored.coefficients, 0.05, rtol=0.05)


def test_a_search_that_takes_back_whatever_enters_comes_to_an_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each fold's own point makes a newcomer worth more than the one at which it is weighed."""
    monkeypatch.setattr(choice, "_pruned", lambda lib, terms, *_: (terms[:1], lib.errors([])))
    assert len(choose(spot_beside_an_offset(), rivals=False).terms) == 1


def test_a_spot_at_the_strokes_very_end_lies_there() -> None:
    """Less than a hundredth of the samples are beyond its middle."""
    end = 1.0  # rad of the arm: half of the stroke
    middle = 0.995 * end

    def at_the_end(points: SetPoints, _at: Conditions) -> Floats:
        away = (points.position_rad / GEAR_RATIO - middle) / 0.05
        return np.asarray(0.15 * np.exp(-0.5 * away**2) * np.sign(points.velocity_rad_s))

    plain = bare(record(stair((10, 30, 60), 200.0, 40.0), at_the_end, Conditions(), 1))
    assert plain.scene.stroke_arm_rad()[1] < middle - 0.01 < plain.scene.ends_arm_rad()[1]
    spots = tuple(f for f in FORMS if f.name == "tight spot")
    library = Library.of(plain.scene, plain.weighing, spots)
    (term,) = choose(library, rivals=False).terms
    assert abs(term.candidate.point[0] - middle) < 0.007


def test_two_laws_that_take_each_other_back_are_none() -> None:
    """A tenth of a width apart, two bells make their own slope, of many times its size."""

    def slope_of_a_bell(points: SetPoints, _at: Conditions) -> Floats:
        away = (points.position_rad / GEAR_RATIO - 0.3) / 0.1
        return np.asarray(0.1 * away * np.exp(-0.5 * away**2) * np.sign(points.velocity_rad_s))

    plain = bare(record(stair((10, 30, 60), 200.0, 30.0), slope_of_a_bell, Conditions(), 1))
    (spot,) = (f for f in FORMS if f.name == "tight spot")
    library = Library.of(plain.scene, plain.weighing, (spot,))
    apart = [library.candidate(spot, (at, 0.1)) for at in (0.2, 0.4)]
    near = [library.candidate(spot, (at, 0.1)) for at in (0.295, 0.305)]
    assert not cancelling(library, apart)
    assert cancelling(library, near)
    assert not cancelling(library, near[:1])
