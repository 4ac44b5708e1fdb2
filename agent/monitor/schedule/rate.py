"""How often to test: what each rate of experiments costs, and what it sees (thesis, A.3 and A.4).

Over a year the environment's temperature swings, and friction with it: the rarer the experiments,
the larger the change between two of them (Figure A.4). Compensation takes most of that away. What
is left sets what can be found: each cycle's own scatter, which more cycles average away, and the
law's own error, which they do not.

For every interval the detector is the CUSUM, of a few drifts, that finds the wear soonest at the
accepted rate of false alarms (Siegmund's run lengths, `run_length`). Wear is taken to grow evenly;
how far it has grown on average when it is found is worked out for that sum cell by cell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.detection.run_length import siegmund, threshold_for

YEAR_DAYS = 365.25
INTERVALS_DAYS = (0.5, 1.0, 2.0, 3.0, 7.0, 14.0, 30.0)
_ALLOWED = 2.0  # deviations of the law's error that must not become an alarm
_LONGEST_DAYS = 20.0 * YEAR_DAYS
_AIMS = (0.08, 0.2, 0.4, 0.7)  # drifts that are tried, of the limit
_LEAST_DRIFT = 0.1
_CELLS = 40
_QUIET = 4.0  # deviations
_LEFT = 1e-4
_MOST_CYCLES = 20_000


@dataclass(frozen=True)
class Site:
    """What an experiment at this site meets; friction is in shares of its healthy level.

    Parameters
    ----------
    swing_degc : float
        Half of the gearbox temperature's swing over the period.
    period_days : float
        365.25 for the seasons, 1 for a gearbox that is tested at any hour.
    weather_degc : float
        Standard deviation of what comes from day to day beside it.
    slope_per_k, slope_deviation_per_k : float
        Change of friction a degree, and how well it is known: with compensation, its error is all
        that is left of the swing.
    scatter : float
        Standard deviation from cycle to cycle at equal temperature.

    Raises
    ------
    ValueError
        A swing, scatter or deviation that cannot be.
    """

    swing_degc: float
    slope_per_k: float
    slope_deviation_per_k: float
    scatter: float
    period_days: float = YEAR_DAYS
    weather_degc: float = 1.5

    def __post_init__(self) -> None:
        for name in ("swing_degc", "slope_deviation_per_k", "weather_degc"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name}: expected 0 or more, got {value}")
        for name in ("period_days", "scatter"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name}: expected a number above 0, got {value}")
        if not math.isfinite(self.slope_per_k):
            raise ValueError(f"slope_per_k: expected a finite number, got {self.slope_per_k}")

    def temperature_degc(self, day: Floats) -> Floats:
        """Return the swing at each day, shape (n,), about its mean."""
        return np.asarray(self.swing_degc * np.sin(2.0 * np.pi * day / self.period_days))

    def between(self, interval_days: float) -> float:
        """Return the largest change of uncompensated friction between two experiments.

        Of the swing ``2 A |sin(pi T / P)|`` (once T passes half a period, the whole swing), and
        1.96 deviations of the difference of two days' weather.
        """
        part = min(interval_days / self.period_days, 0.5)
        swing = 2.0 * self.swing_degc * math.sin(math.pi * part)
        weather = 1.96 * math.sqrt(2.0) * self.weather_degc
        return abs(self.slope_per_k) * math.hypot(swing, weather)

    @property
    def law_error(self) -> float:
        """Return what the compensation may be off by, from one end of the swing to the other."""
        return _ALLOWED * self.slope_deviation_per_k * 2.0 * self.swing_degc


@dataclass(frozen=True)
class Wish:
    """What is to be found, and at what price.

    Parameters
    ----------
    wear_per_month : float
        How fast friction grows, as a share in 30 days.
    limit : float
        The rise by which it must have been found, as a share.
    false_alarms_per_year : float
    minutes : float
        That one experiment stops the robot.
    """

    wear_per_month: float = 0.05
    limit: float = 0.15
    false_alarms_per_year: float = 0.1
    minutes: float = 1.5

    def __post_init__(self) -> None:
        for name in ("wear_per_month", "limit", "false_alarms_per_year", "minutes"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name}: expected a number above 0, got {getattr(self, name)}")


@dataclass(frozen=True)
class Rate:
    """One rate of experiments.

    Parameters
    ----------
    interval_days : float
    minutes_per_year : float
        Downtime.
    between : float
        Largest change of uncompensated friction from one experiment to the next, as a share.
    found_days, risen : float
        When the wear is found after its onset on average, and how far friction has risen by then,
        as a share. The onset is right after an experiment.
    risen_95 : float
        How far it has risen by when 95 % of such wear is found.
    sudden_days : float
        When a rise that comes at once, as large as the limit, is found; infinite where the law's
        error hides it.
    """

    interval_days: float
    minutes_per_year: float
    between: float
    found_days: float
    risen: float
    risen_95: float
    sudden_days: float


@dataclass(frozen=True)
class RatePlan:
    """All rates, and the one to take.

    `advised` is the cheapest rate at which 95 % of the wear is found within the limit; None where
    there is none, and `sentence` says why.
    """

    site: Site
    wish: Wish
    rates: tuple[Rate, ...]
    advised: Rate | None
    sentence: str


def plan_rate(site: Site, wish: Wish, intervals_days: Sequence[float] = INTERVALS_DAYS) -> RatePlan:
    """Say what each interval between experiments costs and sees, and which to take.

    Parameters
    ----------
    site : Site
    wish : Wish
    intervals_days : sequence of float
        Above zero.

    Raises
    ------
    ValueError
        No interval, or one that is not above zero.
    """
    if not intervals_days or min(intervals_days) <= 0.0:
        raise ValueError(f"expected intervals above 0 days, got {tuple(intervals_days)}")
    rates = tuple(_rate(site, wish, interval) for interval in sorted(intervals_days))
    good = [r for r in rates if r.risen_95 <= wish.limit * (1.0 + 1e-9)]
    advised = good[-1] if good else None
    return RatePlan(site, wish, rates, advised, _sentence(site, wish, rates, advised))


def _rate(site: Site, wish: Wish, interval_days: float) -> Rate:
    """Return what one interval costs and sees."""
    per_year = YEAR_DAYS / interval_days
    growth = wish.wear_per_month / 30.0 * interval_days / site.scatter  # a cycle, in scatters
    steps = max(per_year / wish.false_alarms_per_year, 2.0)
    hidden = site.law_error / site.scatter
    tried = []
    for share in _AIMS:
        drift = max(share * wish.limit / site.scatter, _LEAST_DRIFT)
        threshold = threshold_for(-drift, steps)
        tried.append((*_ramp_cycles(growth, drift + hidden, threshold), drift + hidden, threshold))
    cycles, late, allowed, threshold = min(tried)
    found = min(cycles * interval_days, _LONGEST_DAYS)
    a_day = wish.wear_per_month / 30.0
    excess = wish.limit / site.scatter - allowed
    sudden = float(siegmund(excess, threshold)) * interval_days if excess > 0.0 else math.inf
    return Rate(
        interval_days,
        per_year * wish.minutes,
        site.between(interval_days),
        found,
        a_day * found,
        a_day * min(late * interval_days, _LONGEST_DAYS),
        sudden,
    )


def _ramp_cycles(growth: float, allowed: float, threshold: float) -> tuple[float, float]:
    """Return the cycles until the CUSUM of a growing mean crosses its threshold.

    The mean, and the number by which 95 % have crossed it.

    The chain of Brook and Evans (Biometrika 59, 1972) with steps of mean ``growth k - allowed`` at
    cycle k: the distribution of the sum over cells of [0, threshold], carried on until next to
    nothing of it is left below the threshold.
    """
    from scipy.special import ndtr

    width = 2.0 * threshold / (2.0 * _CELLS - 1.0)
    apart = np.arange(-_CELLS, _CELLS) * width + 0.5 * width  # upper edge, from cell to cell
    index = np.arange(_CELLS)[np.newaxis, :] - np.arange(_CELLS)[:, np.newaxis] + _CELLS
    # Until the mean step is a few deviations below zero nothing happens: begin there.
    cycle = max(math.floor((allowed - _QUIET) / growth), 0)
    below = np.zeros(_CELLS)
    below[0] = 1.0
    expected, alive, late = float(cycle), 1.0, math.inf
    while alive > _LEFT and cycle < _MOST_CYCLES:
        expected += alive
        cycle += 1
        upto = ndtr(apart - (growth * cycle - allowed))
        below = below @ np.diff(upto[index], axis=1, prepend=0.0)
        alive = float(below.sum())
        if alive <= 0.05 and math.isinf(late):
            late = float(cycle)
    return expected, late


def _sentence(site: Site, wish: Wish, rates: Sequence[Rate], advised: Rate | None) -> str:
    wear, limit = 100.0 * wish.wear_per_month, 100.0 * wish.limit
    if advised is not None:
        risen, late = 100.0 * advised.risen, 100.0 * advised.risen_95
        return (
            f"Test every {advised.interval_days:g} days: wear of {wear:g} % a month is found after "
            f"about {advised.found_days:.0f} days, at a rise of {risen:.1f} % (95 % of it below "
            f"{late:.1f} %, wanted: {limit:g} %), for {advised.minutes_per_year:.0f} minutes a year"
        )
    best = min(rates, key=lambda r: r.risen_95)
    if site.law_error >= wish.limit:
        return (
            f"No rate finds wear within {limit:g} %: over a swing of ±{site.swing_degc:g} °C "
            f"the compensation may be off by {100.0 * site.law_error:.1f} %; learn it over more of "
            "the swing, or test at like temperatures"
        )
    return (
        f"No rate that was looked at finds wear of {wear:g} % a month within {limit:g} %: every "
        f"{best.interval_days:g} days 95 % of it is found below {100.0 * best.risen_95:.1f} %"
    )
