"""Compensation: slopes recovered, predictions cover, uncertainty grows away from what was seen."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.result import Floats
from agent.monitor.compensation.compensation import PRIORS, Conditions, Law
from agent.monitor.compensation.fit import learn

NAME = "integral_w"


def conditions(degc: Floats, payload: Floats | None = None) -> Conditions:
    none = np.full(degc.shape, np.nan)
    return Conditions(degc, none if payload is None else payload, none)


def viscous_integral(degc: Floats, film: float = 0.45) -> Floats:
    """Walther's oil (VG 150: 150 mm2/s at 40, 18 at 100 degC) over a dry level; no law of ours.

    The film's share of friction at 30 degC differs from joint to joint.
    """
    kelvin = np.log10(degc + 273.15)
    slope = np.log10(np.log10(150.8) / np.log10(18.8)) / np.log10(373.15 / 313.15)
    viscosity = 10.0 ** (10.0 ** (np.log10(np.log10(150.8)) - slope * (kelvin - np.log10(313.15))))
    return np.asarray(600.0 * (1.0 - film + film * viscosity / 252.0))


def learned(
    rng: np.random.Generator, low: float, high: float, cycles: int, film: float = 0.45
) -> Law:
    degc = rng.uniform(low, high, cycles)
    values = viscous_integral(degc, film) * (1.0 + 0.005 * rng.standard_normal(cycles))
    return learn(conditions(degc), values, np.full(cycles, 1.0), PRIORS[NAME])


def test_a_linear_feature_gives_its_slope_back_with_an_interval_that_covers() -> None:
    rng = np.random.default_rng(2)
    inside = []
    for _ in range(60):
        degc = rng.uniform(22.0, 34.0, 30)
        # Figure A.1 in shape: a straight fall, here 1.7 % of the level per degree.
        values = 600.0 * (1.0 - 0.017 * (degc - 28.0)) * (1.0 + 0.005 * rng.standard_normal(30))
        law = learn(conditions(degc), values, np.full(30, 1.0), PRIORS[NAME])
        slope, deviation = law.slope_per_k
        truth = -0.017 * 600.0 / law.level
        inside.append(abs(slope - truth) < 1.96 * deviation)
        assert slope == pytest.approx(truth, abs=0.002)
    assert np.mean(inside) >= 0.85


@pytest.mark.parametrize(
    ("low", "high", "at", "least"),
    [
        (20.0, 35.0, 28.0, 0.85),  # inside
        (20.0, 35.0, 45.0, 0.85),  # ten degrees beyond
        (20.0, 35.0, 10.0, 0.82),  # ten degrees colder, where oil thickens steeply
        (20.0, 23.0, 35.0, 0.85),  # twelve degrees beyond three seen ones
        (24.0, 24.2, 15.0, 0.8),  # nothing seen: the prior alone
    ],
)
def test_a_healthy_cycle_anywhere_lies_within_its_deviation(
    low: float, high: float, at: float, least: float
) -> None:
    rng = np.random.default_rng(7)
    inside = []
    for _ in range(60):
        film = rng.uniform(0.15, 0.7)
        law = learned(rng, low, high, 20, film)
        degc = np.array([at])
        value = viscous_integral(degc, film) * (1.0 + 0.005 * rng.standard_normal())
        found = law.compensate(conditions(degc), value, np.array([1.0]))
        spread = np.hypot(found.deviation, law.level_deviation)
        inside.append(abs(float(found.value[0]) - law.level) < 1.96 * float(spread[0]))
        assert found.extrapolated[0] == (not low - 1.0 <= at <= high + 1.0)
    assert np.mean(inside) >= least


def test_the_shared_deviation_grows_with_the_distance_and_shrinks_with_what_was_seen() -> None:
    rng = np.random.default_rng(3)
    at = conditions(np.array([29.0, 33.0, 37.0, 41.0, 45.0]))
    narrow = learned(rng, 26.0, 29.0, 20).effect(at)[1]
    wide = learned(rng, 18.0, 32.0, 20).effect(at)[1]
    assert np.all(np.diff(narrow) > 0.0)
    assert np.all(np.diff(wide[1:]) > 0.0)
    assert np.all(wide[1:] < narrow[1:])
    # Inside what was seen the law costs little against the scatter of one cycle.
    assert learned(rng, 18.0, 32.0, 40).effect(conditions(np.array([26.0])))[1] < 2.0


def test_the_scatter_is_recovered_and_one_bad_cycle_does_not_widen_it() -> None:
    rng = np.random.default_rng(4)
    clean, spoiled = [], []
    for _ in range(15):
        degc = rng.uniform(20.0, 32.0, 24)
        values = viscous_integral(degc) * (1.0 + 0.008 * rng.standard_normal(24))
        noise = np.full(24, 1.0)
        law = learn(conditions(degc), values, noise, PRIORS[NAME])
        clean.append(law.scatter / law.level)
        values[5] *= 1.3
        worse = learn(conditions(degc), values, noise, PRIORS[NAME])
        spoiled.append(worse.scatter / worse.level)
        assert worse.level == pytest.approx(law.level, rel=0.01)
    assert np.median(clean) == pytest.approx(0.008, rel=0.25)
    assert np.median(spoiled) < 1.5 * np.median(clean)


def test_payload_is_learned_where_it_varied_and_doubted_where_not() -> None:
    rng = np.random.default_rng(5)
    degc, payload = rng.uniform(20.0, 32.0, 30), rng.choice([0.0, 40.0, 80.0], 30)

    def values_at(degc: Floats, payload: Floats) -> Floats:
        return viscous_integral(degc) * (1.0 + 0.001 * payload)

    values = values_at(degc, payload) * (1.0 + 0.004 * rng.standard_normal(30))
    noise = np.full(30, 1.0)
    law = learn(conditions(degc, payload), values, noise, PRIORS[NAME])
    two = conditions(np.array([26.0, 26.0]), np.array([0.0, 80.0]))
    effect, shared = law.effect(two)
    truth = np.diff(values_at(np.array([26.0, 26.0]), np.array([0.0, 80.0])))
    assert effect[1] - effect[0] == pytest.approx(truth[0], rel=0.1)
    assert np.all(shared < 0.01 * law.level)

    bare = learn(conditions(degc, np.zeros(30)), values_at(degc, np.zeros(30)), noise, PRIORS[NAME])
    _, doubted = bare.effect(two)
    assert doubted[1] > 0.1 * bare.level > doubted[0]
    assert list(bare.extrapolates(two)) == [False, True]


def test_without_any_temperature_nothing_is_compensated() -> None:
    rng = np.random.default_rng(6)
    values = 500.0 * (1.0 + 0.01 * rng.standard_normal(12))
    unknown = conditions(np.full(12, np.nan))
    law = learn(unknown, values, np.full(12, 1.0), PRIORS[NAME])
    found = law.compensate(unknown, values, np.full(12, 1.0))
    assert law.name == "none"
    assert np.array_equal(found.value, values)
    assert not found.extrapolated.any()
    with pytest.raises(ValueError, match="for all healthy cycles or for none"):
        learn(conditions(np.r_[values[:11], np.nan]), values, np.full(12, 1.0), PRIORS[NAME])


def test_units_do_not_matter() -> None:
    rng = np.random.default_rng(8)
    degc = rng.uniform(20.0, 32.0, 16)
    values = viscous_integral(degc) * (1.0 + 0.005 * rng.standard_normal(16))
    at = conditions(np.array([20.0, 40.0]))
    one = learn(conditions(degc), values, np.full(16, 1.0), PRIORS[NAME]).effect(at)
    milli = learn(conditions(degc), 1e3 * values, np.full(16, 1e3), PRIORS[NAME]).effect(at)
    assert np.allclose(milli, 1e3 * np.array(one), rtol=1e-6)
