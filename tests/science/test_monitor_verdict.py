"""The whole chain on a joint of known truth: quiet while healthy, right reasons when not."""

from __future__ import annotations

import dataclasses
from collections import Counter

import numpy as np
import pytest

from agent.monitor.detection.detectors import detector
from agent.monitor.history.cycle import CycleCurve
from agent.monitor.history.history import histories
from agent.monitor.verdict.verdict import NOT_DECIDABLE, Finding, judge
from tests.unit.monitor.joint import SPEEDS, START_S, Truth, friction_nm, months

BASELINE = 40


def found(seed: int, truth: Truth | None = None, cycles: int = 90) -> Finding:
    (history,) = histories(months(seed, cycles, truth))
    return judge(history, detector(), BASELINE)


def test_a_healthy_joint_stays_quiet_through_swinging_temperature() -> None:
    for seed in range(3):
        finding = found(seed)
        assert finding.status == "NF"
        assert finding.sentence.startswith("No alarm, friction is as it was: ")
        judgement = finding.tracks[0].judgement
        assert judgement is not None
        assert all(s.value == "NF" for s in judgement.states)


def test_wear_is_an_alarm_with_its_size_its_place_and_its_time() -> None:
    truth = Truth(wear_nm=0.09)
    inside, early = [], []
    for seed in range(4):
        finding = found(seed, truth)
        assert finding.alarm
        assert finding.comparison is not None
        low = finding.comparison.effects["low"]
        # The mean rise over the low speeds, at the share that the last three cycles have.
        degc = finding.comparison.temperature_degc
        share = float(np.mean([1.0, 29.0 / 30.0, 28.0 / 30.0]))
        rise = friction_nm(SPEEDS, degc, truth, share) - friction_nm(SPEEDS, degc, truth, 0.0)
        grid = np.append(SPEEDS[low.to_rad_s > SPEEDS], low.to_rad_s)
        mean = np.trapezoid(np.interp(grid, SPEEDS, rise), grid) / (grid[-1] - grid[0])
        inside.append(low.ci95_nm[0] < mean < low.ci95_nm[1])
        assert low.change_nm == pytest.approx(mean, rel=0.15)
        assert low.percent > 2.0 * finding.comparison.effects["high"].percent
        assert finding.reasons is not None
        assert finding.reasons.causes[0].id == "wear"
        assert "grease" in finding.next_steps[0]
        assert finding.change is not None
        early.append(finding.change.cycle_ci95[0] <= truth.onset + 1)
        assert "most likely wear in the gearbox" in finding.sentence
    assert sum(inside) >= 3
    assert sum(early) >= 3


@pytest.mark.parametrize(
    ("truth", "causes"),
    [
        (Truth(thicker=0.25), {"oil", "temperature"}),
        (Truth(torque_gain=0.09), {"measurement"}),
        (Truth(sensor_k=-5.0), {"temperature", "oil"}),
    ],
)
def test_what_is_no_wear_is_not_called_wear(truth: Truth, causes: set[str]) -> None:
    """A thicker oil and a sensor that reads warm change the curve alike: both must be named."""
    named: Counter[str] = Counter()
    for seed in range(3):
        finding = found(seed, truth)
        assert finding.alarm
        assert finding.reasons is not None
        shares = {c.id: c.probability for c in finding.reasons.causes}
        assert sum(shares.values()) == pytest.approx(1.0)
        assert shares["wear"] < 0.05
        assert {c.id for c in finding.reasons.likely} <= causes
        named[finding.reasons.causes[0].id] += 1
    assert set(named) <= causes


def scaled(
    share: np.ndarray, baseline: int | None = BASELINE, oil_change: int | None = None
) -> Finding:
    """Judge a joint whose whole curve is higher by a share of itself, cycle by cycle."""
    cycles = []
    for i, (c, more) in enumerate(zip(months(2, share.size), share, strict=True)):
        assert c.curve is not None
        curve = CycleCurve(SPEEDS, c.curve.friction_nm * (1.0 + more), c.curve.deviation_nm)
        oil = "VG220" if oil_change is not None and i >= oil_change else c.oil
        cycles.append(dataclasses.replace(c, curve=curve, oil=oil))
    (history,) = histories(cycles)
    return judge(history, detector(), baseline)


def test_a_rise_at_all_speeds_is_a_swap_if_it_came_at_once_and_wear_if_it_grew() -> None:
    night = np.arange(90)
    for share, cause in ((0.1 * (night >= 60), "other"), ((night - 60.0) / 300.0, "wear")):
        finding = scaled(np.maximum(share, 0.0))
        assert finding.alarm
        assert finding.reasons is not None
        assert finding.reasons.causes[0].id == cause
    assert "a swap that nobody entered" in scaled(0.1 * (night >= 60)).sentence


def test_what_an_event_changed_is_said_beside_the_healthy_cycles_before_it() -> None:
    """Wear grew for 20 nights, then the oil was changed: what is left is told, not what went."""
    night = np.arange(120)
    worn = np.where(night < 80, np.maximum(night - 60.0, 0.0) / 100.0, 0.05)
    finding = scaled(worn, oil_change=80)
    assert finding.status == "NF"
    before, after = finding.tracks
    assert before.begun is None
    assert after.begun is not None
    low, high = after.begun.effects["low"], after.begun.effects["high"]
    assert low.percent == pytest.approx(5.0, abs=1.0)
    assert low.ci95_percent[0] < 5.0 < low.ci95_percent[1]
    assert high.ci95_percent[0] < 5.0 < high.ci95_percent[1]
    said = finding.began_anew(after)
    assert f"oil change (VG150 to VG220); friction was then +{low.percent:.1f} % (" in said
    assert finding.began_anew(before) == ""
    short = scaled(worn, oil_change=20)  # too few cycles to know how it was
    assert short.tracks[1].begun is None
    assert "friction was then" not in short.began_anew(short.tracks[1])


