"""How well the time of a change is told, and how often the outlook holds: simulated courses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.monitor.change.change_time import change_time
from agent.monitor.change.outlook import outlook
from tests.benchmarks.monitor_delay import DAY_S, LEVEL, series_of

HEALTHY, NIGHTS, NOISE, LIMIT = 60, 200, 0.01, 0.3


@dataclass(frozen=True)
class Course:
    """A change after a random night: `size` is the step, or the rise a night, as a share."""

    name: str
    size: float
    power: int
    memory: float = 0.0


CASES = (
    Course("step of 1.5 %", 0.015, 0),
    Course("step of 3 %", 0.03, 0),
    Course("ramp of 0.1 % a night", 0.001, 1),
    Course("ramp of 0.3 % a night", 0.003, 1),
    Course("accelerating", 4e-5, 2),
)
TIED = (
    Course("step of 3 %, neighbours tied 0.4", 0.03, 0, 0.4),
    Course("ramp of 0.1 %, neighbours tied 0.4", 0.001, 1, 0.4),
)


@dataclass(frozen=True)
class Score:
    """Over the changes that were decidable; the outlook over those that had one.

    `stated` is the probability that the intervals claim, on average; `nights` their median length,
    `single` the share of those that are one night.
    """

    median_error: float
    coverage: float
    stated: float
    nights: float
    single: float
    undecided: float
    outlooks: float
    outlook_coverage: float


def campaign(course: Course, seeds: Sequence[int]) -> Score:
    """Simulate one change for each seed, at least 30 nights before the end."""
    errors, held, stated, widths, ahead = [], [], [], [], []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        first = int(rng.integers(HEALTHY + 10, NIGHTS - 30))
        after = np.maximum(0.0, np.arange(NIGHTS) - first + 1.0)
        rise = course.size * (after**course.power) * (after > 0.0)
        noise = NOISE * rng.standard_normal(NIGHTS)
        for i in range(1, NIGHTS):
            noise[i] = course.memory * noise[i - 1] + np.sqrt(1.0 - course.memory**2) * noise[i]
        series = series_of(LEVEL * (1.0 + rise + noise), HEALTHY)
        found = change_time(series)
        if not found.decidable:
            continue
        errors.append(abs(found.cycle - first))
        held.append(found.cycle_ci95[0] <= first <= found.cycle_ci95[1])
        stated.append(found.probability)
        widths.append(found.cycle_ci95[1] - found.cycle_ci95[0] + 1)
        told = outlook(series, LIMIT)
        if told.decidable and course.power:
            reached = first - 1.0 + (LIMIT / course.size) ** (1.0 / course.power)
            truth = max(reached, NIGHTS - 1.0) * DAY_S
            ahead.append(told.earliest_s <= truth <= told.latest_s)
    return Score(
        float(np.median(errors)),
        float(np.mean(held)),
        float(np.mean(stated)),
        float(np.median(widths)),
        float(np.mean(np.array(widths) == 1)),
        1.0 - len(errors) / len(seeds),
        len(ahead) / len(seeds),
        float(np.mean(ahead)) if ahead else float("nan"),
    )
