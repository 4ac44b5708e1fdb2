"""The whole loop on the wire: an effect concealed in the drive's joint, its cycle, and its name.

The fake drive's physics shares no code with the product's laws, and the twin is what an engineer's
simulation of that very joint knows: everything but the concealed effect.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from agent.cli.explain import explained
from agent.explain.result import Explanation
from agent.physics.twin import Twin
from agent.record.reading import read
from agent.record.recording import Recording
from agent.wire import CycleRequest, drive_cycle
from fakes.friction import FrictionParameters
from fakes.imperfections import Imperfections
from fakes.joint import JointParameters
from fakes.plant import ServoParameters
from fakes.specification import FakeSpecification
from tests.system.rig import rig
from trajectories import Trajectory

PLAIN = FrictionParameters(static_extra_nm=0.0)
STIFF = JointParameters(spring_nm_per_rad=2500.0, damper_nm_s_per_rad=4.0, friction=PLAIN)
LOADED = replace(STIFF, gravity_sin_nm=1.2, gravity_cos_nm=0.3)
# A fine encoder needs little filtering, so that velocity is hardly late against torque.
SERVO = ServoParameters(velocity_filter_s=0.0005, encoder_counts_per_rev=1 << 17)

HIGHEST_RAD_S2 = 380.0  # what the joint does at a ramp of 300: an experiment may ask for as much


@dataclass(frozen=True)
class Concealed:
    """One joint, and what the twin of it lacks.

    `parameters` are numbers of the first finding that are known, each with its relative tolerance.
    """

    effect: str
    joint: JointParameters
    known: JointParameters
    parameters: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def with_(joint: JointParameters = STIFF, **numbers: Any) -> JointParameters:
    return replace(joint, imperfections=Imperfections(**numbers))


CONCEALED = {
    case.effect: case
    for case in (
        Concealed(
            "stribeck",
            replace(STIFF, friction=replace(PLAIN, static_extra_nm=0.2)),
            STIFF,
            {"static_extra_nm": (0.2, 0.1), "stribeck_velocity_rad_s": (6.0, 0.1)},
        ),
        Concealed(
            "viscous-nonlinear",
            with_(thinning_velocity_rad_s=120.0),
            STIFF,
        ),
        Concealed(
            "torque-ripple",
            with_(ripple_nm=0.06, ripple_order_per_motor_rev=6.0),
            STIFF,
            {"sin_nm": (0.06, 0.1), "order_per_motor_rev": (6.0, 1e-3)},
        ),
        Concealed(
            "position-dependent-friction",
            with_(position_share=0.15, position_order_per_arm_rev=5.0),
            STIFF,
        ),
        Concealed("presliding-hysteresis", with_(presliding_rad=1.0), STIFF),
        Concealed(
            "load-dependent-friction",
            with_(LOADED, load_share=0.25),
            LOADED,
            {"load_coefficient": (0.25, 0.15)},
        ),
        Concealed(
            "joint-flexibility",
            replace(STIFF, spring_nm_per_rad=25.3, damper_nm_s_per_rad=0.04),
            STIFF,
            {"stiffness_nm_per_rad": (25.3, 0.3)},
        ),
    )
}


def ask_for(cell: dict[str, Any]) -> None:
    """Ask for a stair; the drive's ramps are those of the stair, so that torque is even.

    A drive that ramps faster than the set-points change stops between them, and every sample sees
    the same phase of that.
    """
    axis = cell["axis"][0]
    axis["stair"] |= {"duration_s": 28.0, "speeds": 8, "motor_velocity_min_rad_s": 3.0}
    axis["stair"] |= {"motor_jerk_rad_s3": 7500.0}
    axis["limits"]["motor_acceleration_max_rad_s2"] = HIGHEST_RAD_S2


def twin_of(joint: JointParameters) -> Twin:
    """Return the simulation of a joint: rigid body, gravity, Coulomb and viscous at 25 degC."""
    law = joint.friction.truth(25.0)
    return Twin(
        "simulated-joint",
        1,
        joint.gear_ratio,
        joint.inertia_kg_m2,
        law.coulomb_nm,
        law.viscous_nm_s_per_rad,
        joint.gravity_sin_nm,
        joint.gravity_cos_nm,
    )


def driven(folder: Path, case: Concealed, trajectory: Trajectory | None = None) -> Recording:
    """Drive the cell's stair over the bus, or the trajectory given, and read what was recorded."""
    with rig(folder, specification=FakeSpecification(case.joint, SERVO), edit=ask_for) as bench:
        request = CycleRequest(bench.cell, bench.cell.axis[0], folder, trajectory=trajectory)
        return read(drive_cycle(request, bench.clock).recording)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Recording]:
    """Return what gives the recording of a case, driven once."""
    known: dict[str, Recording] = {}

    def of(effect: str) -> Recording:
        if effect not in known:
            known[effect] = driven(tmp_path_factory.mktemp(effect), CONCEALED[effect])
        return known[effect]

    return of


@pytest.fixture(scope="module")
def explanation(
    recorded: Callable[[str], Recording],
) -> Callable[[str], Explanation]:
    """Return what gives the explanation of a case, made once."""
    known: dict[str, Explanation] = {}

    def of(effect: str) -> Explanation:
        if effect not in known:
            twin = twin_of(CONCEALED[effect].known)
            known[effect] = explained(twin, Path("twin.toml"), (recorded(effect),), ())
        return known[effect]

    return of


@pytest.mark.parametrize("effect", CONCEALED)
def test_the_concealed_effect_is_named(
    effect: str, explanation: Callable[[str], Explanation]
) -> None:
    found = explanation(effect)
    first = found.findings[0]
    assert first.effect == effect, found.sentence
    assert len(first.alternatives) <= 1, found.sentence
    assert found.extended.rmse_nm < 0.5 * found.baseline.rmse_nm
    for name, (value, tolerance) in CONCEALED[effect].parameters.items():
        assert first.parameters[name].value == pytest.approx(value, rel=tolerance)


def test_the_next_experiment_breaks_a_tie(
    recorded: Callable[[str], Recording],
    explanation: Callable[[str], Explanation],
    tmp_path: Path,
) -> None:
    """What an explanation asks for is driven on the same joint, and all is explained together."""
    effect = "load-dependent-friction"
    before = explanation(effect)
    assert before.verdict == "tied"
    asked = before.next_experiment
    assert asked is not None
    assert effect in asked.tells_apart
    assert asked.trajectory is not None
    trajectory = Trajectory.from_json(dict(asked.trajectory))
    more = driven(tmp_path, CONCEALED[effect], trajectory)
    twin = twin_of(CONCEALED[effect].known)
    after = explained(twin, Path("twin.toml"), (recorded(effect), more), ())
    first = after.findings[0]
    assert first.effect == effect, after.sentence
    rivals = {other.effect for other in first.alternatives}
    assert not rivals.intersection(asked.tells_apart), after.sentence
