"""The observer on motion that follows its own model: consistent, white, and awake to a change."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.identify.estimate import estimate
from agent.identify.result import Estimate, Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import Motion, read_motion
from agent.monitor.observer.band import HealthyBand, learn_band, watch
from agent.monitor.observer.learning import model_of
from agent.monitor.observer.model import Blocks, ObserverModel
from agent.monitor.observer.observer import ObserverRun, observe
from agent.monitor.observer.whiteness import whiteness
from fakes.history import HistoryPlan, Wear, cycles, ordinary_runs
from tests.benchmarks.ordinary import softened

MODEL = ObserverModel(
    inertia_kg_m2=0.0184,
    gravity_sin_nm=0.0,
    gravity_cos_nm=0.0,
    torque_offset_nm=0.0,
    speed_rad_s=np.array([5.0, 200.0]),
    friction_nm=np.array([0.65, 2.7]),
    top_rad_s=200.0,
    torque_density_nm2_s=3e-5,
    velocity_sd_rad_s=0.05,
    position_sd_rad=1e-4,
)
BLOCKS = 150


def simulated(rng: np.random.Generator) -> tuple[Blocks, Floats]:
    """Draw a motion and the friction's rise from the model's own probability, and measure it.

    Returns blocks and the true (c, b) after each, shape (n, 2).
    """
    span, inertia = MODEL.block_s, MODEL.inertia_kg_m2
    density = MODEL.torque_density_nm2_s / inertia**2
    noise = density * np.array([[span**3 / 3, span**2 / 2], [span**2 / 2, span]])
    rise = 0.3 * MODEL.level_nm * rng.standard_normal(2)
    motion = np.array([0.0, 100.0])
    sensors = np.array([MODEL.position_sd_rad, MODEL.velocity_sd_rad_s])
    before = motion + sensors * rng.standard_normal(2)
    share = rng.uniform(0.1, 1.0, BLOCKS)
    push = 0.05 * rng.standard_normal(BLOCKS)
    truth, measured = np.empty((BLOCKS, 2)), np.empty((BLOCKS, 2))
    for k in range(BLOCKS):
        torque = push[k] - rise[0] - share[k] * rise[1]
        rate = np.array([motion[1] + torque * span / (2 * inertia), torque / inertia])
        motion = motion + span * rate + rng.multivariate_normal(np.zeros(2), noise)
        rise = rise + 1e-3 * MODEL.level_nm * math.sqrt(span) * rng.standard_normal(2)
        truth[k] = rise
        measured[k] = motion + sensors * rng.standard_normal(2)
    both = np.array([span, span**2 / 2])
    blocks = Blocks(
        time_s=span * np.arange(1, BLOCKS + 1, dtype=np.float64),
        slides=np.ones(BLOCKS, dtype=np.bool_),
        push=push[:, np.newaxis] * both,
        coulomb=np.tile(both, (BLOCKS, 1)),
        viscous=share[:, np.newaxis] * both,
        measured=measured,
        starts=np.arange(BLOCKS) == 0,
        before=np.tile(before, (BLOCKS, 1)),
        span_s=np.full(BLOCKS, span),
    )
    return blocks, truth


def squared(run: ObserverRun) -> Floats:
    """Return the normalised innovations squared, shape (n,): mean 2 where all is right."""
    return np.asarray(np.sum(run.innovations**2, axis=1))


def test_it_is_as_certain_as_it_should_be_and_its_innovations_are_white() -> None:
    rng = np.random.default_rng(7)
    nis, nees, called = [], [], 0
    runs = 40
    for _ in range(runs):
        blocks, truth = simulated(rng)
        run = observe(blocks, MODEL)
        nis.append(float(np.mean(squared(run))))
        error = run.states[-1, 2:] - truth[-1]
        nees.append(float(error @ np.linalg.solve(run.covariances[-1, 2:, 2:], error)))
        called += not whiteness(run.judged(), false_rate=0.05).white
    # chi-squared with 2 degrees: mean 2, standard deviation 2; 4 standard errors
    assert np.mean(nis) == pytest.approx(2.0, abs=4 * 2.0 / math.sqrt(runs * BLOCKS))
    assert np.mean(nees) == pytest.approx(2.0, abs=4 * 2.0 / math.sqrt(runs))
    assert called <= 7  # 2 expected of 40; more than 7 has a chance of 1 in 1000


def test_a_torque_that_the_model_does_not_know_makes_innovations_coloured_and_large() -> None:
    blocks, _ = simulated(np.random.default_rng(3))
    hidden_nm = 0.1 * np.sin(2 * np.pi * np.arange(BLOCKS) / 12.0)
    both = np.array([MODEL.block_s, MODEL.block_s**2 / 2])
    blind = replace(blocks, push=blocks.push + hidden_nm[:, np.newaxis] * both)
    right, wrong = observe(blocks, MODEL), observe(blind, MODEL)
    assert whiteness(right.judged()).white
    assert not whiteness(wrong.judged()).white
    assert np.nanmean(squared(wrong)) > 1.5 * np.nanmean(squared(right))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.1, 10.0))
def test_whiteness_does_not_care_for_scale_and_sees_a_drift(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((200, 2))
    assert whiteness(scale * white).statistic == pytest.approx(whiteness(white).statistic)
    drift = white + np.linspace(-2.0, 2.0, 200)[:, np.newaxis]
    assert not whiteness(drift).white


def test_gaps_pair_nothing_across_them() -> None:
    rng = np.random.default_rng(2)
    steady = np.repeat(rng.standard_normal((100, 2)), 2, axis=0)  # each value twice: not white
    assert not whiteness(steady, lags=1).white
    steady[1::2] = np.nan
    assert whiteness(steady, lags=1).statistic == 0.0


@pytest.fixture(scope="module")
def season() -> tuple[list[Motion], HealthyBand]:
    plan = HistoryPlan(cycles=26, seed=11, events=(Wear(16.0, days=10.0, low_speed_nm=0.2),))
    gear = plan.joint.gear_ratio
    reference: Estimate = estimate([Signals.from_columns(next(cycles(plan)).columns, gear)])
    motions = [
        read_motion(Signals.from_columns(r.columns, gear, name=r.name)) for r in ordinary_runs(plan)
    ]
    return motions, learn_band(model_of(reference, motions[:10]), motions[:10])


def test_healthy_work_is_left_alone_and_wear_asks_for_a_dedicated_cycle(
    season: tuple[list[Motion], HealthyBand],
) -> None:
    motions, band = season
    asked = [watch(m, band).asks for m in motions[10:]]
    assert asked[:6].count(True) <= 1  # at 1 % each
    assert asked[-1] is True
    first = asked.index(True, 5)
    assert first <= 12  # 0.12 N m at rest, 20 % of the Coulomb friction, at the latest


def test_a_recording_that_cannot_be_followed_says_why(
    season: tuple[list[Motion], HealthyBand],
) -> None:
    motions, band = season
    source = motions[0].signals
    short = {
        "time_s": source.time_s[:300],
        "torque_nm": source.torque_nm[:300],
        "velocity_rad_s": np.asarray(source.velocity_rad_s)[:300],
    }
    without_position = watch(read_motion(Signals.from_columns(short, 224.0)), band)
    short["position_rad"] = np.asarray(source.position_rad)[:300]
    too_short = watch(read_motion(Signals.from_columns(short, 224.0)), band)
    assert without_position.asks is None
    assert "position_rad" in without_position.reasons[0]
    assert too_short.asks is None
    assert "blocks" in too_short.reasons[0]
    with pytest.raises(ValueError, match="5 healthy recordings"):
        learn_band(band.model, motions[:3])
    cut = read_motion(Signals.from_columns(short, 224.0, name="cut"))
    learned = learn_band(band.model, [cut, *motions[:5]])
    assert [s.name for s in learned.seen] == [m.signals.name for m in motions[:5]]
    assert "cut" in learned.set_aside[0]


def test_a_soft_gear_is_refused_before_wear_can_hide_in_its_ringing(
    season: tuple[list[Motion], HealthyBand],
) -> None:
    _, band = season
    plan = HistoryPlan(cycles=5, seed=11)
    work = [softened(r, 4.0, plan.joint.inertia_kg_m2) for r in ordinary_runs(plan)]
    soft = [read_motion(Signals.from_columns(r.columns, plan.joint.gear_ratio)) for r in work]
    with pytest.raises(ValueError, match="swings at about 4"):
        learn_band(band.model, soft)


def test_the_band_widens_where_the_healthy_recordings_were_never_so_warm(
    season: tuple[list[Motion], HealthyBand],
) -> None:
    _, band = season
    assert band.follows_temperature
    warmest = max(s.temperature_degc for s in band.seen)
    width = [np.diff(band.band_nm(1, warmest + beyond))[0] for beyond in (0.0, 5.0, 15.0)]
    assert width[0] < width[1] < width[2]
