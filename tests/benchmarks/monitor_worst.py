"""How soon a lasting rise is found after the least lucky nights: Lorden's sense of the delay.

Lorden (1971) asks for the mean delay after the worst nights that may come before the change.
Where the laws are known, those are nights that leave the sum at zero, and the optimum's delay is
its run length from there (`brook_evans`). A detector that learns level and scatter from nights may
have learned any level, so that its worst of all is without bound, and so is the best such
detector's. What is counted instead is

- the product's delay after nights that leave its sum at zero, whatever it has learned;
- its delay after the worst hundredth of all histories: those after which the run length from zero
  is longest, by how far the learned level lies above the true one and by the learned scatter;
- the same of `monitor_reference`'s, after the worst hundredth of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.growth import grown
from agent.monitor.detection.cusum import DECIDING, Cusum
from agent.monitor.detection.run_length import siegmund
from agent.monitor.detection.standing import standing
from agent.monitor.detection.tuning import Target
from tests.benchmarks.monitor_delay import (
    FIRST,
    LEVEL,
    first_alarm,
    optimum_threshold,
    series_of,
)
from tests.benchmarks.monitor_reference import delay_of
from tests.science.run_length_chain import brook_evans

HISTORY_SEED, FUTURE_SEED = 50_000, 90_000
LONGEST = 300
"""Nights that are watched after the change."""

_AT_ZERO = 200  # histories that leave the sum at zero: so many are taken


@dataclass(frozen=True)
class Worst:
    """Mean nights from the first changed one to the alarm, both included.

    `optimum` and `zero` are the optimum's and the product's from a sum of zero; `worst` and
    `fair_worst` the product's and the fair reference's after the worst share of the histories.
    """

    optimum: float
    zero: float
    worst: float
    fair_worst: float


def measure_worst(
    night: int,
    noise: float,
    rise: float,
    rate: float,
    line: float,
    *,
    histories: int = 800,
    share: float = 0.01,
    futures: int = 15,
) -> Worst:
    """Return the delays in Lorden's sense after a step on a night.

    Parameters
    ----------
    night : int
        Of the step, counted from the joint's first.
    noise, rise : float
        Shares of the level; the detector is told to look for this rise.
    rate : float
        False alarms a year that were counted of the product.
    line : float
        The fair reference's threshold (`line_for`).
    histories, share, futures : int, float, int
        The worst `share` of so many histories is met by so many futures each.
    """
    detector = Cusum(Target(smallest_rise=rise))
    size = rise / noise
    seen = [
        np.random.default_rng(HISTORY_SEED + k).standard_normal(night) for k in range(histories)
    ]
    states = [_state(detector, z, noise) for z in seen]
    own = np.array([expected for expected, _ in states])
    at_zero = [z for z, (_, g) in zip(seen, states, strict=True) if g <= 0.0]
    fair = np.array([_fair_expected(z, size, line) for z in seen])
    worst = round(share * histories)

    def product(z: Floats) -> float | None:
        at = first_alarm(detector, LEVEL * (1.0 + noise * z), FIRST, grows=True)
        if at is None:
            return float(LONGEST)
        return None if at < night else at - night + 1.0

    def reference(z: Floats) -> float | None:
        return delay_of(LEVEL * (1.0 + noise * z), rise * LEVEL, FIRST, line, night)

    return Worst(
        brook_evans(0.5 * size, optimum_threshold(size, rate)),
        _mean_delay(at_zero[:_AT_ZERO], size, 1, product),
        _mean_delay([seen[k] for k in np.argsort(own)[-worst:]], size, futures, product),
        _mean_delay([seen[k] for k in np.argsort(fair)[-worst:]], size, futures, reference),
    )


def _state(detector: Cusum, z: Floats, noise: float) -> tuple[float, float]:
    """Return the run length from zero that the learned numbers give a rise, and the sum's value.

    Both after the nights z, in units of the true scatter.
    """
    values = LEVEL * (1.0 + noise * z)
    length, judged = grown(lambda n, _: series_of(values, n), FIRST, detector)
    series = series_of(values, length)
    found, tuning = standing(series, DECIDING), detector.tunings(series)[DECIDING]
    assert found is not None
    scale = found.scatter / (noise * LEVEL)
    offset = (found.level - LEVEL) / (noise * LEVEL)
    size = detector.target.smallest_rise / noise
    expected = siegmund(size - offset - tuning.drift * scale, tuning.increased * scale)
    return float(expected), float(judged.traces[DECIDING].statistic[-1])


def _fair_expected(z: Floats, size: float, line: float) -> float:
    """Return the same for the reference, which learns from every night of z."""
    scatter = float(np.std(z, ddof=1))
    return float(siegmund(0.5 * size - float(np.mean(z)), line * scatter**2 / size))


def _mean_delay(
    histories: list[Floats], size: float, futures: int, delay: Callable[[Floats], float | None]
) -> float:
    """Return the mean delay over histories and futures; a future that alarms before has none."""
    delays = []
    for k, past in enumerate(histories):
        for j in range(futures):
            rng = np.random.default_rng(FUTURE_SEED + 1000 * k + j)
            one = delay(np.concatenate((past, size + rng.standard_normal(LONGEST))))
            if one is not None:
                delays.append(one)
    return float(np.mean(delays))
