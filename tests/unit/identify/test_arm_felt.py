"""A dragged arm: teeth that meet between two samples, and how finely it is integrated."""

from __future__ import annotations

import numpy as np

from agent.identify.result import Floats
from agent.identify.reversals.arm_record import ArmRecord
from agent.identify.reversals.arm_simulation import SHAPE, TWICE, Numbers, drag
from agent.physics.kernels_carried import dragged_arm

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


def test_half_the_step_leaves_a_quarter_of_the_error_while_teeth_touch() -> None:
    """The damper had acted on a velocity half a step old: half the step, half the error."""
    time_s = np.arange(0.0, 1.0, PERIOD_S)
    angle = np.exp(-((0.05 / np.maximum(time_s, 1e-9)) ** 3)) * 0.003 * np.sin(300.0 * time_s)
    gear = np.array([0.0, 400.0, 0.5, 0.002, 0.0, 0.05, 30.0])  # the load keeps the teeth together

    def path(steps: int) -> tuple[Floats, Floats]:
        arm, tooth, _ = dragged_arm(
            angle, np.gradient(angle, PERIOD_S), PERIOD_S, steps, gear, 0.0, 0.0
        )
        return arm[::steps][100:], tooth[::steps][100:]

    fine = path(2048)
    errors = [
        [float(np.std(own - best)) for own, best in zip(path(n), fine, strict=True)]
        for n in (16, 32)
    ]
    ratios = np.array(errors[0]) / np.array(errors[1])
    np.testing.assert_allclose(ratios, 4.0, rtol=0.05)
