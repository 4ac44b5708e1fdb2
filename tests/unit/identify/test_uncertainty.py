"""Quantiles, correlation times, and the block jackknife against what theory says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from agent.identify.uncertainty import (
    block_jackknife,
    correlation_time,
    covariance_of_one_memory,
    jackknife_of_even_noise,
    student_975,
    variance_of_mean,
)
from tests.science.identify_plant import coloured


@pytest.mark.parametrize("dof", [1, 2, 3, 4, 5, 8, 13, 40, 400, 1e5])
def test_student_quantile(dof: float) -> None:
    assert student_975(dof) == pytest.approx(float(stats.t.ppf(0.975, dof)), rel=1e-3)


@pytest.mark.parametrize("dof", [1.3, 1.7, 2.4])
def test_student_quantile_between_the_closed_forms(dof: float) -> None:
    assert student_975(dof) == pytest.approx(float(stats.t.ppf(0.975, dof)), rel=0.03)


def test_no_freedom_no_interval() -> None:
    assert student_975(0.0) == np.inf


@pytest.mark.parametrize("memory", [0.0, 0.8, 0.95])
def test_correlation_time_of_autoregressive_noise(memory: float) -> None:
    rng = np.random.default_rng(1)
    series = [3.0 * i + coloured(rng, 1500, 1.0, memory) for i in range(12)]
    truth = (1.0 + memory) / (1.0 - memory)
    assert correlation_time(series) == pytest.approx(truth, rel=0.5, abs=1.0)
    assert correlation_time(series) > 0.8 * truth


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_interval_of_a_mean_covers_the_truth(memory: float) -> None:
    rng = np.random.default_rng(2)
    hits = 0
    for _ in range(300):
        x = coloured(rng, 400, 1.0, memory)
        variance, dof = variance_of_mean(x, correlation_time([x]))
        hits += abs(x.mean()) <= student_975(dof) * np.sqrt(variance)
    assert 0.90 <= hits / 300 <= 0.995


def test_block_jackknife_covers_under_coloured_noise_where_white_theory_fails() -> None:
    rng = np.random.default_rng(3)
    n, hits, white_hits = 2000, 0, 0
    columns = np.stack([np.ones(n), np.sin(np.arange(n) / 40.0)], axis=1)
    blocks = np.arange(n) // 50
    for _ in range(200):
        y = columns @ np.array([1.0, 2.0]) + coloured(rng, n, 1.0, 0.9)
        theta, covariance, dof = block_jackknife(columns, y, blocks)
        hits += abs(theta[0] - 1.0) <= student_975(dof) * np.sqrt(covariance[0, 0])
        residual = y - columns @ theta
        white_hits += abs(theta[0] - 1.0) <= 1.96 * residual.std() / np.sqrt(n)
    assert 0.90 <= hits / 200 <= 0.99
    assert white_hits / 200 < 0.7


def test_what_the_jackknife_makes_of_even_noise_is_known() -> None:
    """A column that few blocks carry gets a quarter more variance than it has, on the average."""
    rng = np.random.default_rng(4)
    n = 160
    columns = np.stack([np.ones(n), np.exp(-np.arange(n) / 40.0)], axis=1)
    blocks = np.arange(n) // 8
    noise = rng.standard_normal((1000, n))
    found = np.mean([block_jackknife(columns, y, blocks)[1] for y in noise], axis=0)
    expected = jackknife_of_even_noise(columns, blocks)
    np.testing.assert_allclose(np.diag(expected), np.diag(found), rtol=0.06)
    excess = np.diag(expected) / np.diag(np.linalg.inv(columns.T @ columns))
    assert excess[1] > 1.2


def test_what_a_few_blocks_carry_is_known_by_all_blocks_noise() -> None:
    # Gravity at the ends of a stroke, in two blocks of forty: by chance they scatter too little.
    rng = np.random.default_rng(430_000)
    blocks = np.repeat(np.arange(40), 50)
    seldom = np.where(np.isin(blocks, (17, 31)), 1.0, 0.0)
    columns = np.column_stack((np.ones(2000), rng.standard_normal((2000, 2)), seldom))
    loud = np.where(blocks < 30, 1.0, 3.0)
    held = []
    for _ in range(300):
        noise = loud * coloured(rng, 2000, 1.0, 0.8)
        theta, scatter, dof = block_jackknife(columns, noise, blocks)
        shared = covariance_of_one_memory(columns, noise - columns @ theta, blocks)
        each = [np.diag(c)[-1] for c in (scatter, shared)]
        reach = student_975(dof) * np.sqrt((each[0], max(each)))
        held.append(np.abs(theta[-1]) <= reach)
    alone, least = np.mean(held, axis=0)
    assert alone < 0.9
    assert 0.92 <= least <= 0.98
