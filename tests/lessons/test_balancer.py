"""A balancer's spring had been a lighter arm and a slack hose, both with a probability of one."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from agent.explain.driven_range import carries
from agent.explain.findings import findings_of
from agent.explain.numbers.model import with_numbers
from agent.explain.rows.refit import refit
from agent.explain.rows.table import BASE, tabulate
from agent.explain.study import Study, study
from agent.identify.result import Floats
from agent.physics.twin import Twin
from tests.science.explain_joint import (
    GEAR_RATIO,
    TWIN,
    Conditions,
    record,
    stair,
)
from trajectories import SetPoints

SIN_NM, COS_NM = 1.6, 0.2
SHORTER, LONGER, SHORTEST = 0.5, 1.0, -0.3  # levers, and the arm angle of the dead center
CYCLE = stair((3, 10, 30, 60), 2.4 * GEAR_RATIO, 30.0)
GIVEN = replace(TWIN, gravity_sin_nm=SIN_NM, gravity_cos_nm=COS_NM)


def hangs(
    points: SetPoints, at: Conditions, *, payload_nm: float, preload: float, stiffness: float
) -> Floats:
    """Return the arm's weight, a payload, and a spring by the force along its length."""
    del at
    arm = points.position_rad / GEAR_RATIO
    past = arm - SHORTEST
    length = np.sqrt(SHORTER**2 + LONGER**2 - 2.0 * SHORTER * LONGER * np.cos(past))
    force = preload + stiffness * length
    weight = SIN_NM * np.sin(arm) + (COS_NM + payload_nm) * np.cos(arm)
    return np.asarray(weight + force * SHORTER * LONGER * np.sin(past) / length)


def answered(given: Twin = GIVEN, **numbers: float) -> tuple[Study, dict[str, dict[str, float]]]:
    """Return the study of three recordings, and what was found by effect."""

    def joint(points: SetPoints, at: Conditions) -> Floats:
        return hangs(points, at, **numbers)

    runs = [record(CYCLE, joint, Conditions(started_s=100.0 * k), k) for k in range(3)]
    found = study(given, tabulate(given, runs))
    told = {f.effect: {n: p.value for n, p in f.parameters.items()} for f in findings_of(found)}
    return found, told


@pytest.mark.parametrize("stiffness", [0.0, 0.9])
def test_a_balancers_spring_is_told_by_its_levers_and_not_by_the_arms_weight(
    stiffness: float,
) -> None:
    """A force that grows with its length is a sine, too, which gravity's numbers would take."""
    found, told = answered(payload_nm=0.0, preload=-1.3, stiffness=stiffness)
    assert list(told) == ["cable-force"]
    spring = told["cable-force"]
    assert spring["balancer_nm"] == pytest.approx(-1.3 * SHORTER, rel=0.15)
    assert spring.get("balancer_stiffness_nm", 0.0) == pytest.approx(
        stiffness * SHORTER * LONGER, abs=0.1
    )
    assert spring["lever_ratio"] == pytest.approx(SHORTER / LONGER, abs=0.05)
    assert spring["dead_center_arm_rad"] == pytest.approx(SHORTEST, abs=0.02)
    assert found.left.ratio < 1.1


def test_a_payload_beside_it_is_told_and_what_it_may_be_instead() -> None:
    """It moves the weight another way than a simulation without a spring would."""
    found, told = answered(payload_nm=0.5, preload=-1.3, stiffness=0.0)
    assert set(told) == {"cable-force", "gravity-imbalance"}
    assert told["gravity-imbalance"]["gravity_cos_nm"] == pytest.approx(0.5, abs=0.1)
    assert told["cable-force"]["balancer_nm"] == pytest.approx(-1.3 * SHORTER, rel=0.2)
    assert "may in part be that" in carries(found)


def test_a_payload_alone_is_no_balancer() -> None:
    _, told = answered(payload_nm=0.5, preload=0.0, stiffness=0.0)
    assert list(told) == ["gravity-imbalance"]


def test_a_simulation_that_learnt_its_weight_with_the_spring_lacks_the_spring_alone() -> None:
    """What its weight is beside the spring is another number, and none that was wrong."""
    joint = partial(hangs, payload_nm=0.0, preload=-1.3, stiffness=0.0)
    delta, _ = refit(tabulate(GIVEN, [record(CYCLE, joint, Conditions(), 0)]))
    moved = {name: getattr(GIVEN, name) + d for name, d in zip(BASE, delta, strict=True)}
    _, told = answered(with_numbers(GIVEN, moved), payload_nm=0.0, preload=-1.3, stiffness=0.0)
    assert list(told) == ["cable-force"]
