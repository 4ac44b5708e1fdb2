"""Friction that differs between the directions brakes in both: a larger constant is an offset."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from agent.explain.findings import findings_of
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints


def beside(points: SetPoints, at: Conditions, *, offset_nm: float) -> Floats:
    del at
    return np.full_like(points.velocity_rad_s, offset_nm)


@pytest.mark.parametrize(("offset_nm", "may_be_friction"), [(0.2, True), (2.0, False)])
def test_a_constant_beyond_all_friction_is_no_difference_of_the_directions(
    offset_nm: float, may_be_friction: bool
) -> None:
    """Of 6.7 N m on a joint with 1.6 N m of friction it was said with half of the probability."""
    cycle = stair([8.0, 20.0, 45.0, 80.0])
    runs = [record(cycle, partial(beside, offset_nm=offset_nm), Conditions(), k) for k in range(2)]
    (finding,) = findings_of(study(TWIN, tabulate(TWIN, runs)))
    assert finding.effect == "torque-offset" or may_be_friction
    others = {other.effect for other in finding.alternatives}
    assert ("direction-asymmetry" in {finding.effect, *others}) is may_be_friction
