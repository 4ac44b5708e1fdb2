"""How soon a lasting rise is found, against the optimum at the same false-alarm rate.

Independent normal features, a step at an unknown cycle. The optimum (Lorden 1971, Moustakides
1986) is Page's CUSUM that knows level, scatter and the size of the rise; its threshold is set by
the Markov chain to the false-alarm rate that was counted of the product's detector.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.cusum import DECIDING, Cusum
from agent.monitor.run_length import brook_evans
from agent.monitor.series import FeatureSeries, State
from agent.monitor.tuning import YEAR_S, Target
from tests.science.monitor_fleet import correlated

LEVEL = 100.0
DAY_S = 86400.0
SETTLED = 100
"""Healthy cycles between the baseline and the step: the sums have forgotten how they began."""


@dataclass(frozen=True)
class Delay:
    """One row: mean cycles from the first changed one to the alarm, both included."""

    healthy: int
    noise: float
    rise: float
    false_per_year: float
    cycles: float
    optimum: float

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


def first_alarm(detector: Cusum, values: Floats, healthy: int) -> int | None:
    """Return the first cycle that is not without fault."""
    states = detector.judge(series_of(values, healthy)).states
    return next((i for i, s in enumerate(states) if s is not State.NO_FAULT), None)


def false_rate(
    detector: Cusum, healthy: int, noise: float, robots: int, years: float, memory: float = 0.0
) -> tuple[float, int]:
    """Return false alarms a year, each robot watched until its first, and how many there were.

    `memory` is the correlation of neighbouring nights.
    """
    nights, alarms, watched = int(years * 365), 0, 0
    for seed in range(robots):
        rng = np.random.default_rng(seed)
        values = LEVEL * (1.0 + noise * correlated(healthy + nights, memory, rng))
        at = first_alarm(detector, values, healthy)
        alarms += at is not None
        watched += nights if at is None else at - healthy + 1
    return alarms / (watched * DAY_S / YEAR_S), alarms


def optimum(size: float, false_per_year: float, seeds: int = 4000) -> float:
    """Return the mean delay of the CUSUM that knows everything, for a rise of `size` scatters."""
    wanted = YEAR_S / DAY_S / false_per_year
    drift = 0.5 * size
    low, high = 0.0, 20.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if brook_evans(-drift, middle) < wanted else (low, middle)
    rng = np.random.default_rng(0)
    g = np.zeros(seeds)
    for _ in range(SETTLED):
        g = np.maximum(0.0, g + rng.standard_normal(seeds) - drift)
        g[g > high] = 0.0
    delay, running = np.zeros(seeds), np.ones(seeds, dtype=bool)
    while running.any():
        g = np.maximum(0.0, g + size + rng.standard_normal(seeds) - drift)
        delay += running
        running &= g <= high
    return float(np.mean(delay))


def measure(
    healthy: int,
    noise: float,
    rise: float,
    *,
    robots: int = 300,
    years: float = 4.0,
    per_year: float = 0.1,
) -> Delay:
    """Return the delay of the product's detector, told to look for this rise, and the optimum."""
    detector = Cusum(Target(smallest_rise=rise, increased_per_year=per_year))
    rate, alarms = false_rate(detector, healthy, noise, robots, years)
    rate = rate if alarms else 0.5 / (robots * years)
    delays = []
    start = healthy + SETTLED
    for seed in range(robots):
        rng = np.random.default_rng(10_000 + seed)
        values = LEVEL * (1.0 + noise * rng.standard_normal(start + 300))
        values[start:] += rise * LEVEL
        at = first_alarm(detector, values, healthy)
        if at is None or at >= start:
            delays.append(300.0 if at is None else at - start + 1.0)
    return Delay(healthy, noise, rise, rate, float(np.mean(delays)), optimum(rise / noise, rate))
