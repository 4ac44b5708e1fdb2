"""A step is no Stribeck fall, what lies before a reversal no presliding, a bolt no soft gear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.choice import choose
from agent.explain.choosing.misfits import misfits
from agent.explain.choosing.search import Library
from agent.explain.forms import arm, reversal, speed
from agent.explain.forms.form import Form, Point
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import tabulate
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, Missing, record, stair
from trajectories import SetPoints

SPEEDS = (2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
(FALL,) = (form for form in speed.FORMS if form.effect == "stribeck")
SPRINGS = list(arm.FORMS)
CHAIN = next(form for form in reversal.FORMS if form.name == "Maxwell slip")


def step(points: SetPoints, _at: Conditions) -> Floats:
    slow = np.abs(points.velocity_rad_s) < 24.0
    return np.asarray(-0.2 * slow * np.sign(points.velocity_rad_s))


def fall(points: SetPoints, _at: Conditions) -> Floats:
    velocity = points.velocity_rad_s
    return np.asarray(0.3 * np.exp(-((velocity / 6.0) ** 2)) * np.sign(velocity))


def sticking(points: SetPoints, _at: Conditions) -> Floats:
    """Return what holds a joint back in its first moments, which are not compared."""
    velocity = points.velocity_rad_s
    return np.asarray(2.0 * np.exp(-((velocity / 0.3) ** 2)) * np.sign(velocity))


def slower(points: SetPoints, _at: Conditions) -> Floats:
    """Return a brake that lets go just before the joint turns: whatever it is, no presliding."""
    velocity = points.velocity_rad_s
    stopping = (velocity * points.acceleration_rad_s2 < 0.0) & (np.abs(velocity) < 4.0)
    return np.asarray(-0.4 * stopping * np.sign(velocity))


def faster(points: SetPoints, _at: Conditions) -> Floats:
    velocity = points.velocity_rad_s
    starting = (velocity * points.acceleration_rad_s2 > 0.0) & (np.abs(velocity) < 20.0)
    return np.asarray(-0.4 * starting * np.sign(velocity))


@pytest.mark.parametrize(
    ("missing", "form", "point", "refused"),
    [
        (step, FALL, (28.0, 4.0), True),
        (fall, FALL, (6.0, 2.0), False),
        (fall, FALL, (6.5, 4.0), False),
        (sticking, FALL, (0.3, 2.0), True),
        (slower, CHAIN, (0.3, 5.0), True),
        (faster, CHAIN, (0.3, 5.0), False),
    ],
)
def test_a_law_that_copies_what_is_not_its_own_is_refused(
    missing: Missing, form: Form, point: Point, refused: bool
) -> None:
    library = library_of(missing)
    assert refused_of(library, form, point) == ({(form.effect, form.name)} if refused else set())


@pytest.mark.parametrize(("bands", "refused"), [(2.0, True), (1.2, False)])
@pytest.mark.parametrize("form", SPRINGS, ids=lambda f: f.name)
def test_a_spring_that_is_rigid_in_the_band_is_no_soft_gear(
    form: Form, bands: float, refused: bool
) -> None:
    """What it has left is friction that yields, or what a coarse encoder makes of a motion."""
    library = library_of(faster)
    arm = (bands * library.scene.table.cutoff_hz, 0.1, 1.0, 0.2)
    found = refused_of(library, form, arm[: len(form.nonlinear)])
    assert found == ({(form.effect, form.name)} if refused else set())


def library_of(missing: Missing) -> Library:
    """Return a recording of a joint without candidates."""
    table = tabulate(TWIN, [record(stair(SPEEDS), missing, Conditions(), 3)])
    moved, left = refit(table)
    theta = np.array([TWIN.inertia_kg_m2, TWIN.viscous_nm_s_per_rad, TWIN.coulomb_nm, 0.0, 0.0])
    scene = Scene(table, theta + moved, np.where(table.used, left, 0.0), given=theta)
    return Library.of(scene, weigh(table, left), ())


def refused_of(library: Library, form: Form, point: Point) -> set[tuple[str, str]]:
    """Return what is refused of a model of one law."""
    law = library.candidate(form, point)
    chosen = replace(choose(library), terms=())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(chosen), "candidates", (law,))
        return misfits(library, chosen)
