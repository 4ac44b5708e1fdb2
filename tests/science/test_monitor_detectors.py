"""What every detector must keep to, and what the tuned CUSUM promises."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.identify.result import Floats
from agent.monitor.baseline.growth import LAG, MOST_GROWN, MOST_SCATTERED, grown
from agent.monitor.detection.cusum import Cusum
from agent.monitor.detection.detectors import DETECTORS, detector
from agent.monitor.detection.run_length import siegmund, threshold_for
from agent.monitor.detection.series import FEATURES, FeatureSeries, State
from agent.monitor.detection.standing import standing
from agent.monitor.detection.tuning import SLOWEST_CYCLES, Target, tune
from tests.benchmarks.monitor_delay import (
    FIRST,
    LEVEL,
    false_rate,
    first_alarm,
    healthy_years,
    measure,
    series_of,
)
from tests.benchmarks.monitor_reference import line_for
from tests.science.monitor_fleet import Life, episodes, live, low_speed_share
from tests.science.monitor_joint import DAY_S
from tests.science.run_length_chain import brook_evans

ORDER = list(State)
HEALTHY = 20
WORDS = sorted(DETECTORS)


def made(seed: int, rise: float = 0.0, n: int = 50, missing: float = 0.0) -> FeatureSeries:
    """Return four features that rise together from cycle 30 on."""
    rng = np.random.default_rng(seed)
    values, deviations, shared = {}, {}, {}
    ramp = rise * np.maximum(0.0, np.arange(n) - 30.0)
    for name in FEATURES:
        y = 5.0 * (1.0 + 0.01 * rng.standard_normal(n) + ramp)
        y[(rng.uniform(size=n) < missing) & (np.arange(n) >= HEALTHY)] = np.nan
        values[name], deviations[name] = y, np.full(n, 0.06)
        shared[name] = 0.03 * rng.uniform(size=n)
    return FeatureSeries(DAY_S * np.arange(n, dtype=float), values, deviations, HEALTHY, shared)


def each(series: FeatureSeries, change: Callable[[Floats], Floats]) -> FeatureSeries:
    """Return a series whose features and deviations are changed, and the time cut as they are."""
    parts = (
        {name: change(v) for name, v in part.items()}
        for part in (series.values, series.deviations, series.shared)
    )
    values, deviations, shared = parts
    time_s = series.time_s[: next(iter(values.values())).size]
    return FeatureSeries(time_s, values, deviations, series.healthy, shared)


def scaled(series: FeatureSeries, factor: float) -> FeatureSeries:
    return each(series, lambda v: factor * v)


def prefix(series: FeatureSeries, count: int) -> FeatureSeries:
    return each(series, lambda v: v[:count])


@pytest.mark.parametrize("word", WORDS)
@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    rise=st.floats(0.0, 0.1),
    count=st.integers(HEALTHY, 49),
    power=st.integers(-10, 10),
)
def test_no_detector_knows_the_future_or_the_unit(
    word: str, seed: int, rise: float, count: int, power: int
) -> None:
    """What is said of the first cycles is said without the later ones; mN m is as good as N m."""
    series = made(seed, rise, missing=0.1)
    states = detector(word).judge(series).states
    assert detector(word).judge(prefix(series, count)).states == states[:count]
    assert detector(word).judge(scaled(series, 2.0**power)).states == states


@pytest.mark.parametrize("word", ["cusum", "3-sigma", "likelihood-ratio"])
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), rise=st.floats(0.0, 0.05), more=st.floats(0.0, 0.05))
def test_more_friction_is_never_less_of_an_alarm(
    word: str, seed: int, rise: float, more: float
) -> None:
    low, high = (detector(word).judge(made(seed, r)).states for r in (rise, rise + more))
    assert all(ORDER.index(a) <= ORDER.index(b) for a, b in zip(low, high, strict=True))


@pytest.mark.parametrize("word", ["cusum", "multi-model", "likelihood-ratio"])
def test_a_rise_is_found_and_h1_comes_after_h0(word: str) -> None:
    for seed in range(5):
        judged = detector(word).judge(made(seed, 0.03))
        first, high = judged.first(State.INCREASED), judged.first(State.HIGH)
        assert first is not None, seed
        assert high is not None, seed
        assert 30 < first < high, seed


@pytest.mark.parametrize("word", sorted(DETECTORS.keys() - {"thesis-recursive"}))
def test_one_bad_cycle_is_no_h1_and_for_the_product_no_alarm(word: str) -> None:
    """Not so the thesis's recursive reading, whose sum outlasts the cycle (docs/detection.md)."""
    for seed in range(5):
        series = made(seed)
        for y in series.values.values():
            y[40] *= 3.0
        states = detector(word).judge(series).states
        assert State.HIGH not in states, seed
        if word in ("cusum", "multi-model", "3-sigma"):
            assert set(states) == {State.NO_FAULT}, seed


