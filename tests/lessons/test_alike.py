"""A wrong torque constant beside another wrong number had been three wrong numbers, or a payload.

With a probability of one each, and not a word on the constant: inertia, weight and friction, which
have nothing in common but the torque that they are told in, were all off by the same few percent.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.findings import findings_of
from agent.explain.rows.table import tabulate
from agent.explain.study import study
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

FACTOR = 0.93  # real over reported torque
WEIGHS = replace(TWIN, gravity_sin_nm=0.4, gravity_cos_nm=0.9)
CYCLE = stair((3, 10, 30, 60), 2.1 * GEAR_RATIO, 200.0)


def told(
    more: dict[str, float], offset_nm: float = 0.0, hose_nm: float = 0.0, twin: Twin = WEIGHS
) -> dict[str, dict[str, float]]:
    """Return what is found where the torque is reported too high and numbers are off besides."""
    joint = replace(twin, **{name: getattr(twin, name) * by for name, by in more.items()})

    def reported(points: SetPoints, at: Conditions) -> Floats:
        del at
        arm = points.position_rad / GEAR_RATIO
        motion = points.acceleration_rad_s2, points.velocity_rad_s, np.sign(points.velocity_rad_s)
        numbers = joint.inertia_kg_m2, joint.viscous_nm_s_per_rad, joint.coulomb_nm
        bare = TWIN.inertia_kg_m2, TWIN.viscous_nm_s_per_rad, TWIN.coulomb_nm
        weight = joint.gravity_sin_nm * np.sin(arm) + joint.gravity_cos_nm * np.cos(arm)
        real = weight + offset_nm + hose_nm * np.maximum(arm - 0.4, 0.0)
        for column, number, plain in zip(motion, numbers, bare, strict=True):
            # What the recorded joint has already is taken off, in the torque that is reported.
            real = real + column * (number - FACTOR * plain)
        return np.asarray(real / FACTOR)

    runs = [record(CYCLE, reported, Conditions(started_s=100.0 * k), k) for k in range(2)]
    found = findings_of(study(twin, tabulate(twin, runs)))
    return {f.effect: {n: p.value for n, p in f.parameters.items()} for f in found}


@pytest.mark.parametrize(
    ("effect", "more", "name", "extra"),
    [
        ("inertia-error", {"inertia_kg_m2": 0.8}, "inertia_extra_kg_m2", -0.2),
        ("wrong-number", {"coulomb_nm": 0.8}, "coulomb_extra_nm", -0.2),
        ("wrong-number", {"viscous_nm_s_per_rad": 1.4}, "viscous_extra_nm_s_per_rad", 0.4),
        (
            "gravity-imbalance",
            {"gravity_sin_nm": 1.3, "gravity_cos_nm": 1.3},
            "gravity_cos_nm",
            0.3,
        ),
    ],
)
def test_all_numbers_but_one_off_alike_are_a_torque_constant_and_that_one(
    effect: str, more: dict[str, float], name: str, extra: float
) -> None:
    found = told(more)
    assert set(found) == {"torque-constant-error", effect}
    assert found["torque-constant-error"]["factor"] == pytest.approx(FACTOR, rel=0.005)
    given = float(getattr(WEIGHS, next(reversed(more))))
    assert found[effect][name] == pytest.approx(extra * given / FACTOR, rel=0.1)


def test_a_weight_that_was_held_is_no_spring_where_the_torque_constant_is_wrong() -> None:
    """Seven percent of the weight and an offset had been a balancer's spring."""
    found = told({}, offset_nm=0.12)
    assert "torque-constant-error" in found
    assert "cable-force" not in found
    assert "gravity-imbalance" not in found


def test_a_torque_constant_is_told_beside_a_hose_of_a_hundred_times_as_much() -> None:
    """It costs 27 times the noise, and in a fit without the hose no number ends near the twin's."""
    found = told({}, hose_nm=3.0, twin=TWIN)
    assert set(found) == {"cable-force", "torque-constant-error"}
    assert found["torque-constant-error"]["factor"] == pytest.approx(FACTOR, rel=0.005)
