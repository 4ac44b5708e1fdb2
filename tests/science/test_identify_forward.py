"""Run forward in its loop, a known joint stays on its path, and a wrong one leaves it."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pytest

from agent.identify.estimate import estimate
from agent.identify.result import Parameter, RigidBodyFit
from agent.identify.rigid.drive_loop import Loop, find_loop
from agent.identify.rigid.forward import in_words, position_error
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.physics.rigid_body import PARAMETERS
from tests.science.identify_plant import Joint, stair

TRUTH = Joint(gear_ratio=100.0, gravity_sin_nm=0.3, offset_nm=0.05)
SPEEDS = (4.0, 12.0, 32.0, 70.0)
FINE = 8  # steps of the plant in one sample of the recording


@dataclass(frozen=True)
class Drive:
    """A controller of gains that the estimator is not told."""

    kind: Literal["position", "velocity", "cubic"]
    stiffness: float = 40.0
    damping: float = 1.5


def driven(
    drive: Drive, *, joint: Joint = TRUTH, seed: int = 0, directions: tuple[int, int] = (1, -1)
) -> Signals:
    """Simulate joint and drive together: explicit steps, smooth sign, torque held for a sample."""
    motion = stair(SPEEDS, rate_hz=500.0, longest_s=1.0, stroke_rad=1e9, directions=directions)
    step_s = 1.0 / 500.0 / FINE
    rng = np.random.default_rng(seed)
    pulses = 0.3 * (rng.random(motion.time_s.size // 100 + 1) > 0.7)
    q, v, summed = 0.0, 0.0, 0.0
    rows = []
    wanted = zip(motion.position_rad.tolist(), motion.velocity_rad_s.tolist(), strict=True)
    for k, (position, velocity) in enumerate(wanted):
        lag = position - q
        if drive.kind == "position":
            torque = drive.stiffness * lag - drive.damping * v
        elif drive.kind == "velocity":
            summed += (velocity - v) / 500.0
            torque = drive.damping * (velocity - v) + drive.stiffness * summed
        else:
            torque = 400.0 * lag**3 - drive.damping * v
        torque += float(pulses[k // 100]) if seed else 0.0
        rows.append((q, v, torque))
        for _ in range(FINE):
            arm = q / joint.gear_ratio
            friction = joint.coulomb_nm * np.tanh(v / 0.02) + joint.viscous_nm_s_per_rad * v
            asked = friction + joint.gravity_sin_nm * np.sin(arm) + joint.offset_nm
            v += step_s * (torque - asked) / joint.inertia_kg_m2
            q += step_s * v
    columns = np.array(rows)
    command = "velocity_command_rad_s" if drive.kind == "velocity" else "position_command_rad"
    return Signals.from_columns(
        {
            "time_s": motion.time_s,
            "position_rad": columns[:, 0],
            "velocity_rad_s": columns[:, 1],
            "torque_nm": columns[:, 2] + 0.005 * rng.standard_normal(motion.time_s.size),
            command: motion.velocity_rad_s if drive.kind == "velocity" else motion.position_rad,
        },
        joint.gear_ratio,
    )


def body(**changed: float) -> RigidBodyFit:
    values = {
        "inertia_kg_m2": TRUTH.inertia_kg_m2,
        "coulomb_nm": TRUTH.coulomb_nm,
        "viscous_nm_s_per_rad": TRUTH.viscous_nm_s_per_rad,
        "gravity_sin_nm": TRUTH.gravity_sin_nm,
        "gravity_cos_nm": 0.0,
        "torque_offset_nm": TRUTH.offset_nm,
    } | changed
    parameters = {n: Parameter(values[n], (values[n], values[n])) for n in PARAMETERS}
    return RigidBodyFit(parameters, 1.0, 0.0, 100.0)


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_the_drives_gains_are_read_from_its_set_point(
    kind: Literal["position", "velocity"],
) -> None:
    drive = Drive(kind)
    loop = find_loop([read_motion(driven(drive))])
    assert isinstance(loop, Loop)
    assert loop.stiffness_nm_per_rad == pytest.approx(drive.stiffness, rel=0.05)
    assert loop.damping_nm_s_per_rad == pytest.approx(drive.damping, rel=0.05)
    assert loop.torque_error_percent < 2.0


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_the_right_joint_stays_on_its_path(kind: Literal["position", "velocity"]) -> None:
    fitted = [read_motion(driven(Drive(kind)))]
    unseen = read_motion(driven(Drive(kind), seed=3, directions=(-1, 1)))
    right = position_error(body(), fitted, unseen)
    assert right is not None
    assert right.closed_loop is not None
    assert right.open_loop is not None
    for name, factor in (("coulomb_nm", 1.3), ("inertia_kg_m2", 1.3), ("gravity_sin_nm", -1.0)):
        true = body().parameters[name].value
        wrong = position_error(body(**{name: factor * true}), fitted, unseen)
        assert wrong is not None
        assert wrong.closed_loop is not None
        assert wrong.open_loop is not None
        assert wrong.closed_loop.rmse_rad > 2.0 * right.closed_loop.rmse_rad, name
        assert wrong.open_loop.rmse_rad > 1.5 * right.open_loop.rmse_rad, name


def test_a_lasting_torque_error_bends_the_path_by_the_loops_stiffness() -> None:
    drive = Drive("position")
    motions = [read_motion(driven(drive))]
    found = position_error(body(torque_offset_nm=TRUTH.offset_nm + 0.1), motions, motions[0])
    assert found is not None
    assert found.closed_loop is not None
    assert found.closed_loop.rmse_rad == pytest.approx(0.1 / drive.stiffness, rel=0.25)


def test_a_joint_that_friction_holds_stays_where_it_is() -> None:
    held = driven(Drive("position"))
    still = replace(
        held,
        position_rad=np.zeros_like(held.time_s),
        velocity_rad_s=np.zeros_like(held.time_s),
        torque_nm=np.full_like(held.time_s, TRUTH.offset_nm + 0.9 * TRUTH.coulomb_nm),
    )
    found = position_error(body(), [read_motion(held)], read_motion(still))
    assert found is not None
    assert found.closed_loop is not None
    assert found.open_loop is not None
    assert found.closed_loop.largest_rad == 0.0
    assert found.open_loop.rmse_rad == 0.0
    assert np.isnan(found.closed_loop.relative_percent)


def test_what_is_not_decidable_says_why() -> None:
    good = driven(Drive("position"))
    motion = read_motion(good)
    silent = read_motion(replace(good, position_command_rad=None))
    found = position_error(body(), [silent], motion)
    assert found is not None
    assert found.closed_loop is None
    assert found.open_loop is not None
    assert "record position_command_rad" in found.reason
    assert "not decidable" in in_words(found)
    crooked = find_loop([read_motion(driven(Drive("cubic")))])
    assert isinstance(crooked, str)
    assert "no linear law" in crooked
    blind = read_motion(replace(good, position_rad=None))
    assert position_error(body(), [motion], blind) is None
    weightless = body()
    parameters = dict(weightless.parameters) | {"inertia_kg_m2": Parameter.not_identified("calm")}
    unheavy = position_error(replace(weightless, parameters=parameters), [motion], motion)
    assert unheavy is not None
    assert (unheavy.closed_loop, unheavy.open_loop) == (None, None)
    assert "inertia" in unheavy.reason
    backwards = position_error(body(coulomb_nm=-0.1), [motion], motion)
    assert backwards is not None
    assert "negative" in backwards.reason


def test_the_estimate_carries_it_into_its_document() -> None:
    runs = [driven(Drive("position")), driven(Drive("position"), seed=2, directions=(-1, 1))]
    result = estimate(runs[:1], validation=runs[1])
    assert result.validation is not None
    assert result.validation.position is not None
    document = json.loads(json.dumps(result.to_json(), allow_nan=False))
    position = document["validation"]["position"]
    assert position["closed_loop"]["relative_percent"] < 0.1
    assert position["closed_loop"]["loop"]["torque_error_percent"] < 2.0
    assert position["open_loop"]["horizon_s"] == 0.2
    assert "in the drive's own loop" in in_words(result.validation.position)
