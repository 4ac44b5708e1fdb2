"""Where the velocity is noisy and the position is not, the motion is the position's."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.rows.cleaner import by_the_quieter
from agent.explain.rows.run import Run

PERIOD_S, INERTIA = 0.002, 0.002


def recorded(noise_rad_s: float, late_s: float = 0.0, bits: int = 17) -> Run:
    """Return 20 s of swings of a joint with such an encoder, and 1 mN m of noise."""
    rng = np.random.default_rng(0)
    time_s = np.arange(10_000, dtype=np.float64) * PERIOD_S
    step = 2.0 * np.pi / 2**bits
    velocity = 60.0 * np.cos(6.0 * (time_s - late_s))
    return Run.from_columns(
        {
            "time_s": np.asarray(time_s),
            "position_rad": np.asarray(step * np.round(10.0 * np.sin(6.0 * time_s) / step)),
            "velocity_rad_s": velocity + noise_rad_s * rng.standard_normal(time_s.size),
            "torque_nm": INERTIA * np.gradient(velocity, time_s)
            + 1e-3 * rng.standard_normal(time_s.size),
        },
        100.0,
        name="run",
    )


@pytest.mark.parametrize(
    ("run", "derived"),
    [
        (recorded(0.2), True),
        (recorded(0.2, late_s=0.001), True),  # half a sample, as a simulator's steps are apart
        (recorded(0.2, late_s=0.005), False),  # one channel is late: that is to be named
        (recorded(0.0036, bits=20), True),  # within the band as much as the torque's
        (recorded(0.0036), False),  # the encoder has nearly as much there
        (recorded(0.001), False),  # as good as the encoder
    ],
)
def test_motion_is_the_positions_where_the_velocity_is_far_noisier(
    run: Run, *, derived: bool
) -> None:
    (kept,), said = by_the_quieter((run,), INERTIA)
    assert (kept.signals.velocity_rad_s is None) is derived
    assert any("was taken from the position" in sentence for sentence in said) is derived


def test_all_runs_keep_their_velocity_where_one_has_no_position() -> None:
    run = recorded(0.2)
    columns = {
        "time_s": run.signals.time_s,
        "torque_nm": run.signals.torque_nm,
        "velocity_rad_s": np.asarray(run.signals.velocity_rad_s),
    }
    runs = (run, Run.from_columns(columns, 100.0, name="other"))
    assert by_the_quieter(runs, INERTIA) == (runs, ())
