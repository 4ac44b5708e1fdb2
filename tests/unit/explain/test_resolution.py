"""Rounding is noise that no scatter shows where the torque stands on its steps."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.rows.resolution import coarse_step

SLOW = np.sin(np.arange(8000) / 400.0)


@pytest.mark.parametrize(
    ("noise", "stands"),
    [(0.0, True), (0.3, True), (1.0, False), (5.0, False)],  # in steps
)
@pytest.mark.parametrize("step_nm", [0.05, 0.0061])
def test_a_step_counts_where_noise_does_not_spread_it(
    noise: float, stands: bool, step_nm: float
) -> None:
    noisy = SLOW + noise * step_nm * np.random.default_rng(2).standard_normal(SLOW.shape)
    rounded = np.round(step_nm * np.round(noisy / step_nm), 6)
    assert coarse_step(rounded) == (pytest.approx(step_nm, rel=1e-3) if stands else 0.0)


def test_torque_of_held_speeds_without_noise_is_not_rounded() -> None:
    """Constant torque at each of some speeds: alike, and on no common step."""
    held = np.repeat([0.412, 0.533, 0.6417, 0.9021, -0.3127], 1000)
    assert coarse_step(held) == 0.0
    assert coarse_step(SLOW) == 0.0
