"""A torque held over each sample is half a sample off the motion: put in step, and no finding."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.answer.result import Explanation
from agent.explain.explain import explain
from agent.explain.rows.coarser import coarsened
from agent.explain.rows.half_sample import half_a_sample_s, in_step_with
from agent.explain.rows.run import Run
from agent.identify.result import Floats, Parameter
from tests.science.explain_joint import RATE_HZ, TWIN, Conditions, record, stair
from trajectories import SetPoints

PERIOD_S = 1.0 / RATE_HZ
SPEEDS_RAD_S = (4.0, 9.0, 16.0, 27.0, 45.0)


def recorded(late_s: float, extra_nm: float, seed: int) -> Run:
    """Return a joint whose friction falls with speed by so much, and its torque so late."""
    trajectory = stair([(1.0 + 0.1 * seed) * v for v in SPEEDS_RAD_S])

    def missing(now: SetPoints, at: Conditions) -> Floats:
        del at
        time = np.arange(now.velocity_rad_s.shape[0]) * PERIOD_S
        then = trajectory.sample(np.maximum(time - late_s, 0.0))
        fall = extra_nm * np.exp(-np.abs(now.velocity_rad_s) / 7.0) * np.sign(now.velocity_rad_s)
        return np.asarray(_plain_nm(then) - _plain_nm(now) + fall)

    return record(trajectory, missing, Conditions(), seed, name=f"run-{seed}")


def _plain_nm(points: SetPoints) -> Floats:
    direction = np.sign(points.velocity_rad_s)
    return TWIN.predict_torque(
        points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2, direction
    )


def explained(late_s: float, extra_nm: float) -> Explanation:
    return explain(TWIN, [recorded(late_s, extra_nm, k) for k in range(3)])


@pytest.mark.parametrize("part", [0.5, -0.5])
def test_half_a_sample_is_told_and_no_finding(part: float) -> None:
    answer = explained(part * PERIOD_S, 0.15)
    assert [finding.effect for finding in answer.findings] == ["stribeck"]
    word = "later" if part > 0.0 else "earlier"
    assert any(f"half a sample (2.0 ms) {word} than" in reason for reason in answer.reasons)


def test_one_and_a_half_samples_have_a_name() -> None:
    answer = explained(1.5 * PERIOD_S, 0.0)
    assert [finding.effect for finding in answer.findings] == ["measurement-delay"]


@pytest.mark.parametrize(
    ("value", "reach", "period", "late"),
    [
        (0.5, 0.05, 1.0, 0.5),
        (-0.53, 0.05, 1.0, -0.5),
        (0.4, 0.05, 1.0, 0.0),  # known, and another
        (0.5, 0.3, 1.0, 0.0),  # may be another
        (0.5, 0.05, 2.0, 0.0),  # recordings at two rates
    ],
)
def test_what_counts_as_half_a_sample(
    value: float, reach: float, period: float, late: float
) -> None:
    delay = Parameter(value * PERIOD_S, ((value - reach) * PERIOD_S, (value + reach) * PERIOD_S))
    slower = {"time_s": period * PERIOD_S * np.arange(9.0), "torque_nm": np.zeros(9)}
    other = Run.from_columns({**slower, "velocity_rad_s": np.zeros(9)}, 1.0, name="other")
    assert half_a_sample_s(delay, [recorded(0.0, 0.0, 0), other]) == pytest.approx(late * PERIOD_S)


def test_the_motion_moves_and_the_torque_stays() -> None:
    run = recorded(0.0, 0.0, 1)
    (moved,) = in_step_with([run], 0.5 * PERIOD_S)
    before, after = run.signals.position_rad, moved.signals.position_rad
    assert before is not None
    assert after is not None
    between = 0.5 * (before[1:] + before[:-1])
    assert np.max(np.abs(after[1:] - between)) < 1e-2 * np.max(np.abs(np.diff(before)))
    assert moved.signals.torque_nm is run.signals.torque_nm


def test_the_sample_is_that_of_the_recording_and_not_of_what_is_compared() -> None:
    """Recordings of 1 kHz are thinned: half a millisecond had been a quarter of a sample."""
    time = np.arange(4000) * 1e-3
    columns = {
        "time_s": time,
        "position_rad": np.sin(time),
        "velocity_rad_s": np.cos(time),
        "torque_nm": np.cos(time),
    }
    (run,) = coarsened([Run.from_columns(columns, 100.0, name="1 kHz")])
    assert run.signals.time_s.shape[0] < 2100
    assert half_a_sample_s(Parameter(0.51e-3, (0.49e-3, 0.53e-3)), [run]) == pytest.approx(0.5e-3)
    assert half_a_sample_s(Parameter(0.75e-3, (0.73e-3, 0.77e-3)), [run]) == 0.0
