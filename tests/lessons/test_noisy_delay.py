"""A delay beside a noisy velocity: what its column says is too short, what the twin gets is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.search import Library
from agent.explain.choosing.weighted import DELAY
from agent.explain.forms.signal import FORMS
from agent.explain.rows.evidence import solve, weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)


def test_a_derived_acceleration_s_noise_makes_no_delay_short() -> None:
    run = record(Joint(), 1, torque_late_s=-0.016)
    velocity = run.signals.velocity_rad_s
    assert velocity is not None
    rough = velocity + 0.06 * np.random.default_rng(3).standard_normal(velocity.shape)
    run = replace(run, signals=replace(run.signals, velocity_rad_s=rough))
    table = tabulate(TWIN, [run], 40.0, align_velocity=False)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)
    form = next(f for f in FORMS if f.effect == DELAY)
    library = Library.of(scene, weigh(table, scene.residual_nm), (form,))
    column_s = -0.016
    for _ in range(5):
        columns = library.model([library.candidate(form, (column_s,))])
        column_s = float(solve(columns.T @ columns, columns.T @ library.target)[-1])
    assert column_s > -0.0150  # the column says that it is 6 % shorter, or more
    (entry,) = form.to_twin(scene, {"torque_delay_s": column_s})
    assert entry["torque_delay_s"] == pytest.approx(-0.016, rel=0.02)
