"""What shows in few rows, and far in these: weighed as rows count beside it."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, TWIN

_RATE_HZ, _SECONDS = 500.0, 40.0
_EARLY_S = 0.0036


def speed(time: Floats) -> Floats:
    """Return a joint's speed that turns on and on, slow and fast, and sways now and then."""
    level = np.where(time % 20.0 < 10.0, 20.0, 45.0)
    smooth = np.convolve(np.pad(level, 5000, mode="edge"), np.hanning(10001) / 5000.0, mode="valid")
    sways = (time % 10.0 > 4.0) & (time % 10.0 < 5.0)
    return np.asarray(smooth + np.where(sways, 0.8 * np.sin(2.0 * np.pi * 4.0 * time) ** 3, 0.0))


def early(seed: int) -> Run:
    """Return a recording whose motion is behind its torque; a row in twelve accelerates."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(_SECONDS * _RATE_HZ)) / _RATE_HZ
    fine = np.arange(-1.0, _SECONDS + 1.0, 1e-4)
    velocity = speed(fine)
    torque = (
        TWIN.inertia_kg_m2 * np.gradient(velocity, fine)
        + TWIN.viscous_nm_s_per_rad * velocity
        + TWIN.coulomb_nm
    )
    columns = {
        "time_s": time,
        "position_rad": np.interp(time, fine, np.cumsum(velocity) * 1e-4),
        "velocity_rad_s": np.interp(time, fine, velocity) + 0.005 * rng.standard_normal(time.size),
        "torque_nm": np.interp(time + _EARLY_S, fine, torque)
        + 3.0 * NOISE_NM * rng.standard_normal(time.size),
    }
    return Run.from_columns(columns, GEAR_RATIO, name=f"run {seed}", started_s=60.0 * seed)


def test_a_delay_is_named_though_hardly_a_row_accelerates() -> None:
    """What it leaves there makes those rows count for little, and it took too little of the sum."""
    answer = explain(TWIN, [early(seed) for seed in (1, 2)], [early(3)])
    (finding,) = answer.findings
    assert finding.effect == "measurement-delay"
    assert finding.parameters["torque_delay_s"].value == pytest.approx(-_EARLY_S, rel=0.1)
    assert answer.verdict == "explained"
