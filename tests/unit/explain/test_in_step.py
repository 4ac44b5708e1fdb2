"""A wave of the torque, or a noisy velocity, does not decide with which channel torque is in step.

The loop answers a wave of the torque by one of the velocity, which is late by itself.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.explain.rows.run import Run
from agent.explain.rows.table import Table, tabulate
from agent.physics.twin import Twin

Floats = NDArray[np.float64]

FINE_S, EVERY = 1e-4, 40
TIME = np.arange(0.0, 32.0, FINE_S)
INERTIA, ORDER, LATE_S = 0.018, 2.0, 1.5e-3
TWIN = Twin("r", 1, 100.0, INERTIA, 0.5, 0.01)


def driven() -> Floats:
    waves = 45.0 * np.sin(0.7 * TIME) + 15.0 * np.sin(3.1 * TIME) + 3.0 * np.sin(17.0 * TIME)
    return np.asarray(waves)


def recorded(*, wobble_nm: float, late_s: float, noise_rad_s: float, seed: int) -> Table:
    """Return a joint whose velocity is late by `LATE_S` and whose torque is late by `late_s`."""
    rng = np.random.default_rng(seed)
    asked = driven()
    angle = np.cumsum(asked) * FINE_S
    wave = wobble_nm * (asked / 60.0) ** 2 * np.cos(ORDER * angle)
    # Half of the wave the loop lets through: it shakes the motor, the other half is made up for.
    velocity = asked - 0.5 * np.cumsum(wave) * FINE_S / INERTIA
    position = np.cumsum(velocity) * FINE_S
    torque = INERTIA * np.gradient(velocity, FINE_S) + wave
    torque += 0.5 * np.sign(velocity) + 0.01 * velocity

    def late(values: Floats, by_s: float) -> Floats:
        return np.asarray(np.interp(TIME - by_s, TIME, values)[::EVERY])

    time = TIME[::EVERY]
    columns = {
        "time_s": time,
        "position_rad": position[::EVERY],
        "velocity_rad_s": late(velocity, LATE_S) + noise_rad_s * rng.standard_normal(time.shape),
        "torque_nm": late(torque, late_s) + 0.01 * rng.standard_normal(time.shape),
    }
    return tabulate(TWIN, [Run.from_columns(columns, 100.0, name="run")])


@pytest.mark.parametrize("with_position", [True, False])
def test_a_wave_that_the_loop_answers_does_not_decide(*, with_position: bool) -> None:
    late_s = 0.0 if with_position else LATE_S
    table = recorded(wobble_nm=0.4, late_s=late_s, noise_rad_s=0.01, seed=1)
    assert table.aligned is with_position


def test_noise_of_the_velocity_does_not_decide() -> None:
    assert recorded(wobble_nm=0.0, late_s=0.0, noise_rad_s=0.15, seed=2).aligned


def test_a_position_ahead_of_torque_and_velocity_is_brought_in_step_with_them() -> None:
    table = recorded(wobble_nm=0.0, late_s=LATE_S, noise_rad_s=0.01, seed=3)
    ((at, _),) = [(piece.full, piece.period_s) for piece in table.pieces]
    late = np.interp(TIME - LATE_S, TIME, np.cumsum(driven()) * FINE_S)[::EVERY]
    off_rad = table.full["position_rad"][at] - late[: at.stop]
    assert np.std(off_rad) < 0.2 * np.std(LATE_S * table.full["velocity_rad_s"][at])
