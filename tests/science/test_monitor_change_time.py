"""The change time and the outlook against simulated changes whose truth is known."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from agent.identify.result import Floats
from agent.monitor.change.change_time import change_time, credible
from agent.monitor.change.outlook import outlook
from agent.monitor.change.posterior import change_posterior
from agent.monitor.detection.cusum import DECIDING
from agent.monitor.detection.series import FeatureSeries
from tests.benchmarks.monitor_change import CASES, Course, campaign
from tests.benchmarks.monitor_delay import DAY_S, LEVEL, series_of
from tests.science.monitor_fleet import correlated

HEALTHY, N = 40, 120


def nights(rise: Callable[[Floats], Floats], seed: int = 0, noise: float = 0.01) -> FeatureSeries:
    """Return a low-speed integral with a rise, as a share, over the nights after the 70th."""
    rng = np.random.default_rng(seed)
    after = np.maximum(0.0, np.arange(N) - 69.0)
    return series_of(LEVEL * (1.0 + rise(after) + noise * rng.standard_normal(N)), HEALTHY)


def step(after: Floats) -> Floats:
    return np.where(after > 0.0, 0.05, 0.0)


def ramp(after: Floats) -> Floats:
    return 0.004 * after


@pytest.mark.parametrize("course", CASES, ids=lambda c: c.name)
def test_change_times_are_near_and_their_intervals_cover(course: Course) -> None:
    """A slice of ``tests.benchmarks.monitor``, with room for the chance of few seeds."""
    score = campaign(course, range(60))
    assert score.median_error <= 3.0
    assert score.coverage >= 0.85
    assert abs(score.coverage - score.stated) <= 0.1
    assert score.undecided <= 0.2


@pytest.mark.parametrize(("rise", "shape"), [(step, "step"), (ramp, "ramp")])
def test_the_shape_of_a_clear_change_is_told(rise: Callable[[Floats], Floats], shape: str) -> None:
    found = change_time(nights(rise))
    assert max(found.shapes, key=lambda name: found.shapes[name]) == shape
    assert found.time_ci95_s[0] <= 70.0 * DAY_S <= found.time_ci95_s[1]
    assert found.rise.ci95 is not None
    truth = float(rise(np.array([N - 70.0]))[0])
    assert found.rise.ci95[0] <= truth <= found.rise.ci95[1]


@pytest.mark.parametrize(
    ("probability", "run"),
    [
        ([0.0, 0.99, 0.01], (1, 1, 0.99)),  # one cycle is all there can be, and says 99 %
        ([0.02, 0.5, 0.44, 0.04], (1, 2, 0.94)),  # nearer to 95 % than the 98 % of one more
        ([0.02, 0.5, 0.40, 0.08], (1, 3, 0.98)),  # 90 % would be further off
        ([0.25, 0.25, 0.25, 0.25], (0, 3, 1.0)),
    ],
)
def test_the_interval_is_the_run_of_cycles_nearest_to_95_percent(
    probability: list[float], run: tuple[int, int, float]
) -> None:
    assert credible(np.array(probability)) == pytest.approx(run)


def test_the_correlation_of_neighbours_is_that_of_all_nights_and_no_rise_makes_it() -> None:
    """Sixty nights of baseline alone knew 0.30 of 0.4, and intervals held the change in 88 %."""
    shown: dict[float, list[float]] = {0.0: [], 0.4: []}
    for memory, ties in shown.items():
        for seed in range(40):
            rng = np.random.default_rng([5, seed])
            rise = 0.001 * np.maximum(0.0, np.arange(200) - 110.0)
            values = LEVEL * (1.0 + 0.01 * correlated(200, memory, rng) + rise)
            found = change_posterior(series_of(values, 60), DECIDING)
            assert found is not None
            ties.append(found.found.autocorrelation)
    assert np.mean(shown[0.0]) < 0.06
    assert 0.33 < np.mean(shown[0.4]) < 0.42


def test_nothing_changed_is_not_decidable() -> None:
    said = [change_time(nights(lambda t: 0.0 * t, seed)).decidable for seed in range(40)]
    assert sum(said) <= 4
    found = change_time(nights(lambda t: 0.0 * t))
    assert math.isnan(found.time_s)
    assert "not decidable" in found.sentence


def test_unit_and_one_bad_cycle_do_not_move_the_change_time() -> None:
    series = nights(step)
    first = change_time(series)
    scaled = {"low_integral_w": 1024.0 * series.values["low_integral_w"]}
    wide = {"low_integral_w": 1024.0 * series.deviations["low_integral_w"]}
    other = change_time(dataclasses.replace(series, values=scaled, deviations=wide))
    assert (other.cycle, other.cycle_ci95) == (first.cycle, first.cycle_ci95)
    series.values["low_integral_w"][55] *= 1.5
    assert abs(change_time(series).cycle - 70) <= 1


def test_a_gap_widens_the_interval_of_time_and_not_of_cycles() -> None:
    series = nights(step)
    later = series.time_s + np.where(np.arange(N) >= 70, 30.0 * DAY_S, 0.0)
    found = change_time(dataclasses.replace(series, time_s=later))
    assert found.time_ci95_s[0] <= 69.0 * DAY_S
    assert found.time_ci95_s[1] >= 100.0 * DAY_S
    assert found.cycle == 70


def test_the_outlook_of_a_ramp_holds_the_day_that_the_limit_is_reached() -> None:
    """A rise of 0.4 % a night from the 69th on reaches 30 % on the 144th."""
    held = 0
    for seed in range(20):
        ahead = outlook(nights(ramp, seed), 0.3)
        assert ahead.decidable, ahead.sentence
        assert "if nothing changes" in ahead.sentence
        held += ahead.earliest_s <= 144.0 * DAY_S <= ahead.latest_s
    assert held >= 18


def test_no_outlook_without_a_trend() -> None:
    for series in (nights(step), nights(lambda t: 0.0 * t)):
        ahead = outlook(series, 0.3)
        assert not ahead.decidable
        assert "not decidable" in ahead.sentence
    far = outlook(nights(ramp), 5.0)
    assert "further than the trend bears" in far.sentence
    assert "already" in outlook(nights(lambda t: 0.02 * t), 0.3).sentence
    with pytest.raises(ValueError, match="above the baseline"):
        outlook(nights(ramp), 0.0)


def test_later_nights_make_an_outlook_surer() -> None:
    def width(count: int) -> float:
        series = nights(ramp)
        cut = FeatureSeries(
            series.time_s[:count],
            {k: v[:count] for k, v in series.values.items()},
            {k: v[:count] for k, v in series.deviations.items()},
            HEALTHY,
        )
        ahead = outlook(cut, 0.3)
        return ahead.latest_s - ahead.earliest_s

    assert width(N) < width(90)
