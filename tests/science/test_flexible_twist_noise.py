"""A stiffening spring's twist is read from the measured torque: its noise does not bias it."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.flexible.fit import Options, fit_flexible
from tests.science.flexible_chain import NOISE_NM, Robot, run
from tests.science.flexible_plant import triangle_wave

FINE = 1 << 22  # counts: the torque's noise alone
DRAWN = ("cubic_spring_nm_per_rad3", "antiresonance_hz", "damper_nm_s_per_rad")


def test_noise_of_either_sign_leaves_the_truth_in_the_middle() -> None:
    robot = Robot().with_(cubic_spring_nm_per_rad3=200.0)
    recorded = run(triangle_wave(4), robot=robot, counts=FINE)
    noise = NOISE_NM * np.random.default_rng(1).standard_normal(recorded.time_s.size)
    options = Options(starts=1, cubic=True)
    fits = [
        fit_flexible([recorded.measured(0, counts=FINE, noise=sign * noise)], options)
        for sign in (1.0, -1.0)
    ]
    for name in DRAWN:
        values, errors = [], []
        for fit in fits:
            interval = fit.parameters[name].ci95
            assert interval is not None
            values.append(fit.parameters[name].value)
            errors.append((interval[1] - interval[0]) / 3.92)
        # What is odd in the noise is gone from the mean; a third of an error was left in it.
        off = (np.mean(values) - robot.truth[name]) / np.mean(errors)
        assert off == pytest.approx(0.0, abs=0.15), (name, off)
