"""Friction that grows faster or more slowly than the load on the gear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.findings import findings_of
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record, stair
from trajectories import SetPoints

HEAVY = replace(TWIN, gravity_sin_nm=0.9)


@pytest.mark.parametrize("power", [0.6, 2.0])
def test_friction_that_grows_with_a_power_of_the_load_is_one_law_and_leaves_noise(
    power: float,
) -> None:
    """A law in proportion alone had friction of the path in its place, or beside it."""

    def missing(points: SetPoints, _at: Conditions) -> Floats:
        weight = 0.9 * np.sin(points.position_rad / GEAR_RATIO)
        rubs = 0.2 * 0.9 * np.abs(weight / 0.9) ** power
        return np.asarray(weight + rubs * np.sign(points.velocity_rad_s))

    cycle = stair((3, 10, 30, 80), 260.0, 20.0)
    runs = [record(cycle, missing, Conditions(), seed, name=f"run {seed}") for seed in (1, 2)]
    found = study(HEAVY, tabulate(HEAVY, runs))
    (law,) = findings_of(found)
    assert law.effect == "load-dependent-friction"
    assert law.parameters["load_power"].value == pytest.approx(power, rel=0.15)
    assert found.left.ratio < 1.1
    (entry,) = found.extended.effects
    hard_nm, per_load = (entry.parameters[n] for n in ("reference_load_nm", "load_coefficient"))
    told_nm = per_load * hard_nm * (0.5 / hard_nm) ** entry.parameters["load_power"]
    assert told_nm == pytest.approx(0.2 * 0.9 * (0.5 / 0.9) ** power, rel=0.15)