def test_missing_cycles_change_no_state() -> None:
    series = made(3, 0.03, missing=0.4)
    judged = Cusum().judge(series)
    lost = np.flatnonzero(
        np.isnan(series.values["low_integral_w"]) & np.isnan(series.values["integral_w"])
    )
    assert lost.size
    assert all(judged.states[i] is judged.states[i - 1] for i in lost)


def test_an_error_that_compensation_shares_is_no_rise() -> None:
    """3 % more in all of a season that the healthy cycles did not see, and said to be unsure."""
    series = made(1, n=80)
    for name, y in series.values.items():
        y[40:] *= 1.03
        series.shared[name][40:] = 0.03 * 5.0
        series.deviations[name][40:] = np.hypot(0.05, 0.15)
    assert set(Cusum().judge(series).states) == {State.NO_FAULT}
    sure = dataclasses.replace(series, shared={k: 0.0 * v for k, v in series.shared.items()})
    sure = dataclasses.replace(sure, deviations={k: 0.0 * v + 0.05 for k, v in sure.values.items()})
    assert State.INCREASED in Cusum().judge(sure).states


@pytest.mark.parametrize(("drift", "threshold"), [(-0.5, 3.0), (-1.0, 1.5), (0.5, 4.0)])
def test_run_lengths_agree_with_each_other_and_with_simulation(
    drift: float, threshold: float
) -> None:
    rng = np.random.default_rng(2)
    g, lengths, running = np.zeros(1500), np.zeros(1500), np.ones(1500, dtype=bool)
    while running.any():
        g = np.maximum(0.0, g + drift + rng.standard_normal(g.size))
        lengths += running
        running &= g <= threshold
    chain = brook_evans(drift, threshold)
    standard_error = float(np.std(lengths)) / np.sqrt(lengths.size)
    assert float(np.mean(lengths)) == pytest.approx(chain, abs=4.0 * standard_error)
    assert float(siegmund(drift, threshold)) == pytest.approx(chain, rel=0.1)


def test_a_threshold_is_found_for_a_run_length() -> None:
    assert float(siegmund(-0.5, threshold_for(-0.5, 500.0))) == pytest.approx(500.0)


def flat(healthy: int, noise: float, seed: int = 0) -> FeatureSeries:
    rng = np.random.default_rng(seed)
    return series_of(LEVEL * (1.0 + noise * rng.standard_normal(healthy)), healthy)


def test_tuning_asks_more_of_a_short_and_a_noisy_baseline_and_says_what_it_leaves_open() -> None:
    target = Target()
    short, long, noisy = (
        tune(standing(flat(n, noise), "low_integral_w"), target, 365.25)
        for n, noise in ((15, 0.01), (200, 0.01), (200, 0.03))
    )
    assert short.decidable
    assert short.delay_cycles > long.delay_cycles
    assert noisy.delay_cycles > long.delay_cycles
    open_short, open_long = (up / low for low, up in (t.rate_ci95_per_year for t in (short, long)))
    assert open_short > 10.0 * open_long
    assert "a year expected" in short.sentence
    for tuning in (short, long, noisy):
        assert tuning.rate_per_year == pytest.approx(0.04, rel=0.01)


