"""Effects concealed in the joint of the fake drive, and the loop that finds them over the bus.

The fake drive's physics shares no code with the product's laws, and the twin is what an engineer's
simulation of that very joint knows: everything but the concealed effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from agent.conclude.explanation import explained
from agent.explain.answer.result import Explanation
from agent.physics.twin import Effect, Twin
from agent.record.reading import read
from agent.record.recording import Recording
from agent.wire.wire import CycleRequest, drive_cycle
from fakes.friction import FrictionParameters
from fakes.imperfections import Imperfections
from fakes.joint import JointParameters
from fakes.plant import ServoParameters
from fakes.specification import FakeSpecification
from fakes.thermal import ThermalParameters
from tests.system.rig import rig
from trajectories import AxisLimits, Trajectory

PLAIN = FrictionParameters(static_extra_nm=0.0)
STIFF = JointParameters(spring_nm_per_rad=2500.0, damper_nm_s_per_rad=4.0, friction=PLAIN)
LOADED = replace(STIFF, gravity_sin_nm=1.2, gravity_cos_nm=0.3)
SOFT = replace(STIFF, spring_nm_per_rad=25.3, damper_nm_s_per_rad=0.04)
# A fine encoder needs little filtering, so that velocity is hardly late against torque.
SERVO = ServoParameters(velocity_filter_s=0.0005, encoder_counts_per_rev=1 << 17)
RAMP_RAD_S2 = 300.0
FIRST = datetime(2026, 3, 2, 8, tzinfo=UTC)


@dataclass(frozen=True)
class Concealed:
    """One joint, and what the twin of it lacks.

    Parameters
    ----------
    effect : str
        Id of contract section 4; empty for a joint of which the twin knows all.
    joint, known : JointParameters
        As it is, and as the twin has it.
    parameters : mapping of str to (float, float)
        Numbers of the first finding that are known, each with its relative tolerance.
    starts_degc : tuple of float
        Gearbox temperature of each recording, an hour after another.
    knows_spring : bool
        Whether the twin has the gear's spring.
    jerk_rad_s3 : float
        Of the stair's corners.
    left : float
        How much may be left at most, in units of the noise.
    curve_nm : float
        How far the extended twin's friction may be from the joint's over the driven speeds.
    """

    effect: str
    joint: JointParameters
    known: JointParameters
    parameters: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    starts_degc: tuple[float, ...] = (25.0,)
    knows_spring: bool = True
    jerk_rad_s3: float = 75_000.0
    left: float = 1.25
    curve_nm: float = math.inf

    @property
    def twin(self) -> Twin:
        """Return the simulation at 25 degC: rigid body, gravity, friction, and the gear's spring.

        No gear of this fake is so stiff that its spring would not show at the stair's corners.
        """
        joint = self.known
        law = joint.friction.truth(25.0)
        spring = Effect(
            "joint-flexibility",
            {
                "arm_inertia_kg_m2": joint.arm_inertia_kg_m2,
                "stiffness_nm_per_rad": joint.spring_nm_per_rad,
                "damping_nm_s_per_rad": joint.damper_nm_s_per_rad,
            },
        )
        return Twin(
            "simulated-joint",
            1,
            joint.gear_ratio,
            joint.inertia_kg_m2,
            law.coulomb_nm,
            law.viscous_nm_s_per_rad,
            joint.gravity_sin_nm,
            joint.gravity_cos_nm,
            (spring,) if self.knows_spring else (),
        )


def with_(joint: JointParameters = STIFF, **numbers: Any) -> JointParameters:
    return replace(joint, imperfections=Imperfections(**numbers))


NULL = Concealed("", STIFF, STIFF)
CONCEALED = {
    case.effect: case
    for case in (
        Concealed(
            "stribeck",
            replace(STIFF, friction=replace(PLAIN, static_extra_nm=0.2)),
            STIFF,
            # The height is that at rest, which no speed reaches: it goes with the exponent.
            {"static_extra_nm": (0.2, 0.2), "stribeck_velocity_rad_s": (6.0, 0.2)},
            curve_nm=0.005,
        ),
        Concealed("viscous-nonlinear", with_(thinning_velocity_rad_s=120.0), STIFF),
        Concealed(
            "torque-ripple",
            with_(ripple_nm=0.06, ripple_order_per_motor_rev=6.0),
            STIFF,
            {"sin_nm": (0.06, 0.1), "order_per_motor_rev": (6.0, 1e-3)},
        ),
        Concealed(
            "load-dependent-friction",
            with_(LOADED, load_share=0.25),
            LOADED,
            {"load_coefficient": (0.25, 0.05), "arm_inertia_kg_m2": (0.01, 0.05)},
            left=1.1,
        ),
        Concealed(
            "torque-constant-error",
            with_(LOADED, torque_constant_ratio=0.9),
            LOADED,
            {"factor": (0.9, 0.01)},
        ),
        Concealed("temperature-dependent-friction", STIFF, STIFF, starts_degc=(15.0, 35.0)),
        Concealed(
            "joint-flexibility",
            SOFT,
            SOFT,
            {"stiffness_nm_per_rad": (25.3, 0.1)},
            knows_spring=False,
            # Sharper corners make so soft a gear ring too hard to be named; these leave a trace,
            # and the written twin, which has the gear's linear damper alone, a little of it more.
            jerk_rad_s3=7500.0,
            left=1.8,
        ),
        Concealed(
            "position-dependent-friction",
            with_(position_share=0.15, position_order_per_arm_rev=5.0),
            STIFF,
        ),
        # Four bristles that slip one after the other: the twin's law is smooth, and corners stay.
        Concealed("presliding-hysteresis", with_(presliding_rad=1.0), STIFF, left=1.4),
        Concealed(
            "kinematic-error", with_(wobble_rad=0.003), STIFF, {"order_per_motor_rev": (2.0, 1e-3)}
        ),
        Concealed(
            "local-fault",
            with_(LOADED, bump_nm=0.25, bump_arm_rad=0.115, bump_width_arm_rad=0.023),
            LOADED,
        ),
        Concealed("resolver-error", with_(encoder_error_rad=0.003), STIFF),
        Concealed("cable-force", with_(cable_nm_per_arm_rad=0.6), STIFF),
        Concealed("backlash", with_(backlash_rad=0.03), STIFF),
        Concealed("torque-offset", with_(torque_offset_nm=0.08), STIFF),
    )
}
"""Every effect that this fake can have."""


def ask_for(cell: dict[str, Any], jerk_rad_s3: float) -> None:
    """Ask for a stair with the drive's own ramps, in a cell that allows no steeper ones.

    A drive in profile velocity mode ramps by itself from one set-point to the next. Where a corner
    takes several set-points, it gets to each too early and waits, and every sample of the torque
    sees the same phase of that: 0.09 N m here, which no law explains. So a corner lasts for one.
    """
    axis = cell["axis"][0]
    axis["stair"] |= {"duration_s": 28.0, "speeds": 8, "motor_velocity_min_rad_s": 3.0}
    axis["stair"] |= {"motor_jerk_rad_s3": jerk_rad_s3, "motor_acceleration_rad_s2": RAMP_RAD_S2}
    axis["limits"] |= {"motor_jerk_max_rad_s3": 80_000.0}
    axis["limits"] |= {"motor_acceleration_max_rad_s2": RAMP_RAD_S2}


@dataclass(frozen=True)
class Found:
    """What was recorded, what was said of it, and what the cell allows."""

    recordings: tuple[Recording, ...]
    explanation: Explanation
    limits: AxisLimits


def find(folder: Path, case: Concealed) -> Found:
    """Drive the cell's stair over the bus at every temperature of a case, and explain it."""
    recordings: list[Recording] = []
    for degc in case.starts_degc:
        recorded, limits = _driven(folder, case, degc, None, len(recordings))
        recordings.append(recorded)
    said = explained(case.twin, Path("twin.toml"), recordings, (), limits)
    return Found(tuple(recordings), said, limits)


