"""Instruments, recursion, acceleration thresholds and residuals, on joints whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.identify.estimate import identify
from agent.identify.result import Floats
from agent.identify.rigid.course import course_of
from agent.identify.rigid.instrumental import (
    fit_instrumental,
    instrument_strength,
)
from agent.identify.rigid.linear import solve_blocks, time_blocks
from agent.identify.rigid.recursive import RecursiveLeastSquares
from agent.identify.rigid.regression import rows_of
from agent.identify.rigid.residuals import (
    Residual,
    correlate,
    explained_share,
    residual_in_words,
    residual_of,
)
from agent.identify.rigid.rows import Rows
from agent.identify.rigid.thresholding import study_speeds, sweep_acceleration
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import filter_motion, read_motion
from agent.physics.rigid_body import PARAMETERS
from tests.science.identify_plant import Joint, coloured, record, stair

CUTOFF_HZ = 5.0
STAIR = stair(rate_hz=250.0, ramp_s=0.252, longest_s=1.0, stroke_rad=1e9)


def rows(signals: Signals, cutoff_hz: float = CUTOFF_HZ) -> Rows:
    return rows_of([read_motion(signals)], cutoff_hz)


def closed_loop(seed: int, gain_nm_s_per_rad: float = 0.6) -> Signals:
    """A velocity loop: in-band noise of the measured velocity comes back as torque."""
    motion = stair((2.0, 3.0, 4.0), rate_hz=125.0, ramp_s=0.252, longest_s=6.0, stroke_rad=1e9)
    signals = record(Joint(), motion, seed=seed, noise_nm=0.01, velocity_noise_rad_s=0.0)
    noise = coloured(np.random.default_rng(1000 + seed), motion.time_s.size, 0.3, 0.9)
    return replace(
        signals,
        velocity_rad_s=motion.velocity_rad_s + noise,
        torque_nm=signals.torque_nm - gain_nm_s_per_rad * noise,
        velocity_command_rad_s=motion.velocity_rad_s,
    )


def test_the_loop_biases_least_squares_and_the_command_does_not() -> None:
    truth = {"viscous_nm_s_per_rad": 0.0107, "inertia_kg_m2": 0.0184}
    inside = []
    found = []
    for seed in range(20):
        fit = fit_instrumental([read_motion(closed_loop(seed))], CUTOFF_HZ)
        assert fit is not None
        assert fit.strength > 0.3
        both = (fit.least_squares, fit.parameters)
        found.append([[p[name].value - value for name, value in truth.items()] for p in both])
        ends = np.array([fit.parameters[name].ci95 for name in truth])
        values = np.array(list(truth.values()))
        inside.append((ends[:, 0] <= values) & (values <= ends[:, 1]))
    errors = np.array(found)
    bias = errors.mean(axis=0)
    sigma = errors.std(axis=0) / np.sqrt(20.0)
    assert np.all(bias[0] < -5.0 * sigma[0])
    assert np.all(np.abs(bias[1]) < 3.0 * sigma[1])
    assert np.all(np.abs(bias[1]) < 0.3 * np.abs(bias[0]))
    # 20 seeds: an honest 95 % interval covers 16 or more times in 997 of 1000 such tests.
    assert np.all(np.sum(inside, axis=0) >= 16), inside


def test_a_command_in_either_form_is_the_same_instrument() -> None:
    signals = closed_loop(3)
    assert signals.position_rad is not None
    by_position = replace(
        signals, velocity_command_rad_s=None, position_command_rad=signals.position_rad
    )
    one = fit_instrumental([read_motion(signals)], CUTOFF_HZ)
    other = fit_instrumental([read_motion(by_position)], CUTOFF_HZ)
    assert one is not None
    assert other is not None
    for name in ("inertia_kg_m2", "viscous_nm_s_per_rad"):
        assert other.parameters[name].value == pytest.approx(one.parameters[name].value, rel=0.02)


def test_a_command_that_the_joint_does_not_follow_is_refused() -> None:
    signals = record(Joint(), STAIR)
    rng = np.random.default_rng(5)
    deaf = coloured(rng, STAIR.time_s.size, 30.0, 0.9999)
    fit = fit_instrumental([read_motion(replace(signals, velocity_command_rad_s=deaf))], CUTOFF_HZ)
    assert fit is not None
    assert fit.strength < 0.1
    inertia = fit.parameters["inertia_kg_m2"]
    assert not inertia.identified
    assert "command" in inertia.reason
    with pytest.raises(ValueError, match="found neither"):
        fit_instrumental([read_motion(signals)], CUTOFF_HZ)


def regression(n: int = 400, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((n, 3)) @ np.array([[1, 0, 0], [0.9, 1e-3, 0], [0, 0.2, scale]])
    return columns, columns @ np.array([1.0, -2.0, 0.5]) + 0.1 * rng.standard_normal(n)


@pytest.mark.parametrize("block", [1, 7, 400])
def test_recursion_equals_batch(block: int) -> None:
    columns, target = regression(scale=1e-4)
    state = RecursiveLeastSquares.start(3)
    for start in range(0, target.size, block):
        state = state.update(columns[start : start + block], target[start : start + block])
    batch, (sse,), *_ = np.linalg.lstsq(columns, target, rcond=None)
    np.testing.assert_allclose(state.theta, batch, rtol=1e-8)
    covariance = sse / (400 - 3) * np.linalg.inv(columns.T @ columns)
    np.testing.assert_allclose(state.covariance, covariance, rtol=1e-6)
    assert state.condition_number == pytest.approx(np.linalg.cond(columns), rel=1e-8)
    assert state.weight == 400


def followed(columns: Floats, target: Floats, forgetting: float, every: int) -> list[Floats]:
    """Return the estimate after each so many rows."""
    state, thetas = RecursiveLeastSquares.start(columns.shape[1], forgetting), []
    for start in range(0, target.shape[0], every):
        state = state.update(columns[start : start + every], target[start : start + every])
        thetas.append(state.theta)
    return thetas


def test_recursion_with_forgetting_is_weighted_least_squares() -> None:
    columns, target = regression()
    (*_, last) = followed(columns, target, 0.98, 50)
    weight = np.asarray(0.98 ** np.arange(399.0, -1.0, -1.0), dtype=np.float64)
    blocks = time_blocks(np.arange(400.0), 20)
    fit = solve_blocks(columns, columns * weight[:, np.newaxis], target, blocks)
    np.testing.assert_allclose(last, fit.theta, rtol=1e-8)


def test_forgetting_follows_a_friction_that_changes() -> None:
    rng = np.random.default_rng(0)
    columns = np.column_stack((rng.standard_normal(2000), np.sign(rng.standard_normal(2000))))
    coulomb = np.where(np.arange(2000) < 1000, 0.6, 0.9)
    target = 0.01 * columns[:, 0] + coulomb * columns[:, 1] + 0.02 * rng.standard_normal(2000)
    alert = followed(columns, target, 0.99, 100)
    steady = followed(columns, target, 1.0, 100)
    assert alert[9][1] == pytest.approx(0.6, abs=0.02)
    assert alert[-1][1] == pytest.approx(0.9, abs=0.02)
    assert steady[-1][1] == pytest.approx(0.75, abs=0.02)


def test_recursion_says_when_it_does_not_know() -> None:
    state = RecursiveLeastSquares.start(2).update(np.array([[1.0, 2.0]]), np.array([3.0]))
    assert np.all(np.isnan(state.theta))
    again = state.update(np.array([[2.0, 4.0]]), np.array([6.0]))
    assert np.all(np.isnan(again.theta))
    with pytest.raises(ValueError, match="finite"):
        state.update(np.array([[np.nan, 1.0]]), np.array([1.0]))
    with pytest.raises(ValueError, match="forgetting"):
        RecursiveLeastSquares.start(2, 1.1)


def test_the_course_of_a_regression_ends_at_the_batch_and_says_how_long_it_took() -> None:
    found = rows(record(Joint(), STAIR))
    course = course_of(found)
    assert course is not None
    columns = found.some([PARAMETERS.index(name) for name in course.parameters])
    batch = np.linalg.lstsq(columns, found.torque_nm, rcond=None)[0]
    np.testing.assert_allclose(course.theta[-1], batch, rtol=1e-8)
    settled = course.settled_s()
    for name, k in zip(course.parameters, range(3), strict=True):
        late = course.time_s >= settled[name]
        assert np.all(np.abs(course.theta[late, k] / batch[k] - 1.0) <= 0.01), name
        assert 0.0 < settled[name] <= course.time_s[-1]
    # The stair drives its fast speeds last: viscous friction takes longest.
    assert settled["viscous_nm_s_per_rad"] == max(settled.values())


def test_thresholding_halves_the_condition_number_and_costs_the_inertia_its_sharpness() -> None:
    sweep = sweep_acceleration(rows(record(Joint(), STAIR)))
    assert sweep.samples[0] == rows(record(Joint(), STAIR)).torque_nm.size
    assert np.all(np.diff(sweep.samples) <= 0)
    assert sweep.condition_number.min() < 0.5 * sweep.condition_number[0]
    known = np.flatnonzero(np.isfinite(sweep.theta[:, 0]))
    deviation = sweep.standard_deviation
    assert deviation[known[-1], 0] > 3.0 * deviation[0, 0]
    np.testing.assert_allclose(sweep.theta[0], [0.0184, 0.0107, 0.6042], rtol=0.02)


def test_a_threshold_that_leaves_nothing_gives_no_number() -> None:
    found = rows(record(Joint(), STAIR))
    sweep = sweep_acceleration(found, np.array([1e-9, 1e9]))
    assert sweep.samples[0] == found.torque_nm.size
    assert np.all(np.isnan(sweep.theta[1]))
    assert sweep.best == 0
    with pytest.raises(ValueError, match="above 0"):
        sweep_acceleration(found, np.array([0.0]))
    with pytest.raises(ValueError, match="names out of"):
        sweep_acceleration(found, parameters=("mass",))


def test_faster_point_to_point_moves_are_worse_conditioned() -> None:
    speeds = (10.0, 40.0, 80.0, 140.0)
    runs = []
    for speed in reversed(speeds):
        moves = stair([speed] * 6, rate_hz=250.0, ramp_s=0.252, stroke_rad=100.0, longest_s=10.0)
        runs.append(rows(record(Joint(), moves)))
    study = study_speeds(runs)
    np.testing.assert_allclose(study.speed_rad_s, speeds, rtol=0.05)
    assert np.all(np.diff(study.condition_number) > 0.0)
    assert study.condition_number[-1] > 3.0 * study.condition_number[0]


def judged(joint: Joint, noise_nm: float = 0.02, memory: float = 0.0) -> tuple[str, Residual]:
    signals = record(joint, STAIR, noise_nm=noise_nm, memory=memory)
    found = identify([signals], cutoff_hz=CUTOFF_HZ)
    assert found.estimate.rigid_body is not None
    stretches = filter_motion(read_motion(signals), CUTOFF_HZ)
    residual = residual_of(stretches, found.estimate.rigid_body, CUTOFF_HZ)
    return " ".join(residual_in_words(residual, correlate(residual))), residual


def test_the_residual_of_a_true_model_is_white_and_uncorrelated() -> None:
    text, residual = judged(Joint())
    correlation = correlate(residual)
    assert correlation.auto[0] == pytest.approx(1.0)
    assert correlation.auto_outside < 0.1
    assert correlation.cross_outside < 0.1
    assert "energy depends" not in text
    assert "uncorrelated with the velocity" in text


def test_the_residual_names_friction_that_the_law_lacks() -> None:
    text, _ = judged(Joint(static_extra_nm=0.4, stribeck_velocity_rad_s=12.0))
    assert "depends on the velocity alone" in text


def test_bands_hold_99_percent_of_chance() -> None:
    outside_auto, outside_cross = [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        velocity = coloured(rng, 600, 10.0, 0.9)
        residual = Residual(coloured(rng, 600, 1.0, 0.7), velocity, np.gradient(velocity), 0.1)
        outside_cross.append(correlate(residual).cross_outside)
        white = replace(residual, residual_nm=rng.standard_normal(600))
        outside_auto.append(correlate(white).auto_outside)
    assert np.mean(outside_auto) < 0.02
    # The coloured band must not shrink to the white one, which 20 % would leave.
    assert np.mean(outside_cross) < 0.04
    with pytest.raises(ValueError, match="at least 40"):
        correlate(Residual(np.zeros(10), np.zeros(10), np.zeros(10), 0.1))


def test_masked_samples_take_no_part() -> None:
    rng = np.random.default_rng(4)
    residual = Residual(rng.standard_normal(500), rng.standard_normal(500), np.ones(500), 0.1)
    holes = residual.residual_nm.copy()
    holes[100:150] = np.nan
    whole, pierced = correlate(residual), correlate(replace(residual, residual_nm=holes))
    assert pierced.auto_band[1] > whole.auto_band[1]
    assert np.all(np.isfinite(pierced.auto))
    assert explained_share(np.arange(500.0), rng.standard_normal(500)) < 0.05


def test_instruments_are_strong_where_they_span_the_columns() -> None:
    rng = np.random.default_rng(6)
    columns = rng.standard_normal((300, 3))
    mixed = columns @ rng.standard_normal((3, 3))
    assert instrument_strength(columns, mixed) == pytest.approx(1.0)
    assert instrument_strength(columns, rng.standard_normal((300, 3))) < 0.3
    fit = solve_blocks(columns, mixed, columns @ np.ones(3), time_blocks(np.arange(300.0), 20))
    np.testing.assert_allclose(fit.theta, 1.0, rtol=1e-9)
    with pytest.raises(ValueError, match="more blocks"):
        solve_blocks(columns, mixed, columns[:, 0], np.zeros(300, dtype=np.int64))
