"""Friction that rises from the first cycle on is an alarm without a baseline; what falls is not."""

from __future__ import annotations

import json

import numpy as np
import pytest

from agent.conclude.facts import facts_of
from agent.conclude.monitor_document import to_json
from agent.identify.result import Floats
from agent.monitor.baseline.first_cycles import running_in, watch_of
from agent.monitor.baseline.trend import trend
from agent.monitor.compensation.compensation import Conditions
from agent.monitor.detection.cusum import DECIDING
from agent.monitor.detection.detectors import detector
from agent.monitor.detection.series import State
from agent.monitor.history.cycle import Cycle
from agent.monitor.history.history import histories
from agent.monitor.history.table import Features
from agent.monitor.verdict.finding import Finding
from agent.monitor.verdict.verdict import judge
from agent.report.monitor import monitor_html
from tests.science.monitor_fleet import Life, correlated, live, low_speed_share
from tests.unit.monitor.joint import Truth, cycle, months

DAY_S = 86_400.0


def plain(values: Floats, degc: Floats | None = None) -> Features:
    """Return cycles of one feature, at 30 degC unless another temperature is given."""
    unknown = np.full(values.size, np.nan)
    given = Conditions(np.full(values.size, 30.0) if degc is None else degc, unknown, unknown)
    return Features({DECIDING: values}, {DECIDING: 0.005 * np.abs(values)}, given)


def first_alarm(values: Floats, degc: Floats | None = None) -> int | None:
    """Return the first cycle at which the first cycles alone are an alarm."""
    watch = watch_of(
        plain(values, degc), DAY_S * np.arange(values.size, dtype=np.float64), detector()
    )
    assert watch is not None
    return watch.alone("cusum").first(State.INCREASED)


def said(cycles: list[Cycle], baseline: int | None = None) -> Finding:
    """Return what is said of one joint's cycles."""
    (history,) = histories(cycles)
    return judge(history, detector(), baseline)


def run_in(cycles: int, settles: float) -> list[Cycle]:
    """Return the cycles of a gear whose friction falls as it runs in."""
    rng = np.random.default_rng(3)
    truth = Truth(wear_nm=0.08)
    return [cycle(i, rng, truth, float(np.exp(-i / settles))) for i in range(cycles)]


@pytest.mark.parametrize("memory", [0.0, 0.6])
def test_without_a_trend_the_bayes_factor_is_one_on_average_and_seldom_large(memory: float) -> None:
    """Ville's bound, which the threshold stands on, for what may be asked at any time."""
    rng = np.random.default_rng(1)
    factors = np.exp(
        [
            trend(
                plain(100.0 * (1.0 + 0.01 * correlated(24, memory, rng))), np.arange(24.0), DECIDING
            ).against_none(1.0)
            for _ in range(150)
        ]
    )
    assert factors.mean() <= 2.0
    assert np.mean(factors >= 20.0) <= 0.05


def test_a_steady_joint_is_no_alarm_and_a_worn_one_is_whatever_its_unit() -> None:
    for seed in range(3):
        noise = 1.0 + 0.01 * np.random.default_rng(seed).standard_normal(120)
        assert first_alarm(100.0 * noise) is None
        worn = noise + 0.5 / 365.0 * np.arange(120)
        at = first_alarm(100.0 * worn)
        assert at is not None
        assert 0.5 / 365.0 * at <= 0.06
        assert first_alarm(0.3 * worn) == at


def test_it_knows_no_future() -> None:
    values = 100.0 * (
        1.0 + 0.01 * np.random.default_rng(5).standard_normal(90) + 0.002 * np.arange(90)
    )
    whole = watch_of(plain(values), DAY_S * np.arange(90, dtype=np.float64), detector())
    part = watch_of(plain(values[:40]), DAY_S * np.arange(40, dtype=np.float64), detector())
    assert whole is not None
    assert part is not None
    assert whole.alone("cusum").states[:40] == part.alone("cusum").states
    assert whole.log_rising[:40] == pytest.approx(part.log_rising)
    assert part.asked[9:].all(), "quick wear does not wait for a tenth more of them"