def ask_on(folder: Path, case: Concealed, found: Found) -> Found:
    """Drive what an explanation asks for over the bus, and explain all together.

    Where it asks for the cold joint once more it is driven warm and cold, else as it was left.
    """
    asked = found.explanation.next_experiment
    assert asked is not None, found.explanation.sentence
    assert asked.trajectory is not None, asked.sentence
    trajectory = Trajectory.from_json(dict(asked.trajectory))
    again: Sequence[float] = case.starts_degc[-1:]
    if "cold" in asked.set_up or "cooled" in asked.set_up:
        again = case.starts_degc[::-1]
    recordings = list(found.recordings)
    for degc in again:
        recordings.append(_driven(folder, case, degc, trajectory, len(recordings))[0])
    said = explained(case.twin, Path("twin.toml"), recordings, (), found.limits)
    return Found(tuple(recordings), said, found.limits)


def _driven(
    folder: Path, case: Concealed, degc: float, trajectory: Trajectory | None, hours: int
) -> tuple[Recording, AxisLimits]:
    """Drive one cycle, `hours` after the first, and read what was recorded."""
    own = folder / f"run-{hours}"
    own.mkdir()
    thermal = ThermalParameters(initial_degc=degc, ambient_degc=degc)
    specification = FakeSpecification(case.joint, SERVO, thermal)

    def edit(cell: dict[str, Any]) -> None:
        ask_for(cell, case.jerk_rad_s3)

    with rig(own, specification=specification, edit=edit, seed=1 + hours) as bench:
        axis = bench.cell.axis[0]
        request = CycleRequest(bench.cell, axis, own, trajectory=trajectory)
        recording = read(drive_cycle(request, bench.clock).recording)
    started = (FIRST + timedelta(hours=hours)).isoformat()
    dated = replace(recording, metadata=replace(recording.metadata, started_at=started))
    return dated, axis.motor_limits
