"""A wobble behind a soft gear shakes the arm on the spring that the motor's own motion winds."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.forms import arm as forms_arm
from agent.explain.forms import order as forms_order
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, RATE_HZ, TWIN, stair

ORDER, ERROR_RAD = 2.0, 0.004
ARM_SHARE, SPRING_HZ, DAMPING = 0.55, 30.0, 0.07
_LOOP_HZ, _STEPS = 8.0, 8  # a velocity loop, and steps a sample


@functools.cache
def recorded(scale: float, seed: int) -> Run:
    """Return a recording of two masses under a velocity loop that gives way; symplectic Euler."""
    trajectory = stair([scale * v for v in (6.0, 20.0, 45.0, 70.0, 95.0)])
    count = int(trajectory.duration_s * RATE_HZ) * _STEPS
    dt = 1.0 / (RATE_HZ * _STEPS)
    asked = trajectory.sample(np.arange(count) * dt)
    arm_inertia = ARM_SHARE * TWIN.inertia_kg_m2
    motor_inertia = TWIN.inertia_kg_m2 - arm_inertia
    omega, gain = 2.0 * math.pi * SPRING_HZ, 2.0 * math.pi * _LOOP_HZ * TWIN.inertia_kg_m2
    angle = speed = arm_speed = twist = lag = 0.0
    rows = []
    for step, (wanted, ahead) in enumerate(
        zip(asked.velocity_rad_s.tolist(), asked.acceleration_rad_s2.tolist(), strict=True)
    ):
        rubs = TWIN.coulomb_nm * math.tanh(speed / 0.05) + TWIN.viscous_nm_s_per_rad * speed
        lag += dt * (wanted - speed)
        torque = TWIN.inertia_kg_m2 * ahead + gain * (wanted - speed + 20.0 * lag) + rubs
        geared = 1.0 + ORDER * ERROR_RAD * math.cos(ORDER * angle)
        pull = omega**2 * twist + 2.0 * DAMPING * omega * (geared * speed - arm_speed)
        if step % _STEPS == 0:
            rows.append((step * dt, angle, speed, torque))
        speed += dt * (torque - rubs - arm_inertia * pull * geared) / motor_inertia
        arm_speed += dt * pull
        twist += dt * (geared * speed - arm_speed)
        angle += dt * speed
    time, position, velocity, torque_nm = np.array(rows).T
    noise = NOISE_NM * np.random.default_rng(seed).standard_normal(time.shape[0])
    columns = {
        "time_s": time,
        "position_rad": position,
        "velocity_rad_s": velocity,
        "torque_nm": torque_nm + noise,
    }
    return Run.from_columns(columns, GEAR_RATIO, name=f"run {seed}")


def test_a_wobble_and_the_soft_gear_that_it_shakes_say_one_spring() -> None:
    """Found alone a wobble had a spring twice as stiff, and seven times as damped."""
    table = tabulate(TWIN, [recorded(scale, k) for k, scale in enumerate((1.0, 0.9))])
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)
    forms = (*forms_order.FORMS, forms_arm.FORMS[0])
    choice = choose(Library.of(scene, weigh(table, left), forms))
    found = {term.scored.form.effect: term.scored.values() for term in choice.terms}
    assert found.keys() == {"kinematic-error", "joint-flexibility"}
    for values in found.values():
        assert values["antiresonance_hz"] == pytest.approx(SPRING_HZ, rel=0.06)
        assert values["damping_ratio"] == pytest.approx(DAMPING, rel=0.3)
    arm = found["joint-flexibility"]["arm_inertia_kg_m2"]
    assert arm == pytest.approx(ARM_SHARE * TWIN.inertia_kg_m2, rel=0.05)
