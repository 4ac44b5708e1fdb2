"""What a late drive reports is late whole, and a spring that a wobble shakes keeps its law."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.forms.hidden_arm import HiddenArm
from agent.explain.forms.signal import FORMS, later_by_numbers
from agent.explain.forms.twin_law import best_entry
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.physics.twin import Twin

TWIN = Twin("r", 1, 100.0, 0.018, 0.5, 0.01, 0.2, -0.1)

DELAY = next(form for form in FORMS if form.effect == "measurement-delay")


def scene(late_s: float) -> Scene:
    """Return a rigid joint whose refitted numbers are not those that its twin was given."""
    time = np.arange(0.0, 24.0, 4e-3)
    swings = ((45.0, 0.7), (15.0, 3.1), (3.0, 40.0))
    velocity = np.sum([size * np.sin(rate * time) for size, rate in swings], axis=0)
    position = -np.sum([size / rate * np.cos(rate * time) for size, rate in swings], axis=0)
    torque = 0.018 * np.gradient(velocity, 4e-3) + 0.5 * np.sign(velocity) + 0.01 * velocity
    torque += 0.01 * np.random.default_rng(1).standard_normal(time.shape)
    columns = {"time_s": time, "position_rad": position, "velocity_rad_s": velocity}
    table = tabulate(TWIN, [Run.from_columns({**columns, "torque_nm": torque}, 100.0, name="run")])
    given = np.array([getattr(TWIN, name) for name in BASE])
    return Scene(table, 1.1 * given, np.zeros_like(table.target_nm), given=given, late_s=late_s)


@pytest.mark.parametrize("trial_s", [0.001, 0.02])
def test_a_delay_of_the_twins_torque_is_that_of_its_numbers(trial_s: float) -> None:
    late = scene(0.02)
    column = DELAY.columns(late, (trial_s,))[:, 0]
    assert np.ptp(column) > 0.0
    assert 0.02 * column == pytest.approx(later_by_numbers(late) @ late.as_given, abs=1e-9)


def test_a_springs_law_stands_by_what_its_form_says_where_alone_it_helps_nothing() -> None:
    rigid, omega, inertia = scene(0.0), 2.0 * np.pi * 8.0, 0.006
    spring = {
        "arm_inertia_kg_m2": inertia,
        "stiffness_nm_per_rad": inertia * omega**2,
        "damping_nm_s_per_rad": 0.2 * inertia * omega,
    }
    says = inertia * HiddenArm(8.0, 0.1).extra_rad_s2(rigid)
    assert best_entry(rigid, "joint-flexibility", [spring]) == ()
    assert best_entry(rigid, "joint-flexibility", [spring], says) == (spring,)
    assert best_entry(rigid, "joint-flexibility", [spring], -says) == ()