def test_friction_that_fell_is_said_in_full_and_not_learned_as_health() -> None:
    finding = scaled(-0.1 * (np.arange(130) >= 60), baseline=None)
    assert finding.status == "NF"
    assert finding.sentence.startswith("No alarm, yet friction has fallen: ")
    assert finding.current is not None
    assert finding.comparison is not None
    assert finding.current.baseline.cycles <= 62
    assert finding.comparison.effects["low"].percent == pytest.approx(-10.0, abs=0.7)
    assert "enter that as an event" in finding.next_steps[-1]


@pytest.mark.parametrize("gravity", [True, False])
def test_a_payload_that_nobody_stated_is_told_by_gravity_or_not_told_from_wear(
    gravity: bool,
) -> None:
    """On an axis that bears no gravity, a load and narrow wear have one shape."""
    rise = 0.5 * (0.025 + 0.11 * np.exp(-SPEEDS / 10.0))
    cycles = []
    for i, c in enumerate(months(1)):
        assert c.curve is not None
        curve = CycleCurve(SPEEDS, c.curve.friction_nm + rise * (i >= 60), c.curve.deviation_nm)
        load = c.load_nm + 0.5 * (i >= 60) if gravity else float("nan")
        cycles.append(dataclasses.replace(c, curve=curve, load_nm=load, payload_kg=float("nan")))
    (history,) = histories(cycles)
    reasons = judge(history, detector(), BASELINE).reasons
    assert reasons is not None
    shares = {c.id: c.probability for c in reasons.causes}
    if gravity:
        assert shares["payload"] > 0.95
    else:
        assert shares["payload"] + shares["wear"] > 0.95
        assert shares["wear"] > 0.02


def test_a_verdict_waits_for_its_baseline_and_says_how_long() -> None:
    (history,) = histories(months(1, 4))
    finding = judge(history, detector())
    assert finding.status == NOT_DECIDABLE
    assert finding.sentence == "Not decidable yet: 4 of 8 healthy cycles."
    assert finding.next_steps[0].startswith("run 4 more cycles")
    (one,) = histories(months(1, 1))
    assert "1 of 8 healthy cycles" in judge(one, detector()).sentence
    with pytest.raises(ValueError, match="at least 3 cycles, got 2"):
        judge(history, detector(), 2)
    asked = judge(history, detector(), 3)
    assert asked.status == NOT_DECIDABLE
    assert "fewer than 5 cycles" in asked.sentence
    assert asked.next_steps == (
        "take a longer baseline: leave --baseline out, or give it a larger number",
    )
    assert asked.current is not None
    assert asked.current.promise == ""  # the sentence has said it


def test_a_noisy_joint_needs_a_longer_baseline() -> None:
    quiet, noisy = (
        judge(histories(months(2, 70, Truth(scatter=s)))[0], detector()).tracks[0].baseline
        for s in (0.003, 0.03)
    )
    assert quiet.needed <= 10
    assert 20 < noisy.needed <= 60


def test_nothing_learned_from_the_baseline_changes_with_what_comes_after() -> None:
    healthy, worn = found(5), found(5, Truth(wear_nm=0.3))
    for name, law in healthy.tracks[0].baseline.laws.items():
        other = worn.tracks[0].baseline.laws[name]
        assert law.level == other.level
        assert law.slope_per_k == other.slope_per_k
    longer, shorter = worn.tracks[0].judgement, found(5, Truth(wear_nm=0.3), 90).tracks[0].judgement
    assert longer is not None
    assert shorter is not None
    assert longer.states == shorter.states


def test_a_joint_without_temperature_is_judged_and_says_so() -> None:
    cycles = [
        dataclasses.replace(c, temperature_degc=float("nan"))
        for c in months(4, 90, Truth(swing_k=0.0, wear_nm=0.25))
    ]
    (history,) = histories(cycles)
    finding = judge(history, detector(), BASELINE)
    assert finding.alarm
    assert "at unknown temperature (not compensated)" in finding.sentence
    assert "uncompensated" in history.notes[0]


def test_a_last_cycle_of_a_set_back_clock_does_not_count() -> None:
    cycles = months(6, 20)
    cycles[-1] = dataclasses.replace(cycles[-1], started_s=START_S - 40 * 365 * 86_400.0)
    (history,) = histories(cycles)
    assert len(history.cycles) == 19
    assert "clock was not set" in history.set_aside[0].reason


@pytest.mark.parametrize(
    ("beyond_degc", "word", "step"),
    [(15.0, "warm", "let it cool to"), (-15.0, "cold", "warm it up by")],
)
def test_a_cycle_run_warm_or_cold_says_so_and_what_to_do(
    beyond_degc: float, word: str, step: str
) -> None:
    cycles = list(months(0, 90))
    healthy = [c.temperature_degc for c in cycles[:BASELINE]]
    end = max(healthy) if beyond_degc > 0.0 else min(healthy)
    last = dataclasses.replace(cycles[-1], temperature_degc=end + beyond_degc)
    (history,) = histories([*cycles[:-1], last])
    finding = judge(history, detector(), BASELINE)
    assert finding.warmth is not None
    assert finding.warmth.word == word
    assert any(f"run {word}" in s and step in s for s in finding.next_steps)
    (usual,) = histories(cycles)
    assert not judge(usual, detector(), BASELINE).next_steps
