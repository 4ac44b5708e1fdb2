"""What swings goes on where samples were lost, as far as the motor went meanwhile."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.physics.effects.motion import Motion
from agent.physics.gaps import LONGEST_GAP_S, between, bridge
from agent.physics.twin import Effect, Twin

PERIOD_S = 0.002
SPRING = Effect(
    "joint-flexibility",
    {
        "arm_inertia_kg_m2": 0.003,
        "stiffness_nm_per_rad": 8.0,
        "damping_nm_s_per_rad": 0.02,
        "arm_coulomb_nm": 0.15,
    },
)
GAP = {"half_gap_rad": 0.02, **SPRING.parameters}


def twin(effect: Effect) -> Twin:
    return Twin("r", 1, 100.0, 0.006, 0.5, 0.004, 0.3, 0.2, (effect,))


def moved(first_s: float, last_s: float, before: Motion | None = None) -> Motion:
    """Return a motion with corners, which make an arm swing, from one time to another."""
    time = np.arange(round(first_s / PERIOD_S), round(last_s / PERIOD_S)).astype(np.float64)
    time *= PERIOD_S
    whole = PERIOD_S * np.arange(round(8.0 / PERIOD_S))
    speed = 30.0 * np.clip(np.sin(1.9 * whole), -0.5, 0.5)
    at = np.round(time / PERIOD_S).astype(int)
    position = PERIOD_S * np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
    change = np.gradient(speed, PERIOD_S)
    return Motion(
        speed[at],
        change[at],
        np.sign(speed[at]),
        position[at],
        time,
        velocity_raw_rad_s=speed[at],
        before=before,
    )


@given(
    before=st.floats(-50.0, 50.0),
    after=st.floats(-50.0, 50.0),
    bend=st.floats(-0.5, 0.5),
    count=st.integers(4, 100),
)
def test_a_bridge_leads_as_far_as_the_way_is(
    before: float, after: float, bend: float, count: int
) -> None:
    gap_s = PERIOD_S * (count + 1)
    went = gap_s * (0.5 * (before + after) + bend * (after - before))
    ends = np.array([before]), np.array([after])
    rates = bridge(*ends, np.array([went]), np.array([gap_s]), between(count))
    whole = np.concatenate((ends[0], rates, ends[1]))
    way = PERIOD_S * float(np.sum(0.5 * (whole[1:] + whole[:-1])))
    # Trapezoids miss a parabola by the square of its step.
    missed = abs(went - 0.5 * gap_s * (before + after)) / (count + 1) ** 2
    assert way == pytest.approx(went, abs=missed + 1e-9)


def test_a_way_that_no_motion_goes_in_the_time_bends_nothing() -> None:
    before, after, gap_s = np.array([-73.6]), np.array([-73.4]), np.array([0.014])
    rates = bridge(before, after, np.array([-1.29]), gap_s, between(6))  # 17.6 ms at that speed
    np.testing.assert_allclose(rates, np.linspace(-73.6, -73.4, 8)[1:-1])


@pytest.mark.parametrize("effect", [SPRING, Effect("backlash", GAP)], ids=lambda e: e.id)
def test_an_arm_swings_on_across_a_gap(effect: Effect) -> None:
    law, begins_s = twin(effect), 3.52  # while it still swings from a corner
    whole = moved(0.0, 8.0)
    expected = law.predict_parts(whole)[effect.id][whole.need("time_s") > begins_s - 1e-9]
    first = moved(0.0, begins_s - 0.03)
    across = law.predict_parts(moved(begins_s, 8.0, first))[effect.id]
    anew = law.predict_parts(moved(begins_s, 8.0))[effect.id]
    off = np.sqrt(np.mean((across - expected)[:500] ** 2))
    assert off < 0.2 * np.sqrt(np.mean((anew - expected)[:500] ** 2))
    longer = moved(begins_s + LONGEST_GAP_S, 8.0, first)
    assert np.array_equal(
        law.predict_parts(longer)[effect.id],
        law.predict_parts(moved(begins_s + LONGEST_GAP_S, 8.0))[effect.id],
    )


def test_a_gap_that_is_not_even_is_the_mean_over_three_widths() -> None:
    spread, motion = 0.1, moved(0.0, 8.0)
    uneven = twin(Effect("backlash", {**GAP, "half_gap_spread": spread}))
    each = [
        twin(Effect("backlash", {**GAP, "half_gap_rad": width * GAP["half_gap_rad"]}))
        for width in (1.0 - spread, 1.0, 1.0 + spread)
    ]
    mean = np.mean([law.predict(motion) for law in each], axis=0)
    np.testing.assert_allclose(uneven.predict(motion), mean, atol=1e-12)
    with pytest.raises(ValueError, match="half_gap_spread"):
        twin(Effect("backlash", {**GAP, "half_gap_spread": 1.5})).predict(motion)


def test_a_misread_angle_spares_the_arm_behind_a_soft_spring() -> None:
    """Far above the arm's swing only the motor is shaken, far below both are."""
    motion = moved(0.0, 8.0)
    misread = {"cos_rad": 0.002, "sin_rad": 0.0, "order_per_motor_rev": 3.0}
    arm = {"arm_inertia_kg_m2": 0.003, "damping_ratio": 0.1}

    def shaken(**more: float) -> float:
        added = twin(Effect("resolver-error", {**misread, **more})).predict_parts(motion)
        fast = np.abs(motion.velocity_rad_s) > 14.0
        return float(np.std(added["resolver-error"][fast]))

    stiff = shaken()
    assert shaken(**arm, antiresonance_hz=500.0) == pytest.approx(stiff, rel=0.02)
    assert shaken(**arm, antiresonance_hz=0.5) == pytest.approx(0.5 * stiff, rel=0.05)
