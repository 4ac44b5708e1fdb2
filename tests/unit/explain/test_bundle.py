"""What yields over degrees of an arm may be a bundle; a loss in all blocks is one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from agent.explain.answer.result import Alternative
from agent.explain.choosing.rivals import Term, _is_plainly_behind
from agent.explain.forms.library import FORMS
from agent.explain.look_alikes import (
    _as_likely,
    _yields_as_a_bundle,
    is_what_friction_lacks,
)
from agent.explain.rows.scene import Scene
from agent.explain.study import Study
from agent.identify.result import Parameter

DAHL = next(form for form in FORMS if form.name == "Dahl")


@pytest.mark.parametrize(
    ("travel_arm_rad", "gear_ratio", "is_one"),
    [(0.13, 83.0, True), (0.005, 83.0, False), (0.3, 1.0, False)],
)
def test_what_yields_over_degrees_of_an_arm_may_be_a_bundle(
    travel_arm_rad: float, gear_ratio: float, is_one: bool
) -> None:
    """A hose's inner friction was presliding for certain, over 7.7 degrees; a screw has no arm."""
    candidate = SimpleNamespace(form=DAHL, point=(travel_arm_rad * gear_ratio,))
    scene = cast("Scene", SimpleNamespace(table=SimpleNamespace(gear_ratio=gear_ratio)))
    term = cast("Term", SimpleNamespace(candidate=candidate))
    assert _yields_as_a_bundle(scene, term) is is_one


@pytest.mark.parametrize(("held_nm", "is_one"), [(0.445, True), (0.30, False)])
def test_a_bundle_that_holds_what_friction_lacks_may_be_that_friction(
    held_nm: float, is_one: bool
) -> None:
    """Two springs were a bundle of 0.445 N m, and Coulomb friction 0.654 and not 1.10."""
    lacks = {"coulomb_extra_nm": Parameter(-0.446, (-0.463, -0.368))}
    held = {"hysteresis_nm": Parameter(held_nm, (held_nm - 0.02, held_nm + 0.012))}
    study = SimpleNamespace(
        numbers=(SimpleNamespace(parameters=lacks),), model=SimpleNamespace(parameters=(held,))
    )
    assert is_what_friction_lacks(cast("Study", study)) is is_one


@pytest.mark.parametrize(("losing", "plain"), [(40, True), (28, False)])
def test_a_loss_in_every_block_is_plain_however_uneven(losing: int, plain: bool) -> None:
    """A weight stayed tied with a cable at 37 %, which left 2.3 times as much on unseen data."""
    best, loss = np.ones(40), 0.01 * np.ones(40)
    loss[:3] = 200.0  # the mean loss is hardly known: 1.7 of its own standard errors
    loss[losing:] *= -1.0
    assert _is_plainly_behind(best, best + loss, 4000.0) is plain


def test_what_is_as_likely_as_a_finding_leaves_its_rivals_their_half() -> None:
    rivals = [Alternative("stribeck", 0.5, ""), Alternative("backlash", 0.2, "")]
    told = _as_likely("presliding-hysteresis", "cable-force", rivals)
    assert [a.probability for a in told] == [0.5, 0.25, 0.1]
