"""A position that no joint can have come to stops the cycle; one that it can, never does."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.cycle.continuity import jump
from tests.safety.test_gate import LIMITS, SAMPLE

ALLOWED = LIMITS.following_error_max_rad


@given(
    velocity=st.floats(-200.0, 200.0),
    dt_s=st.floats(0.001, 0.1),
    share=st.floats(-1.0, 1.0),
)
def test_what_the_joint_can_do_is_no_jump(velocity: float, dt_s: float, share: float) -> None:
    first = SAMPLE._replace(position_rad=0.0, velocity_rad_s=velocity)
    reach = abs(velocity) * dt_s + 0.999 * ALLOWED
    second = first._replace(time_s=first.time_s + dt_s, position_rad=share * reach)
    assert not jump(LIMITS, (first, second))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("speed", [0.0, 80.0])
def test_beyond_the_limit_is_a_jump_on_either_side(sign: float, speed: float) -> None:
    first = SAMPLE._replace(position_rad=0.0, velocity_rad_s=0.0)
    for excess, jumps in ((0.999, False), (1.001, True)):
        position = sign * (speed * 0.01 + excess * ALLOWED)
        second = first._replace(
            time_s=first.time_s + 0.01, position_rad=position, velocity_rad_s=-sign * speed
        )
        assert bool(jump(LIMITS, (first, second))) is jumps
        assert bool(jump(LIMITS, (first, first, second))) is jumps


@given(factor=st.floats(1.05, 100.0), inverse=st.booleans(), share=st.floats(-3.0, 3.0))
def test_other_units_at_a_standstill_are_a_jump_beyond_what_is_stated(
    factor: float, inverse: bool, share: float
) -> None:
    """docs/safety.md: unseen only where the joint stands nearer than this to the drive's zero."""
    factor = 1.0 / factor if inverse else factor
    bound_rad = ALLOWED / abs(1.0 - 1.0 / factor)
    first = SAMPLE._replace(position_rad=share * bound_rad, velocity_rad_s=0.0)
    second = first._replace(time_s=first.time_s + 0.01, position_rad=first.position_rad / factor)
    if abs(abs(share) - 1.0) > 1e-6:
        assert bool(jump(LIMITS, (first, second))) is (abs(share) > 1.0)
