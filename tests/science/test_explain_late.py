"""A torque far later than the motion: what swings by the angle is found in step with it."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.numbers.anew import chosen_anew
from agent.explain.rows.run import Run
from agent.explain.rows.table import without_edges
from agent.identify.result import Floats
from tests.science.explain_joint import (
    NOISE_NM,
    RATE_HZ,
    TWIN,
    Conditions,
    library_of,
    record,
    stair,
)
from trajectories import SetPoints

LATE_S, ORDER, RIPPLE_NM = 0.024, 2.0, 0.08


def recorded(scale: float, seed: int) -> Run:
    """Return a recording of a joint with a ripple, and a torque that is `LATE_S` later."""
    trajectory = stair([scale * v for v in (4.0, 12.0, 25.0, 45.0)])
    time = np.arange(int(trajectory.duration_s * RATE_HZ)) / RATE_HZ
    then = trajectory.sample(np.maximum(time - LATE_S, 0.0))

    def missing(now: SetPoints, at: Conditions) -> Floats:
        del at
        ripple = RIPPLE_NM * np.cos(ORDER * then.position_rad)
        return np.asarray(_plain_nm(then) + ripple - _plain_nm(now))

    return record(trajectory, missing, Conditions(), seed, name=f"run-{seed}")


def _plain_nm(points: SetPoints) -> Floats:
    direction = np.sign(points.velocity_rad_s)
    return TWIN.predict_torque(
        points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2, direction
    )


def test_a_ripple_beside_a_late_torque_is_one_ripple() -> None:
    """At 45 rad/s the wave is more than two radians late, at 4 rad/s a fifth of one."""
    library, choice = chosen_anew(library_of([recorded(1.0 + 0.1 * k, k) for k in range(4)]))
    named = {term.scored.form.effect for term in choice.terms}
    assert named == {"measurement-delay", "torque-ripple"}
    assert len(choice.terms) == len(named)
    assert library.scene.late_s == pytest.approx(LATE_S, rel=0.01)
    left = library.residual(choice.candidates) / library.weighing.weight
    assert float(np.sqrt(np.mean(left**2))) < 1.1 * NOISE_NM


def test_a_late_torque_turns_round_later() -> None:
    table = library_of([recorded(1.0, 1)]).scene.table
    late = without_edges(table, table.creep_rad_s, LATE_S)
    turned = np.flatnonzero(np.diff(np.sign(table.full["velocity_rad_s"])))
    row = np.searchsorted(table.rows["time_s"], table.full["time_s"][turned] + LATE_S)
    assert not late.used[np.minimum(row, late.used.shape[0] - 1)].any()
    assert np.count_nonzero(late.used) < np.count_nonzero(table.used)
