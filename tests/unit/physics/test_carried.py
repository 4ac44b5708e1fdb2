"""The arm behind a spring, a gap, or both, against closed forms and a stiff integration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from agent.physics.effects import Motion
from agent.physics.twin import Effect, Twin, TwinError

Floats = NDArray[np.float64]

INERTIA, STIFFNESS, DAMPING, CUBIC, GAP = 0.016, 30.0, 0.05, 400.0, 0.02
ARM = {
    "arm_inertia_kg_m2": INERTIA,
    "stiffness_nm_per_rad": STIFFNESS,
    "damping_nm_s_per_rad": DAMPING,
    "cubic_stiffness_nm_per_rad3": CUBIC,
}
SPRING = Effect("joint-flexibility", ARM)
PLAY = Effect("backlash", {"half_gap_rad": GAP})
FILM = 0.2
OILED = Effect("backlash", {"half_gap_rad": GAP, "film_damping_nm_s_per_rad": FILM})
TIME = np.arange(0.0, 1.5, 2e-3)


def swing(time: Any) -> tuple[Any, Any, Any]:
    """Return angle, velocity and acceleration of a motion that reverses, gently from rest."""
    w = np.array([7.0, 23.0])[:, np.newaxis]
    a = np.array([0.9, -0.9 * 49.0 / 529.0])[:, np.newaxis]
    t = np.atleast_1d(time)
    return (
        np.sum(a * (1.0 - np.cos(w * t)), axis=0),
        np.sum(a * w * np.sin(w * t), axis=0),
        np.sum(a * w**2 * np.cos(w * t), axis=0),
    )


def motion(time: Floats = TIME) -> Motion:
    position, velocity, acceleration = swing(time)
    return Motion(velocity, acceleration, np.sign(velocity), position, time)


def twin(*effects: Effect, gravity: tuple[float, float] = (0.0, 0.0)) -> Twin:
    return Twin("r", 1, 4.0, 0.018, 0.0, 0.0, *gravity, effects)


def integrated(
    half_gap: float, gravity: tuple[float, float], film: float = 0.0, viscous: float = 0.0
) -> Floats:
    """Return the shaft's torque from scipy's stiff solver, written apart from the product."""

    def shaft(t: float, arm: float, speed: float) -> float:
        angle, rate, _ = swing(t)
        twist = angle[0] - arm
        x = max(abs(twist) - half_gap, 0.0) * np.sign(twist)
        spring = STIFFNESS * x + CUBIC * x**3
        if half_gap == 0.0:
            return float(spring + DAMPING * (rate[0] - speed))
        contact = spring + DAMPING * (rate[0] - speed) if x else 0.0
        return float(contact if contact * x > 0.0 else 0.0) + film * float(rate[0] - speed)

    def derivative(t: float, state: Floats) -> list[float]:
        arm, speed = state
        weight = gravity[0] * np.sin(arm / 4.0) + gravity[1] * np.cos(arm / 4.0)
        return [speed, (shaft(t, arm, speed) - weight - viscous * speed) / INERTIA]

    angle, rate, acceleration = swing(0.0)
    load = gravity[1] + INERTIA * acceleration[0]
    twist = np.roots([CUBIC, 0.0, STIFFNESS, -load])
    held = float(np.real(twist[np.argmin(np.abs(np.imag(twist)))]))
    # An arm without load lies where the motor is about to push it.
    side = np.sign(load) if load else 1.0
    start = [angle[0] - held - side * half_gap, rate[0]]
    found = solve_ivp(
        derivative, (0.0, TIME[-1]), start, "Radau", TIME, rtol=1e-8, atol=1e-10, max_step=1e-3
    )
    return np.array([shaft(t, *state) for t, state in zip(found.t, found.y.T, strict=True)])


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (1.5, -0.8)])
@pytest.mark.parametrize("effects", [(SPRING,), (SPRING, PLAY)])
def test_the_arm_is_where_a_stiff_solver_finds_it(
    effects: tuple[Effect, ...], gravity: tuple[float, float]
) -> None:
    torque = twin(*effects, gravity=gravity).predict(motion())
    shaft = torque - (0.018 - INERTIA) * motion().acceleration_rad_s2
    reference = integrated(GAP if PLAY in effects else 0.0, gravity)
    assert np.std(reference) > 0.5
    # Without load the arm's place in a gap is a matter of microradians at first, and an impact
    # carries the difference on.
    share = 0.04 if PLAY in effects and gravity == (0.0, 0.0) else 0.01
    assert np.sqrt(np.mean((shaft - reference) ** 2)) < share * np.std(reference)


def test_a_film_between_the_teeth_drags_the_arm_along() -> None:
    gravity = (1.5, -0.8)
    torque = twin(SPRING, OILED, gravity=gravity).predict(motion())
    shaft = torque - (0.018 - INERTIA) * motion().acceleration_rad_s2
    reference = integrated(GAP, gravity, FILM)
    assert np.sqrt(np.mean((shaft - reference) ** 2)) < 0.01 * np.std(reference)
    free = twin(SPRING, PLAY, gravity=gravity).predict(motion())
    assert np.std(torque - free) > 0.1 * np.std(reference)


def test_oil_brakes_the_arm_where_the_gear_is_not_stiff() -> None:
    viscous, gravity = 0.15, (1.5, -0.8)
    oily = Effect("joint-flexibility", {**ARM, "arm_viscous_nm_s_per_rad": viscous})
    torque = twin(oily, PLAY, gravity=gravity).predict(motion())
    # The twin's viscous friction is motor's and arm's together, and this twin has none.
    shaft = torque - (0.018 - INERTIA) * motion().acceleration_rad_s2
    shaft = shaft + viscous * motion().velocity_rad_s
    reference = integrated(GAP, gravity, viscous=viscous)
    assert np.std(reference - integrated(GAP, gravity)) > 0.1 * np.std(reference)
    assert np.sqrt(np.mean((shaft - reference) ** 2)) < 0.01 * np.std(reference)


def test_what_a_gear_holds_of_its_twist_is_stiff_at_first_and_lost_after_a_turn() -> None:
    held_nm, travel = 3.0, 0.05
    holds = {"hysteresis_nm": held_nm, "hysteresis_travel_rad": travel}
    torque = twin(Effect("joint-flexibility", {**ARM, **holds})).predict(motion())

    def derivative(t: float, state: Floats) -> list[float]:
        arm, speed, drawn = state
        (angle,), (rate,), _ = swing(t)
        twist, ahead = angle - arm, rate - speed
        pull = STIFFNESS * twist + CUBIC * twist**3 + DAMPING * ahead + held_nm * drawn
        gives = 1.0 - drawn**2 if ahead * drawn > 0.0 else 1.0  # Wen (1976), n = 2
        return [speed, pull / INERTIA, ahead * gives / travel]

    _, _, acceleration = swing(0.0)
    roots = np.roots([CUBIC, 0.0, STIFFNESS, -INERTIA * acceleration[0]])
    start = [-float(np.real(roots[np.argmin(np.abs(np.imag(roots)))])), 0.0, 0.0]
    span = (0.0, TIME[-1])
    found = solve_ivp(derivative, span, start, "Radau", TIME, rtol=1e-8, atol=1e-10, max_step=1e-3)
    slopes = [derivative(t, state) for t, state in zip(found.t, found.y.T, strict=True)]
    reference = INERTIA * np.array(slopes)[:, 1]
    shaft = torque - (0.018 - INERTIA) * motion().acceleration_rad_s2
    plain = twin(SPRING).predict(motion()) - (0.018 - INERTIA) * motion().acceleration_rad_s2
    assert np.std(reference - plain) > 0.1 * np.std(reference)
    assert np.sqrt(np.mean((shaft - reference) ** 2)) < 0.01 * np.std(reference)


def test_both_effects_share_one_arm_and_their_parts_add_up() -> None:
    parts = twin(SPRING, PLAY).predict_parts(motion())
    assert {"joint-flexibility", "backlash"} <= set(parts)
    spring = twin(SPRING).predict_parts(motion())["joint-flexibility"]
    assert parts["joint-flexibility"] == pytest.approx(spring, abs=0.0)
    assert np.max(np.abs(parts["backlash"])) > 0.5
    # The order in the file does not matter, nor does saying the same arm twice.
    same = Effect("backlash", {"half_gap_rad": GAP, **{k: ARM[k] for k in list(ARM)[:3]}})
    both = twin(SPRING, PLAY).predict(motion())
    assert twin(PLAY, SPRING).predict(motion()) == pytest.approx(both, abs=1e-12)
    assert twin(SPRING, same).predict(motion()) == pytest.approx(both, abs=1e-12)


def test_no_gap_is_no_backlash_and_a_stiff_spring_is_a_stiff_gear() -> None:
    closed = Effect("backlash", {"half_gap_rad": 0.0})
    assert twin(SPRING, closed).predict(motion()) == pytest.approx(twin(SPRING).predict(motion()))
    stiff = {"arm_inertia_kg_m2": INERTIA, "stiffness_nm_per_rad": 3e4, "damping_nm_s_per_rad": 2.0}
    rigid = twin().predict(motion())
    soft = twin(Effect("joint-flexibility", stiff)).predict(motion())
    assert soft[50:] == pytest.approx(rigid[50:], abs=0.02 * np.max(np.abs(rigid)))


def test_a_sine_is_answered_as_by_the_oscillator_that_it_is() -> None:
    numbers = {"arm_inertia_kg_m2": 0.016, "stiffness_nm_per_rad": 8.0, "damping_nm_s_per_rad": 0.1}
    time, w = np.arange(0.0, 6.0, 1e-3), 9.0
    position, velocity = np.sin(w * time), w * np.cos(w * time)
    torque = twin(Effect("joint-flexibility", numbers)).predict_torque(
        position, velocity, -w * w * position, time_s=time
    )
    shaft = (8.0 + 0.1j * w) * 0.016 / (8.0 + 0.1j * w - 0.016 * w * w)
    settled = np.imag(-w * w * (0.002 + shaft) * np.exp(1j * w * time))
    assert torque[4000:] == pytest.approx(settled[4000:], abs=1e-3 * np.max(settled))


def test_in_the_gap_the_motor_moves_itself_alone() -> None:
    alone = 0.002 * motion().acceleration_rad_s2
    parted = np.isclose(twin(SPRING, PLAY).predict(motion()), alone, atol=1e-12)
    assert 0.02 < np.mean(parted) < 0.9
    assert not np.isclose(twin(SPRING).predict(motion()), alone, atol=1e-12)[1:].any()


def test_steady_acceleration_from_the_first_sample_on_rings_nothing() -> None:
    time = np.arange(0.0, 2.0, 2e-3)
    speed = 20.0 + 40.0 * time
    angle = 20.0 * time + 20.0 * time**2
    ramp = Motion(speed, np.full_like(time, 40.0), np.ones_like(time), angle, time)
    torque = twin(SPRING).predict(ramp)
    assert torque == pytest.approx(np.full_like(time, 0.018 * 40.0), rel=1e-4)


def test_an_arm_that_is_set_off_from_rest_rings_about_what_it_takes() -> None:
    time = np.arange(0.0, 2.0, 2e-3)
    ramp = Motion(40.0 * time, np.full_like(time, 40.0), np.sign(time), 20.0 * time**2, time)
    straight = Effect("joint-flexibility", {k: v for k, v in ARM.items() if not k.startswith("c")})
    shaft = twin(straight).predict(ramp) - (0.018 - INERTIA) * 40.0
    damping = DAMPING / INERTIA / 2.0
    w = np.sqrt(STIFFNESS / INERTIA - damping**2)
    rings = np.cos(w * time) - damping / w * np.sin(w * time)
    assert shaft == pytest.approx(
        INERTIA * 40.0 * (1.0 - np.exp(-damping * time) * rings), abs=5e-3
    )


def test_a_gap_needs_an_arm_and_a_joint_has_one() -> None:
    with pytest.raises(TwinError, match="or joint-flexibility beside it"):
        twin(PLAY).predict(motion())
    other = Effect(
        "backlash", {"half_gap_rad": GAP, "arm_inertia_kg_m2": 0.01, "stiffness_nm_per_rad": 30.0}
    )
    with pytest.raises(TwinError, match=r"arm_inertia_kg_m2 is 0\.016 and 0\.01"):
        twin(SPRING, other).predict(motion())
    with pytest.raises(TwinError, match="joint-flexibility is there twice"):
        twin(SPRING, SPRING).predict(motion())


def test_unknown_ends_stay_unknown_and_a_hole_is_refused() -> None:
    whole = twin(SPRING).predict(motion())
    cut = motion()
    for column in (cut.velocity_rad_s, cut.acceleration_rad_s2):
        column[-5:] = np.nan
    partly = twin(SPRING).predict(cut)
    assert np.flatnonzero(np.isnan(partly)).tolist() == list(range(len(TIME) - 5, len(TIME)))
    # At an end the motor's slope is known from one side alone.
    assert partly[:-5] == pytest.approx(whole[:-5], rel=2e-5)
    cut.velocity_rad_s[700] = np.nan
    with pytest.raises(TwinError, match="without a hole"):
        twin(SPRING).predict(cut)


@pytest.mark.parametrize("noisy", [False, True])
def test_a_stiff_damped_gear_neither_leads_nor_lags(*, noisy: bool) -> None:
    """At 250 Hz, angle and speed that differ by (w T)^2 make torque of a damper: a lag."""
    inertia, stiffness, damping, w = 0.01, 2500.0, 4.0, 2.0 * np.pi * 3.0
    time = np.arange(0.0, 4.0, 4e-3)
    wave = 20.0 * np.exp(1j * w * time)
    acceleration = np.real(1j * w * wave)
    noise = 0.05 * np.random.default_rng(0).standard_normal(time.shape) if noisy else 0.0
    stiff = Effect(
        "joint-flexibility",
        {
            "arm_inertia_kg_m2": inertia,
            "stiffness_nm_per_rad": stiffness,
            "damping_nm_s_per_rad": damping,
        },
    )
    given = Motion(np.real(wave) + noise, acceleration, np.ones_like(time), np.imag(wave) / w, time)
    extra = twin(stiff).predict_parts(given)["joint-flexibility"]
    spring = stiffness + 1j * w * damping
    true = np.real(1j * w * wave * (inertia * spring / (spring - inertia * w**2) - inertia))
    inside = slice(100, -10)
    error = (extra - true)[inside]
    assert float(np.std(error)) < 0.03 * float(np.std(true))
    jerk = np.real(-(w**2) * wave)[inside]
    lag_s = float(error @ jerk / (jerk @ jerk)) / inertia
    assert abs(lag_s) < 2e-6


def test_an_arm_in_a_gap_rubs_what_time_has_made_of_the_joints_friction() -> None:
    spring = {name: number for name, number in ARM.items() if not name.startswith("cubic")}
    loose = {"half_gap_rad": GAP, **spring, "arm_yield_rad": 1e-3}
    rubs, rubs_twice = (Effect("backlash", {**loose, "arm_coulomb_nm": x}) for x in (0.2, 0.4))
    doubles = Effect("friction-drift", {"coulomb_nm_per_run": 0.3, "reference_run": 1.0})
    joint, second_run = replace(twin(), coulomb_nm=0.3), replace(motion(), run=2.0)

    def of_the_gap(*effects: Effect) -> Floats:
        return replace(joint, effects=effects).predict_parts(second_run)["backlash"]

    np.testing.assert_allclose(of_the_gap(rubs, doubles), of_the_gap(rubs_twice), atol=1e-12)
    assert np.max(np.abs(of_the_gap(rubs) - of_the_gap(rubs_twice))) > 0.1


def test_a_tight_gear_adds_nothing_beside_friction_that_yields() -> None:
    stiff = {"arm_inertia_kg_m2": 1e-4, "stiffness_nm_per_rad": 3e3, "damping_nm_s_per_rad": 0.5}
    rubs = {"arm_coulomb_nm": 0.2, "arm_yield_rad": 0.05}
    tight = Effect("backlash", {"half_gap_rad": 1e-9, **stiff, **rubs})
    yields = Effect("presliding-hysteresis", {"stiffness_nm_per_rad": 0.3 / 0.05})
    joint = replace(twin(tight, yields), coulomb_nm=0.3)
    added = joint.predict_parts(motion())["backlash"]
    assert np.max(np.abs(added[5:-5])) < 0.02 * rubs["arm_coulomb_nm"]
    alone = replace(joint, effects=(tight,)).predict_parts(motion())["backlash"]
    assert np.max(np.abs(alone)) > rubs["arm_coulomb_nm"]


def test_an_arm_that_its_encoder_shows_takes_what_its_own_motion_needs() -> None:
    """An encoder that is late is put right; whatever the gear is, nothing of it is simulated."""
    ahead_rad, late_s, rate = 0.01, 2e-3, 40.0
    time = np.arange(0.0, 1.5, 2e-4)
    stiff = motion(time)
    late = swing(time - late_s)[0] + ahead_rad * np.sin(rate * (time - late_s))
    seen = replace(stiff, position_arm_rad=late / 4.0)
    told = {"arm_inertia_kg_m2": INERTIA, "encoder_late_s": late_s}
    gap = Effect("backlash", {"half_gap_rad": GAP, **told})
    spring = Effect("joint-flexibility", {"stiffness_nm_per_rad": STIFFNESS, **told})
    needs = -INERTIA * ahead_rad * rate**2 * np.sin(rate * time)
    for effect in (gap, spring):
        parts = twin(effect).predict_parts(seen)
        inner = slice(50, -50)
        np.testing.assert_allclose(
            parts[effect.id][inner], needs[inner], atol=0.01 * abs(needs).max()
        )
        with pytest.raises(TwinError, match="needs position_arm_rad"):
            twin(effect).predict(stiff)
    with pytest.raises(TwinError, match="leave one of them out"):
        twin(gap, SPRING).predict(seen)
