"""Places of the arm have shapes of their own: one place is told once, with its shape."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from agent.explain.answer.result import Finding
from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record, stair
from trajectories import SetPoints

CYCLE = stair((5, 15, 30, 60), 2.0 * GEAR_RATIO, 30.0)
Shape = Callable[[Floats], Floats]


def trapezoid(arm_rad: Floats) -> Floats:
    return np.clip((0.36 - np.abs(arm_rad + 0.1)) / 0.1, 0.0, 1.0)


def leaning(arm_rad: Floats) -> Floats:
    away = arm_rad + 0.4
    return np.where(away > 0.0, np.exp(-away / 0.4), np.exp(away / 0.04))


def dent(arm_rad: Floats) -> Floats:
    away = (arm_rad - 0.3) / 0.06
    return np.asarray(away * np.exp(0.5 - 0.5 * away**2))


def named(shape: Shape, height_nm: float, *, rubs: bool) -> tuple[Finding, ...]:
    """Return what is found of a torque along the arm, of friction where it rubs."""

    def missing(points: SetPoints, at: Conditions) -> Floats:
        del at
        torque = height_nm * shape(points.position_rad / GEAR_RATIO)
        return torque * np.sign(points.velocity_rad_s) if rubs else torque

    runs = [record(CYCLE, missing, Conditions(started_s=100.0 * k), k) for k in range(4)]
    return explain(TWIN, runs[:3], runs[3:]).findings


@pytest.mark.parametrize("shape", [trapezoid, leaning])
def test_a_patch_of_friction_is_one_place_whatever_its_shape(shape: Shape) -> None:
    """A flat one was told twice, and one that leans three times, tied with a fault."""
    (patch,) = named(shape, 0.05, rubs=True)
    assert patch.effect == "position-dependent-friction"
    assert not patch.alternatives
    (where,) = patch.where
    stroke = np.linspace(-1.0, 1.0, 2001)
    high = stroke[shape(stroke) > 0.2]
    assert where.lower == pytest.approx(high[0], abs=0.06)
    assert where.upper == pytest.approx(high[-1], abs=0.06)
    assert patch.parameters["height_nm"].value == pytest.approx(0.05, rel=0.1)


def test_a_patch_that_leans_is_told_as_it_leans() -> None:
    (patch,) = named(leaning, 0.05, rubs=True)
    found = {name: p.value for name, p in patch.parameters.items()}
    assert found["center_arm_rad"] == pytest.approx(-0.4, abs=0.02)
    assert found["shape_exponent"] == pytest.approx(1.0, abs=0.2)
    assert found["width_above_arm_rad"] == pytest.approx(0.2, rel=0.2)  # e^-1/2 of an e^-1 per 0.4
    assert found["width_arm_rad"] < 0.25 * found["width_above_arm_rad"]


def test_a_dent_that_holds_the_arm_back_is_one_fault() -> None:
    """It was two bumps beside each other, neither of which explained much."""
    (fault,) = named(dent, 0.08, rubs=False)
    assert fault.effect == "local-fault"
    assert not fault.alternatives
    (where,) = fault.where
    assert where.lower < 0.25 < 0.35 < where.upper
    assert "up to ±" in fault.said.lead
    assert fault.parameters["dent_nm"].value == pytest.approx(0.08, rel=0.05)
    assert fault.parameters["center_arm_rad"].value == pytest.approx(0.3, abs=0.005)
    assert fault.parameters["width_arm_rad"].value == pytest.approx(0.06, rel=0.05)


def test_a_bell_stays_a_bell() -> None:
    (patch,) = named(lambda arm: np.exp(-0.5 * (arm / 0.15) ** 2), 0.05, rubs=True)
    assert patch.form == "tight spot"
