"""A payload beside friction under load may be a gear that loses more driving than driven."""

from __future__ import annotations

import math

import pytest

from agent.explain.driven import losses_said, weight_said

WEIGHT = (0.16, 0.05)


def heavier(share: float) -> tuple[float, float]:
    return share * WEIGHT[0], share * WEIGHT[1]


def test_a_payload_that_hangs_as_the_weight_is_said_as_losses() -> None:
    """A gear of 16 and 7 % had been 11 % and a payload of 4.5 %, to the last digit as good."""
    mean, half = 0.5 * (0.16 + 0.07), 0.5 * (0.16 - 0.07)
    said = losses_said(mean / (1.0 + half), heavier(half), WEIGHT)
    assert "16 % of it where the motor drives it, and 7 % where it drives the motor" in said
    assert "4.5 % heavier" in said


@pytest.mark.parametrize(
    ("friction", "extra"),
    [
        (0.11, heavier(0.2)),  # it would drive itself
        (0.11, heavier(-0.04)),  # losses only make it heavier
        (0.11, (-0.05 * 0.05, 0.05 * 0.16)),  # it hangs elsewhere
        (math.nan, heavier(0.04)),  # no friction under load
        (0.11, (0.0, 0.0)),
    ],
)
def test_no_other_payload_is(friction: float, extra: tuple[float, float]) -> None:
    assert not losses_said(friction, extra, WEIGHT)


def test_a_gear_that_its_own_friction_loads_is_said_with_the_weight_that_would_do() -> None:
    """A servo's friction of more than its load is no hundred percent of it."""
    said = weight_said(0.6, 0.5, falls=True)
    assert "120 % of the load where the motor drives it, and 40 % where it drives" in said
    assert "near standstill" in said
    assert "40 % heavier" in said
    assert "near standstill" not in weight_said(0.3, 0.15, falls=False)
