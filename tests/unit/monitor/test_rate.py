"""How often to test, and when a comparable cycle can be run."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.identify.thermal.cooling import estimate_cooling
from agent.monitor.detection.run_length import threshold_for
from agent.monitor.schedule.cooling import COLD, COMPARABLE, UNKNOWN, WARM, next_comparable, warmth
from agent.monitor.schedule.rate import Site, Wish, _ramp_cycles, plan_rate

SITE = Site(10.0, -0.009, 0.0005, 0.01)


@settings(max_examples=12, deadline=None)
@given(st.floats(0.002, 0.03), st.floats(0.02, 0.2), st.floats(1.1, 3.0))
def test_rarer_experiments_cost_less_and_see_later(
    scatter: float, wear: float, more: float
) -> None:
    site, wish = replace(SITE, scatter=scatter), Wish(wear_per_month=wear)
    often, rarely = plan_rate(site, wish, (1.0, more * 7.0)).rates
    assert rarely.minutes_per_year < often.minutes_per_year
    assert rarely.risen >= 0.98 * often.risen
    assert rarely.between >= often.between
    noisier = plan_rate(replace(site, scatter=2.0 * scatter), wish, (1.0,)).rates[0]
    assert noisier.risen >= 0.98 * often.risen


def test_the_change_between_two_experiments_is_that_of_the_swing() -> None:
    still = replace(SITE, weather_degc=0.0)
    day = np.arange(0.0, 365.25, 0.05)
    for interval in (7.0, 30.0, 100.0):
        change = still.temperature_degc(day + interval) - still.temperature_degc(day)
        seen = abs(still.slope_per_k) * float(np.abs(change).max())
        assert still.between(interval) == pytest.approx(seen, rel=1e-3)


@pytest.mark.parametrize(("growth", "drift"), [(0.17, 3.75), (1.2, 3.0), (0.05, 0.8)])
def test_wear_is_found_when_the_plan_says(growth: float, drift: float) -> None:
    threshold = threshold_for(-drift, 3650.0)
    rng = np.random.default_rng(5)
    total, found = np.zeros(2000), np.zeros(2000)
    for cycle in range(1, 400):
        step = growth * cycle - drift + rng.standard_normal(total.size)
        total = np.where(found > 0, total, np.maximum(0.0, total + step))
        found = np.where((found == 0) & (total > threshold), cycle, found)
    assert np.all(found > 0)
    mean, late = _ramp_cycles(growth, drift, threshold)
    assert mean == pytest.approx(float(found.mean()), rel=0.03)
    assert late == pytest.approx(float(np.quantile(found, 0.95)), rel=0.05, abs=1.0)


def test_the_cheapest_rate_that_sees_enough_is_advised_and_none_where_the_law_is_off() -> None:
    plan = plan_rate(SITE, Wish())
    assert plan.advised is not None
    cheaper = [r for r in plan.rates if r.interval_days > plan.advised.interval_days]
    assert all(r.risen_95 > plan.wish.limit * (1.0 + 1e-9) for r in cheaper)
    blind = plan_rate(replace(SITE, slope_deviation_per_k=0.01), Wish())
    assert blind.advised is None
    assert "compensation" in blind.sentence
    with pytest.raises(ValueError, match="above 0 days"):
        plan_rate(SITE, Wish(), (0.0,))


HEALTHY = np.array([22.0, 24.0, 26.0, 25.0])


def test_warm_cold_and_unknown_cycles_are_told_apart() -> None:
    words = [warmth(t, HEALTHY).word for t in (24.0, 30.0, 18.0, math.nan)]
    assert words == [COMPARABLE, WARM, COLD, UNKNOWN]
    assert warmth(24.0, np.full(5, np.nan)).word == UNKNOWN


@given(st.floats(28.0, 60.0), st.floats(0.0, 25.0))
def test_resting_the_said_time_makes_it_comparable(now: float, hall: float) -> None:
    found = warmth(now, HEALTHY)
    after = next_comparable(found, hall).after_s
    assert after.ci95 is not None
    reached = hall + (now - hall) * math.exp(-6.2e-5 * after.value)
    assert reached == pytest.approx(found.band_degc[1], abs=1e-6)
    assert after.ci95[0] < after.value < after.ci95[1] or after.value == 0.0


def test_the_joints_own_law_counts_from_now() -> None:
    time_s = np.arange(0.0, 4.0 * 3600.0, 60.0)
    rng = np.random.default_rng(4)
    curve = 20.0 + 25.0 * np.exp(-6e-5 * time_s) + 0.02 * rng.standard_normal(time_s.size)
    found = warmth(float(curve[-1]), HEALTHY)
    said = next_comparable(found, cooling=estimate_cooling(time_s, curve))
    truth_s = math.log(25.0 / 7.0) / 6e-5 - float(time_s[-1])  # 27 degC: a degree over the warmest
    assert said.after_s.ci95 is not None
    assert said.after_s.ci95[0] - 60.0 <= truth_s <= said.after_s.ci95[1] + 60.0
    assert "own cooling law" in said.sentence


def test_where_resting_does_not_lead_there_it_says_what_does() -> None:
    assert "warm it up" in next_comparable(warmth(15.0, HEALTHY), 20.0).sentence
    assert "cooler day" in next_comparable(warmth(35.0, HEALTHY), 30.0).sentence
    assert "let it cool to 27.0 °C" in next_comparable(warmth(35.0, HEALTHY)).sentence
    assert next_comparable(warmth(24.0, HEALTHY)).after_s.value == 0.0
