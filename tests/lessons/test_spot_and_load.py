"""A weak law beside a strong one, whose own numbers the weak one had bent while it was unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.findings import findings_of
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, TWIN, Conditions, record, stair
from trajectories import SetPoints

GRAVITY_NM, PER_LOAD = 0.6, 0.4
TIGHT_NM, CENTER_RAD, WIDTH_RAD = 0.5, -0.19, 0.1


def heavy_arm_with_a_tight_spot(points: SetPoints, _at: Conditions) -> Floats:
    arm, along = points.position_rad / GEAR_RATIO, np.sign(points.velocity_rad_s)
    weight = GRAVITY_NM * np.sin(arm)
    spot = TIGHT_NM * np.exp(-0.5 * ((arm - CENTER_RAD) / WIDTH_RAD) ** 2)
    return np.asarray(weight + along * (PER_LOAD * np.abs(weight) + spot))


def test_friction_under_load_is_found_beside_a_tight_spot_that_had_stood_for_some_of_it() -> None:
    """Beside the spot where it stood alone, a second spot at the arm's lowest point did better."""
    twin = replace(TWIN, gravity_sin_nm=GRAVITY_NM)
    runs = [
        record(stair((3, 10, 30, 60), stroke, 20.0), heavy_arm_with_a_tight_spot, Conditions(), k)
        for k, stroke in enumerate((170.0, 200.0, 230.0))
    ]
    found = study(twin, tabulate(twin, runs))
    findings = {finding.effect: finding.parameters for finding in findings_of(found)}
    assert list(findings) == ["position-dependent-friction", "load-dependent-friction"]
    assert found.left.ratio < 1.05
    said = {name: p.value for numbers in findings.values() for name, p in numbers.items()}
    assert said["height_nm"] == pytest.approx(TIGHT_NM, abs=NOISE_NM)
    assert said["center_arm_rad"] == pytest.approx(CENTER_RAD, abs=0.002)
    assert said["load_coefficient"] == pytest.approx(PER_LOAD, abs=0.02)
