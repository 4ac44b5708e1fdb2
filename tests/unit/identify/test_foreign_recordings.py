"""What recordings of joints that are not the product's own are told, where they had misled it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from agent.identify.diagnosis import no_joint_records
from agent.identify.estimate import estimate
from agent.identify.friction.surface import fit_surface
from agent.identify.friction.surface_law import SurfacePoints
from agent.identify.result import Estimate, Parameter
from agent.identify.reversals.result import PreslidingFit, nothing
from agent.identify.reversals.sentence import verdict
from agent.identify.thermal.trend import TIE, temperature_or_time
from tests.science.identify_plant import Floats, Joint, Motion, record, stair


def test_a_gearbox_that_warms_up_while_speeds_rise_is_told_and_every_speed_has_its_warmth() -> None:
    signals = record(Joint(), stair(rate_hz=125.0, longest_s=1.0))
    warming = np.linspace(25.0, 29.0, signals.time_s.size)
    warm = estimate([replace(signals, gearbox_temperature_degc=warming)])
    assert any("oil that thins meanwhile bends the curve" in note for note in warm.notes)
    assert warm.friction_curve is not None
    assert np.all(np.diff(warm.friction_curve.temperature_degc) > 0.0)
    steady = estimate([replace(signals, gearbox_temperature_degc=np.full(warming.size, 25.0))])
    assert not any("thins" in note for note in steady.notes)


def test_a_velocity_that_a_driver_fills_with_zeros_is_no_standstill() -> None:
    moved = record(Joint(), stair(rate_hz=125.0, longest_s=0.4))
    zeros = replace(moved, velocity_rad_s=np.zeros(moved.time_s.size))
    assert "leave that column out" in no_joint_records([zeros])
    trembles = 1e-3 * np.random.default_rng(1).integers(-1, 2, moved.time_s.size)
    assert not no_joint_records([replace(zeros, position_rad=trembles.astype(np.float64))])


def told(joint: Joint, speeds: list[float], noise_nm: float) -> Estimate:
    signals = record(joint, stair(speeds, rate_hz=125.0, longest_s=0.8), noise_nm=noise_nm)
    return estimate([signals])


def holds(result: Estimate, joint: Joint, *names: str) -> bool:
    assert result.rigid_body is not None
    ends = [result.rigid_body.parameters[name].ci95 for name in names]
    truth = [getattr(joint, name) for name in names]
    return all(e is not None and e[0] <= t <= e[1] for e, t in zip(ends, truth, strict=True))


def test_a_straight_lines_numbers_reach_over_friction_that_is_bent_and_it_is_said() -> None:
    joint, speeds = Joint(static_extra_nm=0.4, stribeck_velocity_rad_s=6.0), [2.0, 5, 10, 20, 40]
    falling = told(joint, speeds, 0.01)
    assert holds(falling, joint, "inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad")
    assert any("friction bends with speed" in note for note in falling.notes)
    straight = told(Joint(), speeds, 0.01)
    assert not any("friction bends with speed" in note for note in straight.notes)


@dataclass(frozen=True)
class Smoothed(Joint):
    """Friction as simulators have it: no sign of the velocity, but its hyperbolic tangent."""

    smooth_rad_s: float = 1.0

    def friction(self, velocity: Floats) -> Floats:
        dry = self.coulomb_nm * np.tanh(velocity / self.smooth_rad_s)
        return np.asarray(dry + self.viscous_nm_s_per_rad * velocity)


def work_that_creeps() -> Motion:
    """Return moves with rests between, in which the joint creeps on as it came."""
    moves = stair([10.0, 20, 40, 80], rate_hz=250.0, longest_s=0.6, dwell_s=0.4)
    came = np.sign(moves.velocity_rad_s)
    came = came[np.maximum.accumulate(np.where(came != 0.0, np.arange(came.size), 0))]
    velocity = np.where(np.abs(moves.velocity_rad_s) < 0.3, 0.3 * came, moves.velocity_rad_s)
    return replace(moves, velocity_rad_s=velocity, position_rad=np.cumsum(velocity) / 250.0)


def test_rests_in_which_a_joint_creeps_take_nothing_of_its_coulomb_friction() -> None:
    # A light joint had also been told an arm that is flexible, and 5 % less inertia.
    for joint, said in ((Smoothed(inertia_kg_m2=0.004), True), (Joint(), False)):
        result = estimate([record(joint, work_that_creeps(), noise_nm=0.01)])
        assert any("friction has not built up fully" in note for note in result.notes) is said
        assert not any("elastic" in note for note in result.notes)
        assert holds(result, joint, "inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad")
        assert result.rigid_body is not None
        coulomb = result.rigid_body.parameters["coulomb_nm"]  # 0.38 with the rests
        assert coulomb.value == pytest.approx(joint.coulomb_nm, rel=0.015)


def test_gravity_that_a_short_stroke_cannot_tell_is_not_taken_for_inertia() -> None:
    joint = Joint(gravity_sin_nm=3.0)
    result = told(joint, [10.0, 20, 40, 80], 0.005)
    assert result.rigid_body is not None
    assert not result.rigid_body.parameters["gravity_sin_nm"].identified
    assert holds(result, joint, "inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad")
    inertia = result.rigid_body.parameters["inertia_kg_m2"]
    assert inertia.value == pytest.approx(joint.inertia_kg_m2, rel=0.004)


def test_about_the_angle_at_which_the_arm_hangs_a_short_stroke_tells_its_sine() -> None:
    # Beside a sine that was left out, the offset had an interval without the truth.
    joint, speeds = Joint(gravity_sin_nm=0.8, gear_ratio=100.0), [2.0, 5.0, 12.0, 30.0, 70.0]
    for start_rad, told_apart in ((-30.0, True), (45.0, False)):
        signals = record(joint, stair(speeds, start_rad=start_rad, longest_s=30.0), noise_nm=0.01)
        body = estimate([signals]).rigid_body
        assert body is not None
        sine, cosine = (body.parameters[f"gravity_{part}_nm"] for part in ("sin", "cos"))
        assert (sine.identified, cosine.identified) == (told_apart, False)
        if told_apart:
            assert "this cosine cannot be told from a constant torque" in cosine.reason
            assert sine.value == pytest.approx(joint.gravity_sin_nm, rel=0.01)
            low, high = body.parameters["torque_offset_nm"].ci95 or (1.0, -1.0)
            assert low <= 0.0 <= high


@dataclass(frozen=True)
class TurnsLate(Joint):
    """A joint whose contacts yield before they slip: its dry friction turns 16 ms late."""

    late: int = 4

    def friction(self, velocity: Floats) -> Floats:
        way = np.where(velocity >= 0.0, 1.0, -1.0)
        dry = self.coulomb_nm * np.concatenate((way[: self.late], way[: -self.late]))
        return np.asarray(dry + self.viscous_nm_s_per_rad * velocity)


def test_friction_that_turns_late_bends_no_inertia() -> None:
    # It was told as a torque that comes late, or a tenth of the inertia was missing for it.
    joint = TurnsLate(inertia_kg_m2=0.004)
    motion = stair([3.0, 6.0, 12.0, 25.0, 50.0] * 3, ramp_s=0.15, longest_s=0.6)
    result = estimate([record(joint, motion, noise_nm=0.005)])
    assert not any("later than motion" in note for note in result.notes)
    assert result.rigid_body is not None
    for name, share in (("inertia_kg_m2", 0.01), ("viscous_nm_s_per_rad", 0.02)):
        value = result.rigid_body.parameters[name].value
        assert value == pytest.approx(getattr(joint, name), rel=share)


def test_speeds_of_one_recording_are_one_temperature_however_it_warmed_up() -> None:
    degc = np.array([24.0, 24.6, 25.2, 25.8, 26.4, 27.0, 30.0, 30.6, 31.2])
    points = SurfacePoints(np.ones(9), degc, np.ones(9), np.ones(9), np.repeat([7, 3, 5], 3))
    assert points.groups().tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert points.take(degc > 26.0).groups().tolist() == [0, 0, 1, 1, 1]


def test_nights_a_little_warmer_one_by_one_are_many_temperatures() -> None:
    degc = np.linspace(20.0, 26.0, 40)
    points = SurfacePoints(np.ones(40), degc, np.ones(40), np.ones(40), np.arange(40))
    assert points.groups().max() + 1 == 6
    assert np.all(np.diff(points.groups()) >= 0)


def test_a_part_of_the_surface_that_comes_out_as_zero_has_no_number() -> None:
    # Coulomb friction that falls while it warms, which the law has not, drives it to its bound.
    speed, degc = (a.ravel() for a in np.meshgrid([2.0, 5, 10, 20, 40, 80], [22.0, 27, 32, 38, 45]))
    thinning = 0.012 * speed * np.exp(-(degc - 25.0) / 28.0)
    friction = 0.6 - 0.002 * (degc - 25.0) + 0.2 * np.exp(-speed / 5.0) + thinning
    found = fit_surface(SurfacePoints(speed, degc, friction, np.full(speed.size, 1e-3)))
    viscous = found.parameters["viscous_nm_s_per_rad"]
    assert found.identified
    assert not viscous.identified
    assert viscous.ci95 is None
    assert "bound" in viscous.reason


def test_oil_that_thins_by_a_share_of_itself_is_not_taken_for_time() -> None:
    # As warm as an hour makes it each time: temperature bends friction, time happens not to.
    temperatures = 25.0 - 20.0 * np.log(1.0 - 0.15 * np.arange(5))
    recordings = [
        record(
            Joint(viscous_nm_s_per_rad=0.01 * float(np.exp(-(t - 25.0) / 20.0))),
            stair([20.0, 50.0, 100.0], rate_hz=125.0, longest_s=0.6),
            seed=seed,
            noise_nm=0.005,
        )
        for seed, t in enumerate(temperatures)
    ]
    degc = [np.full(r.time_s.size, t) for r, t in zip(recordings, temperatures, strict=True)]
    starts_s = [3600.0 * i for i in range(5)]
    assert temperature_or_time(recordings, degc, starts_s).verdict == TIE


def test_a_law_that_leaves_most_of_the_reversals_is_not_said_to_be_them() -> None:
    parameters = {"wind_up_rad": Parameter(3e-4, (1e-4, 5e-4))}
    fit = PreslidingFit("wind-up", True, "", parameters, 0.05, 0.05)
    said = verdict(fit, nothing(""), 1e-5, 0.7)
    assert said.startswith("Most of what these reversals show has no name: 70% of")
    assert "The nearest law says: at a reversal" in said
    assert verdict(fit, nothing(""), 1e-5, 0.1).startswith("At a reversal")
