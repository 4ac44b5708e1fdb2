"""Grown joints of a kind teach a young one; never their level, and never one unlike them."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping

import numpy as np
import pytest

from agent.monitor.baseline.first_cycles import intervals
from agent.monitor.baseline.siblings import kinds_of
from agent.monitor.baseline.trend import trend
from agent.monitor.compensation.compensation import PRIORS, Law
from agent.monitor.compensation.fit import learn
from agent.monitor.compensation.kind import Kind
from agent.monitor.detection.cusum import DECIDING
from agent.monitor.detection.detectors import detector
from agent.monitor.detection.soonest import doubt_of, soonest
from agent.monitor.history.cycle import Joint
from agent.monitor.history.history import histories
from agent.monitor.verdict.finding import Finding
from agent.monitor.verdict.kinship import Pool
from agent.monitor.verdict.verdict import judge
from tests.benchmarks.monitor_siblings import KIND, OTHER, flat_kind, like, siblings
from tests.science.monitor_fleet import Life, Nights, live, low_speed_share
from tests.science.monitor_joint import GRID
from tests.unit.monitor.joint import JOINT, Truth, months

SEEDS = range(4)


def first_nights(life: Life, seed: int, cycles: int, a_year: float = 0.0) -> Nights:
    """Return the first nights of a joint that wears from the first one on."""
    risen = a_year / 365.0 * np.arange(float(life.nights))
    n = live(life, seed, risen / low_speed_share(life.joint))
    kept = slice(0, cycles)
    return Nights(n.day[kept], n.temperature_degc[kept], n.payload_kg[kept], n.features[kept])


def law_of(nights: Nights, kinds: Mapping[str, Kind]) -> Law:
    given = nights.table()
    values, stated = given.values[DECIDING], given.deviations[DECIDING]
    return learn(given.conditions, values, stated, PRIORS[DECIDING], kinds.get(DECIDING))


def test_a_young_joint_is_compensated_ten_degrees_beyond_what_it_has_seen() -> None:
    """Against the joint's own curve; one of the ten that it learns from is of another kind."""
    sure: dict[bool, list[float]] = {True: [], False: []}
    held = []
    for seed in range(100, 112):
        life = like(KIND, seed)
        nights = first_nights(life, seed, 12)
        for lent, deviations in sure.items():
            law = law_of(nights, siblings(0) if lent else {})
            at = law.basis.reference_conditions(np.array([0.0, 10.0, -10.0]))
            curves = life.joint.curves(at.temperature_degc, at.payload_kg / 175.0, np.zeros(3))
            true = curves @ GRID.low_row()
            effect, shared = law.effect(at)
            deviations.extend(shared[1:] / law.level)
            off = np.abs(effect / law.level - (true / true[0] - 1.0))[1:]
            if lent:
                assert law.lent > 0.9
                held.extend(off < 2.0 * shared[1:] / law.level)
    assert np.mean(sure[True]) < 0.6 * np.mean(sure[False])
    assert np.mean(held) > 0.85


def test_a_joint_unlike_its_siblings_loses_what_it_borrowed() -> None:
    for seed in SEEDS:
        nights = first_nights(like(OTHER, seed), seed, 40)
        alone, beside = law_of(nights, {}), law_of(nights, siblings(0))
        assert beside.lent < 0.1
        assert beside.slope_per_k == pytest.approx(alone.slope_per_k, rel=0.2)
    kind = siblings(0)[DECIDING]
    assert kind.borrowed(kind.scatter, 30.0) > 0.8 * kind.worth
    assert kind.borrowed(2.0 * kind.scatter, 30.0) < 0.05 * kind.worth


def test_quick_wear_from_the_first_night_on_is_surer_beside_siblings() -> None:
    """A rise of 5.5 % in twenty nights; the odds of an alarm are 100, 4.6 in their logarithm."""
    odds: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(10):
        nights = first_nights(like(KIND, seed), seed, 20, a_year=1.0)
        for lent, log in odds.items():
            given = dataclasses.replace(nights.table(), kinds=siblings(0) if lent else {})
            log.append(trend(given, intervals(nights.time_s), DECIDING).against_none(1.0))
    assert np.median(odds[True]) > np.median(odds[False]) + 1.5
    assert np.mean(np.array(odds[True]) > np.array(odds[False])) >= 0.8


def test_a_scatter_that_siblings_show_shortens_the_delay_and_their_level_is_never_asked() -> None:
    kind = flat_kind(0.02, 0)[DECIDING]
    assert kind.scatter == pytest.approx(0.02, rel=0.15)
    alone, beside = (
        soonest(doubt_of(30, 1.0, borrowed), 1.5, 0.03, 365.0).delay
        for borrowed in (0.0, kind.worth)
    )
    assert beside < 0.9 * alone
    grown = [(n.table(), n.time_s) for n in (live(like(KIND, s), s) for s in range(5))]
    loud = [
        (dataclasses.replace(f, values={k: 3.0 * v for k, v in f.values.items()}), t)
        for f, t in grown
    ]
    one, other = kinds_of(grown)[DECIDING], kinds_of(loud)[DECIDING]
    assert other.scatter == pytest.approx(one.scatter)
    for mine, theirs in zip(one.shapes, other.shapes, strict=True):
        assert theirs.middle == pytest.approx(mine.middle)
    assert kinds_of(grown[:4]) == {}


@functools.cache
def judged(wear_nm: float) -> Finding:
    """Return what is found of a joint of 75 nights by itself."""
    (history,) = histories(months(1, 75, Truth(wear_nm=wear_nm, onset=50)))
    return judge(history, detector(), 20)


def alone(
    robot: str, axis: int = 2, gear: float = 224.0, model: str = "M", wear_nm: float = 0.0
) -> Finding:
    """Return the same of a joint of this name."""
    found = judged(wear_nm)
    cycles = tuple(dataclasses.replace(c, model=model) for c in found.history.cycles)
    named = dataclasses.replace(found.history, joint=Joint(robot, axis, gear), cycles=cycles)
    return dataclasses.replace(found, history=named)


def test_siblings_are_other_robots_of_the_axis_gear_and_model_and_healthy() -> None:
    own = alone("r9")
    kin = [alone(f"r{k}") for k in range(5)]
    strangers = [
        alone("r5", axis=3),
        alone("r6", gear=100.0),
        alone("r7", model="N"),
        alone("r8", model=""),
    ]
    found = Pool([own, *kin, *strangers]).siblings_of(own.history)
    assert found is not None
    assert found.grown == tuple(f"r{k} axis 2 (gear 224)" for k in range(5))
    assert found.kinds[DECIDING].joints == 5
    worn = [*kin[:4], alone("r4", wear_nm=0.3)]
    few = Pool([own, *worn]).siblings_of(own.history)
    assert few is not None
    assert (few.known, len(few.grown), few.kinds) == (5, 4, {})
    said = dataclasses.replace(own, history=dataclasses.replace(own.history, siblings=few)).lent
    assert "4 of the 5 that are known have lived long enough in health" in said
    assert Pool(strangers).siblings_of(own.history) is None
    given = Pool([own], [*kin, *strangers]).siblings_of(own.history)
    assert given is not None
    assert given.grown == (*found.grown, "r8 axis 2 (gear 224)")
    lent = judge(dataclasses.replace(own.history, siblings=found), detector(), 20)
    assert lent.lent.startswith("Compensated by what 5 joints of its kind show")
    assert JOINT.robot not in lent.lent
