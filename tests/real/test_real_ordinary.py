"""Friction from ordinary motion in recordings that others made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from agent.identify.signals.preprocess import read_motion
from agent.monitor.ordinary.ordinary import ordinary_friction
from tests.real.test_real_estimates import load

pytestmark = pytest.mark.real


@pytest.mark.parametrize("joint", ["joint1", "joint2"])
def test_a_production_log_at_one_hertz_is_not_decidable(real_recordings: Path, joint: str) -> None:
    found = ordinary_friction([read_motion(load(real_recordings, f"ur3-production/{joint}"))])
    assert not found.decidable
    assert any("too slow" in reason for reason in found.reasons)
    assert found.friction_nm.size == 0


def test_the_benchmark_axis_shows_its_published_friction_at_work(real_recordings: Path) -> None:
    """Two runs of a trapezoidal motion; 1 rad stands for 1 m, N m for N."""
    for name in ("estimation", "validation-with-pulses"):
        found = ordinary_friction([read_motion(load(real_recordings, f"emps/{name}"))])
        assert found.decidable, found.reasons
        assert found.parameter("inertia_kg_m2").value == pytest.approx(95.1, rel=0.03)
        published = 20.39 + 203.5 * found.speed_rad_s
        assert np.all(np.abs(found.friction_nm / published - 1.0) < 0.1)
