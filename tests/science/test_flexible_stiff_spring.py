"""A stiffening spring's twist follows from the motion: the torque's noise is not in its cube."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.flexible.fit import Options, fit_flexible
from tests.science.flexible_bound import bound
from tests.science.flexible_chain import NOISE_NM, Robot, run
from tests.science.flexible_plant import triangle_wave

FINE = 1 << 22  # counts: the torque's noise alone


def test_noise_of_either_sign_leaves_the_truth_in_the_middle_and_intervals_are_the_bounds() -> None:
    robot = Robot().with_(cubic_spring_nm_per_rad3=200.0)
    recorded = run(triangle_wave(4), robot=robot, counts=FINE)
    noise = NOISE_NM * np.random.default_rng(1).standard_normal(recorded.time_s.size)
    fits = [
        fit_flexible(
            [recorded.measured(0, counts=FINE, noise=sign * noise)], Options(starts=1, cubic=True)
        ).parameters
        for sign in (1.0, -1.0)
    ]
    least = bound(recorded, robot, FINE)
    for name, truth in robot.truth.items():
        values, errors = [], []
        for parameters in fits:
            interval = parameters[name].ci95
            assert interval is not None, name
            values.append(parameters[name].value)
            errors.append((interval[1] - interval[0]) / 3.92)
        # What is odd in the noise is gone from the mean. With the twist read from the torque a
        # third of an error was left of the cube, and the spring's interval a sixth too wide.
        assert (np.mean(values) - truth) / np.mean(errors) == pytest.approx(0.0, abs=0.08), name
        assert np.mean(errors) / least[name] == pytest.approx(1.05, abs=0.2), name