def test_a_joint_that_scatters_is_tuned_to_the_smallest_rise_found_in_time() -> None:
    """And to no larger one, which would find the smallest that it can far later than it could."""
    rises = []
    for noise in np.geomspace(0.02, 0.06, 12):
        found = standing(flat(30, noise), "low_integral_w")
        tuning = tune(found, Target(), 365.25)
        rises.append(tuning.rise)
        assert tuning.delay_cycles <= SLOWEST_CYCLES
        assert tuning.rise == Target().smallest_rise or tuning.delay_cycles > 0.8 * SLOWEST_CYCLES
    assert rises == sorted(rises)
    assert rises[-1] > 2.0 * rises[0]


def test_what_is_promised_is_never_sooner_than_two_cycles() -> None:
    """A quiet joint's rise is many scatters: one cycle would show it, and none may decide alone."""
    series = flat(40, 0.002)
    assert Cusum().tunings(series)["low_integral_w"].delay_cycles == pytest.approx(2.0)
    assert "after about 2 cycles" in Cusum().promise(series)
    assert "no single cycle decides" in Cusum().promise(series)


def test_the_promise_counts_the_baseline_that_the_verdict_names_and_says_what_it_left_out() -> None:
    series = flat(30, 0.01)
    off = {name: np.where(np.arange(v.size) == 7, 1.4 * v, v) for name, v in series.values.items()}
    said = Cusum().promise(dataclasses.replace(series, values=off))
    assert said.startswith("30 healthy cycles (1 left out, too far off): a lasting rise of")


@pytest.mark.parametrize("healthy", [1, 3])
def test_too_short_a_baseline_is_not_decidable_and_never_an_alarm(healthy: int) -> None:
    series = dataclasses.replace(made(0, 0.05), healthy=healthy)
    tunings = Cusum().tunings(series)
    assert all("not decidable" in t.sentence for t in tunings.values())
    assert set(Cusum().judge(series).states) == {State.NO_FAULT}


def test_the_false_alarm_rate_is_the_one_asked_for() -> None:
    """Asked for six a year: two fifths are left to noise, and the law is exact here."""
    robots, nights, alarms, watched = 60, 365, 0, 0
    for seed in range(robots):
        rng = np.random.default_rng(seed)
        values: Floats = LEVEL * (1.0 + 0.02 * rng.standard_normal(60 + nights))
        at = first_alarm(Cusum(Target(increased_per_year=6.0)), values, 60)
        alarms += at is not None
        watched += nights if at is None else at - 59
    assert 0.5 <= alarms / (watched / 365.25) <= 4.0


def test_the_delay_is_near_the_optimum() -> None:
    """A slice of ``tests.benchmarks.monitor``, at a false-alarm rate that few robots show."""
    detector = Cusum(Target(smallest_rise=0.03, increased_per_year=6.0))
    rate, alarms = false_rate(detector, FIRST, 0.02, 30, 1.0, grows=True)
    line = line_for(healthy_years(FIRST, 0.02, 30, 1.0), alarms, 0.03 * LEVEL, FIRST)
    delay = measure((130,), 0.02, 0.03, rate, line, robots=40, per_year=6.0)
    assert delay.ratio <= 1.4, delay
    assert delay.optimum <= 1.1 * delay.fair, delay  # knowing more is no worse
    assert delay.cycles <= 1.25 * delay.fair, delay


def test_a_simulated_fleet_is_quiet_when_healthy_and_its_wear_is_found() -> None:
    """A slice of ``tests.benchmarks.monitor``: seasons, payloads, bad cycles, the whole chain."""
    life = Life(nights=60 + 240)
    false = sum(
        episodes(Cusum().judge(live(life, s).compensated(60)).states, State.INCREASED)
        for s in range(12)
    )
    assert false <= 2
    found = []
    for seed in range(8):
        wear = 0.3 * np.maximum(0.0, np.arange(life.nights) - 90.0) / 365.0
        nights = live(life, 500 + seed, wear / low_speed_share(life.joint))
        judged = Cusum().judge(nights.compensated(60))
        at = judged.first(State.INCREASED)
        found.append(np.inf if at is None else 0.3 * (nights.day[at] - 90.0) / 365.0)
    assert np.median(found) <= 0.08


