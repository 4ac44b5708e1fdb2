"""Cogging of a direct drive that turns less than once: few waves, and no chipped tooth."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.physics.twin import Twin

TWIN = Twin("scara", 1, 1.0, 0.4, 1.6, 0.25)
RATE_HZ, NOISE_NM, STROKE_RAD = 500.0, 0.06, 2.5
Waves = tuple[tuple[int, float], ...]
Law = Callable[[Floats], Floats]


def there_and_back(seed: int) -> tuple[Floats, Floats, Floats]:
    """Return position, velocity and acceleration of moves over parts of the stroke, (n,) each."""
    rng = np.random.default_rng(seed)
    position: list[Floats] = []
    here = 0.0
    for _ in range(14):
        there = STROKE_RAD * (rng.uniform(0.25, 0.5) * (1.0 if here < 0.0 else -1.0))
        seconds = abs(there - here) / rng.uniform(0.3, 2.5) + 0.4
        u = np.arange(0.0, 1.0, 1.0 / (seconds * RATE_HZ))
        position.append(here + (there - here) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2))
        here = there
    angle = np.concatenate(position)
    velocity = np.gradient(angle, 1.0 / RATE_HZ)
    return angle, velocity, np.gradient(velocity, 1.0 / RATE_HZ)


def nothing(position: Floats) -> Floats:
    return np.zeros_like(position)


def bump(position: Floats) -> Floats:
    return np.asarray(0.3 * np.exp(-0.5 * (position / 0.15) ** 2))


def dent(position: Floats) -> Floats:
    return -6.0 * (position - 0.2) * bump(position - 0.2)


def recorded(seed: int, waves: Waves, beside: Law = nothing) -> Run:
    position, velocity, acceleration = there_and_back(seed)
    torque = TWIN.predict_torque(position, velocity, acceleration)
    torque += sum(size * np.cos(order * position + 0.8 * order) for order, size in waves)
    torque += beside(position)
    torque += NOISE_NM * np.random.default_rng(seed + 100).standard_normal(position.shape)
    columns = {
        "time_s": np.arange(position.shape[0]) / RATE_HZ,
        "position_rad": position,
        "velocity_rad_s": velocity,
        "torque_nm": torque,
    }
    return Run.from_columns(columns, TWIN.gear_ratio, name=f"run {seed}")


@pytest.mark.parametrize("waves", [((6, 0.12),), ((6, 0.12), (12, 0.05)), ((8, 0.15), (16, 0.05))])
def test_few_waves_of_whole_orders_are_a_ripple(waves: Waves) -> None:
    """They had been two to four bumps, a cable, and orders that are no whole numbers."""
    runs = [recorded(seed, waves) for seed in range(4)]
    found = explain(TWIN, runs[:3], runs[3:])
    assert found.verdict == "explained"
    assert {finding.effect for finding in found.findings} == {"torque-ripple"}
    first = found.findings[0].parameters
    assert first["order_per_motor_rev"].value == waves[0][0]
    size = math.hypot(first["cos_nm"].value, first["sin_nm"].value)
    assert size == pytest.approx(waves[0][1], rel=0.1)


@pytest.mark.parametrize("shape", [bump, dent])
def test_what_lies_at_one_place_is_no_wave_though_one_takes_most_of_it(shape: Law) -> None:
    runs = [recorded(seed, (), shape) for seed in range(4)]
    found = explain(TWIN, runs[:3], runs[3:])
    assert [finding.effect for finding in found.findings] == ["local-fault"]
