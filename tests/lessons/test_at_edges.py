"""Contacts that yield within an edge alone show nowhere that is compared, and that is said."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.at_edges import edges_of
from agent.explain.explain import explain
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from agent.physics.friction_dynamic import Dahl
from tests.science.explain_joint import RATE_HZ, TWIN, Conditions, record, stair
from trajectories import SetPoints

SLOWLY = stair((1.0, 3.0, 10.0), 12.0, 40.0)


@pytest.mark.parametrize(("travel_rad", "said"), [(0.012, True), (1e-4, False)])
def test_contacts_that_yield_within_an_edge_are_not_judged(travel_rad: float, said: bool) -> None:
    """A joint whose friction is off by half of itself for a tenth of its motion was "explained"."""

    def yielding(points: SetPoints, at: Conditions) -> Floats:
        del at
        time = np.arange(points.velocity_rad_s.shape[0]) / RATE_HZ
        law = Dahl(TWIN.coulomb_nm, TWIN.coulomb_nm / travel_rad)
        at_once = TWIN.coulomb_nm * np.sign(points.velocity_rad_s)
        return np.asarray(law.torque_nm(time, points.velocity_rad_s) - at_once)

    runs = [record(SLOWLY, yielding, Conditions(), k) for k in range(2)]
    found = study(TWIN, tabulate(TWIN, runs))
    assert found.choice.terms == ()
    assert bool(edges_of(found)) is said
    assert ("Not compared is how friction builds up" in explain(TWIN, runs, ()).sentence) is said