def test_a_season_that_goes_one_way_is_no_wear() -> None:
    """The hall cools by 12 degrees over 80 nights, and friction follows it."""
    rng = np.random.default_rng(2)
    degc = 30.0 - 0.15 * np.arange(80) + rng.standard_normal(80)
    values = 100.0 * (1.0 - 0.015 * (degc - 30.0) + 0.005 * rng.standard_normal(80))
    assert first_alarm(values, degc) is None
    assert first_alarm(values) is not None  # who is told a wrong temperature sees a rise
    unknown = plain(values, np.full(values.size, np.nan))
    time_s = DAY_S * np.arange(values.size, dtype=np.float64)
    assert watch_of(unknown, time_s, detector()) is None
    assert running_in(unknown.take(slice(None, None, -1)), time_s, detector()) is None


def test_wear_from_the_first_night_on_is_found_through_the_whole_chain() -> None:
    """A slice of ``tests.benchmarks.monitor``; the baseline's own alarm took 8 % and 26 %."""
    life = Life(nights=110)
    for rate, most in ((0.3, 0.065), (1.0, 0.105)):
        found = []
        for seed in range(5):
            risen = rate / 365.0 * np.arange(life.nights, dtype=np.float64)
            nights = live(life, 700 + seed, risen / low_speed_share(life.joint))
            watch = watch_of(nights.table(), nights.time_s, detector())
            assert watch is not None
            at = watch.alone("cusum").first(State.INCREASED)
            found.append(np.inf if at is None else rate / 365.0 * nights.day[at])
        assert np.median(found) <= most, rate


@pytest.mark.parametrize("cycles", [14, 60])
def test_wear_from_the_first_cycle_on_is_said_with_and_without_a_baseline(cycles: int) -> None:
    finding = said(months(1, cycles, Truth(wear_nm=0.15, onset=0, scatter=0.008)))
    assert finding.status == "H0"
    assert finding.sentence.startswith("Friction has been rising since the first cycle: +")
    assert "there is no healthy period to compare with" in finding.sentence
    assert "perhaps before the first cycle" in finding.timing[0]
    assert finding.change is not None
    assert finding.change.cycle_ci95[0] == 0
    assert finding.reasons is not None
    assert finding.reasons.causes[0].id == "wear"
    assert finding.next_steps
    assert finding.current is not None
    assert finding.current.promise == ""
    facts = facts_of(finding)
    assert facts["said"] == "rising"
    assert facts["since_first"]["from"] > 0.0
    (joint,) = json.loads(json.dumps(to_json([finding], []), allow_nan=False))["joints"]
    assert joint["change_time"]["ci95"][0] is None
    assert joint["segments"][0]["state"][-1] == "H0"
    assert "Friction has been rising since the first cycle" in monitor_html([finding], [])


def test_wear_that_begins_later_is_not_said_to_be_there_from_the_first_cycle_on() -> None:
    finding = said(months(2, 90, Truth(wear_nm=0.15, onset=45)))
    assert finding.alarm
    assert finding.sentence.startswith("Friction is up ")
    assert finding.since_first is None


@pytest.mark.parametrize("cycles", [25, 80])
def test_a_gear_that_runs_in_is_no_alarm_and_no_settled_baseline(cycles: int) -> None:
    finding = said(run_in(cycles, settles=12.0))
    assert not finding.alarm
    assert "the baseline is not settled: friction has fallen by " in finding.sentence
    assert "runs in" in finding.sentence
    assert any("a new baseline begins there" in step for step in finding.next_steps)
    assert facts_of(finding)["said"] == "unsettled"


def test_a_settled_joint_is_not_said_to_run_in_and_a_baseline_asked_for_is_believed() -> None:
    assert said(months(4, 61)).fallen is None
    worn = months(1, 60, Truth(wear_nm=0.15, onset=0, scatter=0.008))
    assert said(worn, 30).since_first is None
    assert said(run_in(25, 12.0), 20).fallen is None
