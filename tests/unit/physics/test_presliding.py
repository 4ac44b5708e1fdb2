"""Friction around a reversal: closed forms, the laws that it must agree with, and Masing's rule."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from agent.physics.effects import Motion
from agent.physics.friction import STRIBECK
from agent.physics.friction_dynamic import Dahl, LuGre
from agent.physics.presliding import MaxwellSlip, YieldingSpring
from agent.physics.twin import Effect, Twin

Floats = NDArray[np.float64]

TIME = np.linspace(0.0, 2.0, 2001)
VELOCITY = 0.8 * np.sin(7.0 * TIME) + 0.3 * np.sin(31.0 * TIME)
LEVEL = np.full_like(TIME, 0.6)
STIFFNESS = st.floats(1.0, 1e4)


def test_shape_one_is_dahl_and_with_damping_on_the_stribeck_level_lugre() -> None:
    dahl = YieldingSpring(60.0).torque_nm(TIME, VELOCITY, LEVEL)
    assert dahl == pytest.approx(Dahl(0.6, 60.0).torque_nm(TIME, VELOCITY), abs=1e-9)
    lugre = LuGre(0.6, 0.0, 0.2, 0.5, 60.0, 0.4)
    bristles = YieldingSpring(60.0, 1.0, 0.4).torque_nm(TIME, VELOCITY, lugre.level_nm(VELOCITY))
    # The two cut a step's level at different places.
    assert bristles == pytest.approx(lugre.torque_nm(TIME, VELOCITY), abs=2e-3)


@pytest.mark.parametrize("shape", [0.5, 1.0, 1.7, 3.0])
def test_any_shape_is_what_an_integration_in_small_steps_finds(shape: float) -> None:
    def slope(t: float, force: Floats) -> Floats:
        velocity = np.interp(t, TIME, VELOCITY)
        left = 1.0 - force * np.sign(velocity) / 0.6
        return np.asarray(60.0 * np.abs(left) ** shape * np.sign(left) * velocity)

    short = TIME <= 1.0
    found = solve_ivp(slope, (0.0, 1.0), [0.0], t_eval=TIME[short], rtol=1e-9, max_step=1e-3)
    torque = YieldingSpring(60.0, shape).torque_nm(TIME[short], VELOCITY[short], LEVEL[short])
    assert torque == pytest.approx(found.y[0], abs=1e-4)


@settings(deadline=None)  # the first example may compile the loop
@given(
    st.lists(st.floats(-300.0, 300.0), min_size=2, max_size=60),
    st.floats(1e-5, 10.0),
    st.floats(0.2, 5.0),
    STIFFNESS,
    st.floats(-1.0, 1.0),
)
def test_no_step_is_too_long_and_no_torque_beyond_its_level(
    velocities: list[float], step: float, shape: float, stiffness: float, start: float
) -> None:
    velocity = np.array(velocities)
    time = np.arange(len(velocity), dtype=np.float64) * np.float64(step)
    level = np.full_like(velocity, 0.6)
    spring = YieldingSpring(stiffness, shape).torque_nm(time, velocity, level, start)
    assert np.all(np.abs(spring) <= 0.6 * (1.0 + 1e-9))
    chain = MaxwellSlip(1.0 / stiffness, 1.0 + shape).torque_nm(time, velocity, level, start)
    assert np.all(np.abs(chain) <= 0.6 * (1.0 + 1e-9))


@pytest.mark.parametrize("shape", [1.0, 2.0, 4.0])
def test_a_chain_of_elements_follows_its_virgin_curve_and_doubles_it_after_a_reversal(
    shape: float,
) -> None:
    reach = 0.02
    time = np.linspace(0.0, 1.0, 401)
    out = MaxwellSlip(reach, shape).torque_nm(time, np.full(401, reach), np.full(401, 0.6))
    virgin = 0.6 * (1.0 - (1.0 - time) ** shape)
    assert out == pytest.approx(virgin, abs=0.6 * 0.005)
    there_and_back = np.where(np.arange(1201) < 401, reach, -reach)
    long = np.linspace(0.0, 3.0, 1201)
    torque = MaxwellSlip(reach, shape).torque_nm(long, there_and_back, np.full(1201, 0.6))
    # Masing: the branch after a reversal is the virgin curve, twice as large both ways.
    turned = 401
    back = np.arange(1201 - turned) * (long[1] - long[0])
    expected = torque[turned - 1] - 2.0 * 0.6 * (1.0 - np.maximum(1.0 - 0.5 * back, 0.0) ** shape)
    assert torque[turned:] == pytest.approx(expected, abs=0.6 * 0.02)


def test_small_loops_close_in_a_chain() -> None:
    # Out, a little back, and to the same place again: elements remember, one spring does not.
    steps = np.concatenate([np.full(300, 1.0), np.full(60, -1.0), np.full(60, 1.0)])
    time = np.linspace(0.0, 0.419, 420)
    velocity = 0.01 * steps
    chain = MaxwellSlip(0.01, 2.0).torque_nm(time, velocity, np.full_like(time, 0.6))
    assert chain[-1] == pytest.approx(chain[299], abs=2e-3)
    spring = YieldingSpring(120.0).torque_nm(time, velocity, np.full_like(time, 0.6))
    assert spring[-1] < spring[299] - 0.02


def test_a_step_in_which_the_motion_turns_round_is_cut_there() -> None:
    coarse, speed = np.arange(0.0, 8.0), np.array([3.0, 1.0, -2.0, -1.0, 0.5, 4.0, -4.0, -1.0])
    turned = coarse[:-1] + speed[:-1] / (speed[:-1] - speed[1:])
    turned = turned[speed[:-1] * speed[1:] < 0.0]
    fine = np.sort(np.concatenate((coarse, turned)))
    chain = MaxwellSlip(2.0, 2.5)
    cut = chain.torque_nm(fine, np.interp(fine, coarse, speed), np.ones_like(fine))
    whole = chain.torque_nm(coarse, speed, np.ones_like(coarse))
    assert whole == pytest.approx(cut[np.isin(fine, coarse)], abs=1e-12)


def test_a_twin_yields_towards_its_own_dry_friction_stribeck_included() -> None:
    dry = {"static_extra_nm": 0.2, "stribeck_velocity_rad_s": 5.0, "exponent": 1.5}
    yields = Effect("presliding-hysteresis", {"stiffness_nm_per_rad": 600.0})
    law = Twin("r", 1, 100.0, 0.0, 0.6, 0.01, effects=(Effect("stribeck", dry), yields))
    for speed in (0.5, 4.0, 30.0):
        steady = Motion(
            np.full(4001, speed), np.zeros(4001), np.ones(4001), None, np.linspace(0.0, 1.0, 4001)
        )
        expected = STRIBECK.torque(speed, {"coulomb_nm": 0.6, "viscous_nm_s_per_rad": 0.01, **dry})
        assert law.predict(steady) == pytest.approx(np.full(4001, float(expected)), abs=1e-6)


@pytest.mark.parametrize(
    "numbers", [{"stiffness_nm_per_rad": 3.0}, {"sliding_travel_rad": 0.4, "shape_exponent": 3.0}]
)
def test_where_a_part_of_the_friction_yields_the_rest_turns_round_at_once(
    numbers: dict[str, float],
) -> None:
    """Seals give way for long, and bearings do not."""
    direction = np.sign(VELOCITY)
    motion = Motion(VELOCITY, np.zeros_like(TIME), direction, None, TIME)
    part = Effect("presliding-hysteresis", {**numbers, "yielding_share": 0.25})
    whole = Effect("presliding-hysteresis", numbers)
    of_part = Twin("r", 1, 100.0, 0.0, 0.6, 0.0, effects=(part,)).predict(motion)
    of_quarter = Twin("r", 1, 100.0, 0.0, 0.15, 0.0, effects=(whole,)).predict(motion)
    assert of_part == pytest.approx(of_quarter + 0.45 * direction, abs=1e-9)


def test_friction_that_has_worn_to_half_yields_to_half() -> None:
    yields = Effect("presliding-hysteresis", {"sliding_travel_rad": 0.4, "shape_exponent": 3.0})
    drift = Effect("friction-drift", {"coulomb_nm_per_run": -0.1, "reference_run": 0.0})
    direction = np.sign(VELOCITY) * (TIME > 0.1)  # at first it is not known
    motion = Motion(VELOCITY, np.zeros_like(TIME), direction, None, TIME, run=3.0)
    for effects in ((yields, drift), (drift, yields)):
        worn = Twin("r", 1, 100.0, 0.0, 0.6, 0.0, effects=effects).predict(motion)
        less = Twin("r", 1, 100.0, 0.0, 0.3, 0.0, effects=(yields,)).predict(motion)
        assert worn == pytest.approx(less, abs=1e-9)


def test_a_recording_that_starts_in_motion_starts_with_friction_drawn_out() -> None:
    law = Twin("r", 1, 100.0, 0.0, 0.6, 0.0)
    for numbers in ({"stiffness_nm_per_rad": 1.0}, {"sliding_travel_rad": 1.0}):
        yields = Twin(
            "r", 1, 100.0, 0.0, 0.6, 0.0, effects=(Effect("presliding-hysteresis", numbers),)
        )
        moving = Motion(np.full(100, -2.0), np.zeros(100), -np.ones(100), None, TIME[:100])
        assert yields.predict(moving) == pytest.approx(law.predict(moving))
        resting = Motion(np.zeros(100), np.zeros(100), np.zeros(100), None, TIME[:100])
        assert yields.predict(resting) == pytest.approx(np.zeros(100))


def test_a_curve_that_would_stiffen_is_refused() -> None:
    with pytest.raises(ValueError, match="at least 1"):
        MaxwellSlip(0.01, 0.5)
    with pytest.raises(ValueError, match="above 0"):
        YieldingSpring(60.0).torque_nm(TIME, VELOCITY, np.zeros_like(TIME))
