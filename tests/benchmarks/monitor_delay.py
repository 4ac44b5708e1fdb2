"""How soon a lasting rise is found, against the optimum at the same false-alarm rate.

Independent normal features, a step at a night that nobody tells. The optimum (Lorden 1971,
Moustakides 1986) is Page's CUSUM that knows level, scatter and the size of the rise; its threshold
is set by the Markov chain to the false-alarm rate that was counted of the product's detector, and
it sees the same nights. The product begins with a baseline of 30 nights that goes on growing. The
optimum knows what no such detector can; the best that knows as little is `monitor_reference`'s.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.growth import grown
from agent.monitor.detection.cusum import DECIDING, Cusum
from agent.monitor.detection.series import FeatureSeries, State
from agent.monitor.detection.tuning import YEAR_S, Target
from tests.benchmarks.monitor_reference import delay_of
from tests.science.monitor_fleet import correlated
from tests.science.run_length_chain import brook_evans

LEVEL = 100.0
DAY_S = 86400.0
FIRST = 30
"""Nights of the first baseline."""


@dataclass(frozen=True)
class Delay:
    """One row: mean cycles from the first changed one to the alarm, both included.

    `kept` is what the first baseline alone takes; `optimum` knows
    level and scatter, `fair` no more than the product does.
    """

    noise: float
    rise: float
    false_per_year: float
    cycles: float
    kept: float
    optimum: float
    fair: float

    @property
    def ratio(self) -> float:
        """Return how many times the optimum it took."""
        return self.cycles / self.optimum


def series_of(values: Floats, healthy: int) -> FeatureSeries:
    """Return one feature's nights."""
    return FeatureSeries(
        DAY_S * np.arange(values.size, dtype=np.float64),
        {DECIDING: values},
        {DECIDING: np.full(values.size, 0.005 * LEVEL)},
        healthy,
    )


def first_alarm(
    detector: Cusum, values: Floats, healthy: int, *, grows: bool = False
) -> int | None:
    """Return the first cycle that is not without fault."""
    if grows:
        states = grown(lambda n, _: series_of(values, n), healthy, detector)[1].states
    else:
        states = detector.judge(series_of(values, healthy)).states
    return next((i for i, s in enumerate(states) if s is not State.NO_FAULT), None)


def false_rate(
    detector: Cusum,
    healthy: int,
    noise: float,
    robots: int,
    years: float,
    memory: float = 0.0,
    *,
    grows: bool = False,
) -> tuple[float, int]:
    """Return false alarms a year, each robot watched until its first, and how many there were.

    `memory` is the correlation of neighbouring nights.
    """
    nights, alarms, watched = int(years * 365), 0, 0
    for values in healthy_years(healthy, noise, robots, years, memory):
        at = first_alarm(detector, values, healthy, grows=grows)
        alarms += at is not None
        watched += nights if at is None else at - healthy + 1
    return alarms / (watched * DAY_S / YEAR_S), alarms


def healthy_years(
    healthy: int, noise: float, robots: int, years: float, memory: float = 0.0
) -> Iterator[Floats]:
    """Yield each robot's nights: its baseline, and so many years."""
    for seed in range(robots):
        rng = np.random.default_rng(seed)
        nights = healthy + int(years * 365)
        yield LEVEL * (1.0 + noise * correlated(nights, memory, rng))


def known(z: Floats, size: float, false_per_year: float, start: int) -> float | None:
    """Return the delay of the CUSUM that knows everything; None where it alarms before the step.

    Parameters
    ----------
    z : ndarray, shape (n,)
        The nights in units of the known scatter about the known level.
    size : float
        The rise, in that unit, from the night `start` on.
    false_per_year : float
    start : int
    """
    threshold, g = optimum_threshold(size, false_per_year), 0.0
    for i, one in enumerate(z.tolist()):
        g = max(0.0, g + one - 0.5 * size)
        if g > threshold:
            return i - start + 1.0 if i >= start else None
    return float(z.size - start)


@functools.cache
def optimum_threshold(size: float, false_per_year: float) -> float:
    """Return the threshold of the CUSUM that knows everything, over the scatter, at a rate."""
    wanted = YEAR_S / DAY_S / false_per_year
    low, high = 0.0, 20.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if brook_evans(-0.5 * size, middle) < wanted else (low, middle)
    return high


def measure(
    nights: Sequence[int],
    noise: float,
    rise: float,
    rate: float,
    line: float,
    *,
    robots: int = 300,
    per_year: float = 0.1,
) -> Delay:
    """Return the delays after a step on a night; a robot that alarms before it has none.

    Parameters
    ----------
    nights : sequence of int
        Of the step, counted from the robot's first: each robot has the next of them.
    noise, rise : float
        Shares of the level; the detector is told to look for this rise.
    rate : float
        False alarms a year that were counted of the product.
    line : float
        The fair reference's threshold (`line_for`).
    robots : int
    per_year : float
        False alarms that the product is tuned to.
    """
    detector = Cusum(Target(smallest_rise=rise, increased_per_year=per_year))
    delays: tuple[list[float], ...] = ([], [], [], [])
    for seed in range(robots):
        night = nights[seed % len(nights)]
        first = min(FIRST, night)
        z = np.random.default_rng(10_000 + seed).standard_normal(night + 300)
        z[night:] += rise / noise
        values = LEVEL * (1.0 + noise * z)
        for found, grows in zip(delays[:2], (True, False), strict=True):
            at = first_alarm(detector, values, first, grows=grows)
            if at is None or at >= night:
                found.append(300.0 if at is None else at - night + 1.0)
        best = known(z, rise / noise, rate, night)
        fair = delay_of(values, rise * LEVEL, first, line, night)
        for found, one in zip(delays[2:], (best, fair), strict=True):
            if one is not None:
                found.append(one)
    return Delay(noise, rise, rate, *(float(np.mean(d)) for d in delays))
