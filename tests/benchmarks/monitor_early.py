"""Wear from the first night on: at what rise could anybody find it, who is told more and more?

The same nights and the same odds as the product's first cycles (`agent.monitor.baseline.trend`),
asked after each night from the tenth on; what temperature and payload do is told exactly, in turn
with how alike neighbouring nights are and how far they scatter. Level and slope nobody is told.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import log_ndtr

from agent.identify.result import Floats
from agent.monitor.baseline import trend
from agent.monitor.compensation.compensation import Conditions
from agent.monitor.detection.cusum import DECIDING
from agent.monitor.history.table import Features
from tests.science.monitor_fleet import PAYLOADS_KG, Life, live, low_speed_share
from tests.science.monitor_joint import GRID

LIFE = replace(Life(), nights=70)
EARLY_SEED, HEALTHY_SEED = 440_000, 990_000  # apart from those that were looked at while designing
ALARM = math.log(100.0)
_OFF = 0.05  # a night that went wrong is none of the scatter
Odds = Callable[[Floats, Floats], float]


def equal_nights(a_year: float, seed: int) -> tuple[Floats, Floats, Floats]:
    """Return day, low-speed friction over the healthy joint's, and the true rise in percent."""
    risen = a_year / 365.0 * np.arange(float(LIFE.nights))
    nights = live(LIFE, seed, risen / low_speed_share(LIFE.joint))
    load = nights.payload_kg / PAYLOADS_KG[-1]
    healthy = LIFE.joint.curves(nights.temperature_degc, load, np.zeros(load.size)) @ GRID.low_row()
    seen = nights.raw(1).values[DECIDING] / healthy
    return nights.day, seen, 100.0 * risen[nights.day.astype(int)]


def own_odds(day: Floats, seen: Floats) -> float:
    """Return the product's own log odds of a rise, of nights without conditions."""
    unknown = np.full(seen.size, np.nan)
    told = Features(
        {DECIDING: seen}, {DECIDING: 0.004 * seen}, Conditions(unknown, unknown, unknown)
    )
    return trend.trend(told, day, DECIDING).against_none(1.0)


def known_odds(joints: int) -> Odds:
    """Return the log odds of who is told scatter and likeness, as healthy joints show them."""
    kept = []
    for seed in range(HEALTHY_SEED, HEALTHY_SEED + joints):
        _, seen, _ = equal_nights(0.0, seed)
        kept.append(seen[np.abs(seen - np.median(seen)) < _OFF])
    variance = float(np.mean([np.var(k, ddof=1) for k in kept]))
    likeness = float(np.mean([np.corrcoef(k[1:], k[:-1])[0, 1] for k in kept]))

    def odds(day: Floats, seen: Floats) -> float:
        apart = np.abs(day[:, None] - day[None, :])
        weight = np.linalg.inv(variance * likeness**apart)
        level = weight.sum(axis=1)
        weight = weight - np.outer(level, level) / level.sum()
        x = day - day.mean()
        precision = x @ weight @ x + trend._WIDTHS**-2.0
        pull = x @ weight @ seen
        gain = 0.5 * pull**2 / precision + log_ndtr(pull / np.sqrt(precision))
        prior = np.log(2.0 / trend._WIDTHS.size) - np.log(trend._WIDTHS * np.sqrt(precision))
        return float(np.logaddexp.reduce(gain + prior))

    return odds


def found_at(odds: Odds, a_year: float, joints: int) -> tuple[float, float]:
    """Return the rise in percent when it was found: median and 90 % quantile."""
    rises = []
    for seed in range(EARLY_SEED, EARLY_SEED + joints):
        day, seen, risen = equal_nights(a_year, seed)
        asked = range(trend.FEWEST, day.size + 1)
        first = (risen[n - 1] for n in asked if odds(day[:n], seen[:n]) >= ALARM)
        rises.append(float(next(first, math.inf)))
    middle, most = np.quantile(rises, (0.5, 0.9), method="higher")
    return float(middle), float(most)


def _told() -> Iterator[tuple[str, Odds, float]]:
    """Yield who is told what, their odds, and up to where neighbours may be alike."""
    yield "temperature and payload", own_odds, 1.0
    yield "and that neighbours are tied by 0.4 at most", own_odds, 0.4
    yield "and that by 0.2 at most", own_odds, 0.2
    yield "scatter and likeness as well: all but level and slope", known_odds(60), 1.0


def early(joints: int) -> None:
    """Print the table."""
    print("\nearly: wear from night 1 on, rise in percent when found, median and 90 % quantile")
    print(f"{'told':56s}{'30 %/a':>12s}{'100 %/a':>14s}")
    for words, odds, most in _told():
        with pytest.MonkeyPatch.context() as patch:
            some = most >= trend._TIES
            shares = trend._TIE_SHARES[some]
            patch.setattr(trend, "_TIES", trend._TIES[some])
            patch.setattr(trend, "_TIE_SHARES", shares / shares.sum())
            cells = [found_at(odds, a_year, joints) for a_year in (0.3, 1.0)]
        print(f"{words:56s}", *(f"{m:6.1f},{q:5.1f}" for m, q in cells), flush=True)
