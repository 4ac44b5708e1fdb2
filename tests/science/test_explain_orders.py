"""A gear's wobble and a resolver's error: the same order, told apart by the spring between them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agent.explain.choosing.choice import Term, choose
from agent.explain.choosing.search import Library
from agent.explain.forms import order as forms_order
from agent.explain.forms.quantities import as_in_twin
from agent.explain.rows.evidence import weigh
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene, refit
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats, Parameter
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, RATE_HZ, TWIN, stair

ORDER, ERROR_RAD = 2.0, 0.004
ARM_SHARE, SPRING_HZ, DAMPING = 0.6, 30.0, 0.08
WEIGHT_NM = 0.3
_STEPS = 8  # a sample


def sampled(scale: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return time, true angle, velocity and acceleration of the motor at 8 times the rate."""
    trajectory = stair([scale * v for v in (6.0, 20.0, 45.0, 70.0, 95.0)])
    time = np.arange(int(trajectory.duration_s * RATE_HZ) * _STEPS) / (RATE_HZ * _STEPS)
    points = trajectory.sample(time)
    return time, points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2


def sprung(velocity: Floats) -> Floats:
    """Return the torque of an arm behind a spring over its inertia; semi-implicit Euler."""
    omega, dt = 2.0 * math.pi * SPRING_HZ, 1.0 / (RATE_HZ * _STEPS)
    out = np.empty_like(velocity)
    arm, twist = float(velocity[0]), 0.0
    for k, motor in enumerate(velocity.tolist()):
        twist += dt * (motor - arm)
        out[k] = omega**2 * twist + 2.0 * DAMPING * omega * (motor - arm)
        arm += dt * out[k]
    return out


def recorded(scale: float, seed: int, weight_nm: float, *, gear_wobbles: bool) -> Run:
    """Return a recording of a joint whose gear wobbles, or whose motor angle is misread.

    The motor bears what the gear carries times the ratio of this moment.
    """
    time, position, velocity, acceleration = sampled(scale)
    rng = np.random.default_rng(seed)
    slope = ORDER * ERROR_RAD * np.cos(ORDER * position)
    arm = ARM_SHARE * TWIN.inertia_kg_m2
    geared = 1.0 + slope if gear_wobbles else np.ones_like(slope)
    borne = arm * sprung(velocity * geared) + weight_nm * np.sin(position / GEAR_RATIO)
    torque = (
        (TWIN.inertia_kg_m2 - arm) * acceleration
        + borne * geared
        + TWIN.viscous_nm_s_per_rad * velocity
        + TWIN.coulomb_nm * np.sign(velocity)
    )
    if not gear_wobbles:
        position = position + ERROR_RAD * np.sin(ORDER * position)
        velocity = velocity * (1.0 + slope)
    torque = torque + NOISE_NM * rng.standard_normal(time.shape[0])
    names = ("time_s", "position_rad", "velocity_rad_s", "torque_nm")
    columns = (time, position, velocity + 0.01 * rng.standard_normal(time.shape[0]), torque)
    return Run.from_columns(
        {n: c[::_STEPS] for n, c in zip(names, columns, strict=True)},
        GEAR_RATIO,
        name=f"run {seed}",
    )


def named(weight_nm: float, *, gear_wobbles: bool) -> tuple[Term, Scene]:
    runs = [recorded(s, k, weight_nm, gear_wobbles=gear_wobbles) for k, s in enumerate((1.0, 0.9))]
    table = tabulate(TWIN, runs)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0))
    library = Library.of(scene, weigh(table, left), forms_order.FORMS)
    return choose(library).terms[0], scene


@pytest.mark.parametrize("weight_nm", [0.0, WEIGHT_NM])
def test_a_wobble_that_comes_through_a_spring_is_the_gears(weight_nm: float) -> None:
    term, scene = named(weight_nm, gear_wobbles=True)
    assert term.scored.form.effect == "kinematic-error"
    values = term.scored.values()
    assert values["order_per_motor_rev"] == pytest.approx(ORDER, abs=0.01)
    assert values["antiresonance_hz"] == pytest.approx(SPRING_HZ, rel=0.05)
    found = math.hypot(values["cos_kg_m2_rad"], values["sin_kg_m2_rad"])
    assert found == pytest.approx(ARM_SHARE * TWIN.inertia_kg_m2 * ERROR_RAD, rel=0.2)
    own = {name: Parameter(value, (0.9 * value, 1.1 * value)) for name, value in values.items()}
    told = as_in_twin(term.scored.form, scene, own)
    assert told["order_per_motor_rev"].identified
    for name in ("cos_rad", "sin_rad", "arm_inertia_kg_m2"):  # it had been 3 times too small
        assert not told[name].identified


@pytest.mark.parametrize("weight_nm", [0.0, WEIGHT_NM])
def test_an_error_of_the_measured_angle_is_the_resolvers(weight_nm: float) -> None:
    term, _ = named(weight_nm, gear_wobbles=False)
    assert term.scored.form.effect == "resolver-error"
    values = term.scored.values()
    found = math.hypot(values["cos_rad"], values["sin_rad"])
    assert found == pytest.approx(ERROR_RAD, rel=0.1)
