"""Teeth that meet between two samples: what differences of the motor's angle feel of them."""

from __future__ import annotations

import numpy as np

from agent.identify.reversals.arm_record import ArmRecord
from agent.identify.reversals.arm_simulation import SHAPE, TWICE, Numbers, drag

PERIOD_S, SIZE = 1e-3, 64


def resting() -> ArmRecord:
    none, every = np.zeros(SIZE), np.ones(SIZE, dtype=np.bool_)
    turn = np.zeros(SIZE, dtype=np.intp)
    return ArmRecord(
        PERIOD_S,
        none,
        none,
        none,
        none,
        none,
        every,
        every,
        turn,
        (),
        1e-6,
        1e-6,
        1e-2,
        1e-6,
        100.0,
    )


def test_a_blow_between_two_samples_weighs_as_in_the_motors_second_differences() -> None:
    # A motor that runs at 1 rad/s meets an arm that friction holds, 20.4 samples later.
    stiffness, damping, met_s = 1.0, 3.0, 20.4 * PERIOD_S
    x = np.zeros(len(SHAPE) + 1)
    x[0], x[1:5] = 2.0 * met_s, np.log([stiffness, damping, 1e9, 1e15])
    x[-1] = 2.0 * PERIOD_S  # where it stood is read from the first five samples
    time_s = np.linspace(0.0, (SIZE - 1) * PERIOD_S, SIZE)
    path = drag(resting(), 0, time_s, Numbers(x, np.zeros(5)))

    # The torque jumps to the damper's and grows with the spring; twice its integral is known.
    since = np.maximum(time_s - met_s, 0.0)
    angle = damping * since**2 / 2.0 + stiffness * since**3 / 6.0
    felt = np.convolve(angle, TWICE, mode="same") / PERIOD_S**2
    inside = slice(4, -4)
    np.testing.assert_allclose(path.felt_nm[inside], felt[inside], atol=0.04 * damping)
    assert np.abs(path.tooth_nm - felt)[inside].max() > 0.1 * damping  # at its own instant
