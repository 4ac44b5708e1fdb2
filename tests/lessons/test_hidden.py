"""What hides in the twin's own numbers without a name: their intervals reach over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.search import Library
from agent.explain.forms import cable
from agent.explain.numbers.hidden import reaching_over_the_unnamed
from agent.explain.numbers.intervals import with_intervals
from agent.explain.numbers.model import fit_model
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats, Parameter
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record, stair
from trajectories import SetPoints

HEAVY = replace(TWIN, gravity_sin_nm=0.3, gravity_cos_nm=0.2)
CABLE_NM = 0.006  # a radian of the arm: a quarter of the noise, at most


def weight_and_a_small_cable(points: SetPoints, at: Conditions) -> Floats:
    del at
    arm = points.position_rad / GEAR_RATIO
    return np.asarray(0.4 * np.sin(arm) + 0.2 * np.cos(arm) + CABLE_NM * (arm + 0.5))


def half(parameter: Parameter) -> float:
    assert parameter.ci95 is not None
    return 0.5 * (parameter.ci95[1] - parameter.ci95[0])


def test_a_cable_too_small_for_a_name_is_within_gravitys_interval_and_no_others() -> None:
    runs = [record(stair((5.0, 20.0, 60.0)), weight_and_a_small_cable, Conditions(), 1)]
    table = tabulate(HEAVY, runs)
    delta, left = refit(table)
    given = np.array([getattr(HEAVY, name) for name in BASE])
    scene = Scene(table, given + delta, np.where(table.used, left, 0.0), given=given)
    library = Library.of(scene, weigh(table, left), cable.FORMS)
    narrow = with_intervals(library, fit_model(library, HEAVY, ()))
    wide = reaching_over_the_unnamed(library, narrow)
    for name, true in (("gravity_sin_nm", 0.4), ("gravity_cos_nm", 0.2)):
        found = wide.base[name]
        assert found.ci95 is not None
        assert found.ci95[0] < true < found.ci95[1]
        assert half(found) < 0.05
    sine = narrow.base["gravity_sin_nm"]
    assert sine.ci95 is not None
    assert not sine.ci95[0] < 0.4 < sine.ci95[1]  # as it had been
    for name in ("inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm"):
        assert half(wide.base[name]) == pytest.approx(half(narrow.base[name]), rel=0.1)