def grown_states(values: Floats, first: int) -> tuple[int, tuple[State, ...]]:
    """Return the last baseline's length and the states under a baseline that grows."""
    length, judged = grown(lambda n, _: series_of(values, n), first, Cusum())
    return length, judged.states


@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 10_000), rise=st.sampled_from([0.0, 0.02, 0.05]), cut=st.integers(20, 99)
)
def test_a_growing_baseline_knows_no_future(seed: int, rise: float, cut: int) -> None:
    rng = np.random.default_rng(seed)
    values: Floats = LEVEL * (1.0 + 0.01 * rng.standard_normal(100))
    values[60:] += rise * LEVEL
    assert grown_states(values[:cut], 15)[1] == grown_states(values, 15)[1][:cut]


def test_a_growing_baseline_grows_while_nothing_is_suspected_and_to_its_bound() -> None:
    rng = np.random.default_rng(2)
    healthy: Floats = LEVEL * (1.0 + 0.01 * rng.standard_normal(300))
    assert grown_states(healthy, 15) == (MOST_GROWN, (State.NO_FAULT,) * 300)
    assert grown_states(healthy[: MOST_GROWN + LAG - 1], 15)[0] < MOST_GROWN
    scattered = LEVEL + 3.0 * (healthy - LEVEL)
    assert MOST_GROWN < grown_states(scattered, 15)[0] <= MOST_SCATTERED
    worn = healthy + 0.1 * LEVEL * (np.arange(300) >= 50)
    length, states = grown_states(worn, 15)
    assert length <= 50 - LAG + 2
    assert State.INCREASED in states[50:54]


def test_a_fall_ends_a_baseline_unless_it_ends_itself() -> None:
    rng = np.random.default_rng(5)
    healthy: Floats = LEVEL * (1.0 + 0.01 * rng.standard_normal(300))
    night = np.arange(300)
    assert grown_states(healthy - 0.06 * LEVEL * (night >= 60), 20)[0] <= 60
    assert grown_states(healthy - 0.06 * LEVEL * ((night >= 60) & (night < 66)), 20)[0] >= 120


def test_a_baseline_goes_on_growing_after_an_alarm_that_ended_by_itself_and_not_in_one() -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        values: Floats = LEVEL * (1.0 + 0.01 * rng.standard_normal(300))
        values[40:46] += 0.06 * LEVEL
        at_its_start, during = grown_states(values[:40], 20)[0], grown_states(values[:46], 20)
        assert State.INCREASED in during[1], seed
        assert during[0] <= at_its_start + LAG, seed
        length, states = grown_states(values, 20)
        assert MOST_GROWN <= length <= MOST_SCATTERED, seed
        assert len(states) == 300, seed
        worn = values + 0.03 * LEVEL * (np.arange(300) >= 46)
        assert grown_states(worn, 20)[0] <= during[0] + LAG, seed


@pytest.mark.parametrize("per_year", [0.1, 0.4])
def test_slow_wear_is_not_learned_as_health(per_year: float) -> None:
    """Wear from the first night on: what is learned of it delays the alarm by 0.5 % at most."""
    kept, grew = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        nights = np.arange(400)
        values = LEVEL * (1.0 + 0.01 * rng.standard_normal(400) + per_year / 365.0 * nights)
        first = first_alarm(Cusum(), values, 30)
        states = grown_states(values, 30)[1]
        kept.append(400 if first is None else first)
        grew.append(next((i for i, s in enumerate(states) if s is not State.NO_FAULT), 400))
    late = per_year / 365.0 * (np.median(grew) - np.median(kept))
    assert late <= 0.005


def test_an_unknown_word_names_the_known_ones() -> None:
    with pytest.raises(ValueError, match="cusum, thesis"):
        detector("magic")
