"""Whether a joint brakes: nobody lets go of it because of what one answer says."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402.stopping import _Braked, _Braking
from tests.contract.axis_rig import CONFIG

FROM_RAD_S, PERIOD_S = 80.0, 0.01


def judged(speeds_rad_s: list[float]) -> list[_Braked]:
    braking = _Braking(CONFIG)
    return [braking.seen(PERIOD_S * k, speed) for k, speed in enumerate(speeds_rad_s)]


def ramp(deceleration_rad_s2: float, samples: int = 100) -> list[float]:
    return [max(FROM_RAD_S - deceleration_rad_s2 * PERIOD_S * k, 0.0) for k in range(samples)]


@given(st.integers(1, 98), st.floats(200.0, 1e6), st.booleans())
def test_one_wrong_bit_or_two_make_no_runaway(at: int, wrong_rad_s: float, twice: bool) -> None:
    speeds = ramp(CONFIG.quick_stop_deceleration_rad_s2)
    speeds[at : at + 1 + twice] = [wrong_rad_s] * (1 + twice)
    assert _Braked.FASTER not in judged(speeds)


@given(st.floats(100.0, 5000.0))
def test_a_joint_that_accelerates_is_found_before_it_has_run_for_half_a_second(
    acceleration_rad_s2: float,
) -> None:
    seen = judged([FROM_RAD_S + acceleration_rad_s2 * PERIOD_S * k for k in range(100)])
    assert PERIOD_S * seen.index(_Braked.FASTER) < 0.5
