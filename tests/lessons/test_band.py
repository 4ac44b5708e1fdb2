"""Friction that differs in one band of speeds alone is no law of speed, however near one comes."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.choosing.band import only_in_a_band
from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.forms import speed
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import tabulate
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, Missing, record, stair
from trajectories import SetPoints

LAWS = [form for form in speed.FORMS if form.effect in ("stribeck", "viscous-nonlinear")]
CYCLE = stair([4.0, 12.0, 20.0, 27.0, 35.0, 43.0, 55.0, 90.0])


def dip(points: SetPoints, _at: Conditions) -> Floats:
    """Return friction that is lower in one band of speeds: nearly a fall to it."""
    velocity = points.velocity_rad_s
    bell = np.exp(-(((np.abs(velocity) - 35.0) / 12.0) ** 2))
    return np.asarray(-0.04 * bell * np.sign(velocity))


def fall(points: SetPoints, _at: Conditions) -> Floats:
    """Return Stribeck friction of another form than the library's: a slow tail."""
    velocity = points.velocity_rad_s
    return np.asarray(0.15 / (1.0 + (velocity / 9.0) ** 2) * np.sign(velocity))


def bend(points: SetPoints, _at: Conditions) -> Floats:
    """Return oil that is thinned by shear, by a law that the library has not."""
    velocity = points.velocity_rad_s
    return np.asarray(0.3 * np.tanh(np.abs(velocity) / 40.0) * np.sign(velocity))


@pytest.mark.parametrize(
    ("missing", "found", "refused"),
    [
        (dip, "stribeck", {(form.effect, form.name) for form in LAWS}),
        (fall, "stribeck", set()),
        (bend, "viscous-nonlinear", set()),
    ],
)
def test_a_dip_is_no_fall_and_a_fall_of_another_form_is_one(
    missing: Missing, found: str, refused: set[tuple[str, str]]
) -> None:
    table = tabulate(TWIN, [record(CYCLE, missing, Conditions(), 3)])
    moved, left = refit(table)
    theta = np.array([TWIN.inertia_kg_m2, TWIN.viscous_nm_s_per_rad, TWIN.coulomb_nm, 0.0, 0.0])
    scene = Scene(table, theta + moved, np.where(table.used, left, 0.0), given=theta)
    library = Library.of(scene, weigh(table, left), LAWS)
    choice = choose(library)
    assert choice.terms[0].scored.form.effect == found
    assert only_in_a_band(library, choice) == refused
