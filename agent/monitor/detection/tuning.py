"""Drift and threshold of a CUSUM from a robot's own healthy cycles, for a stated false-alarm rate.

With the level, the scatter and the rise to be found known, the drift is half of the rise
(Moustakides 1986) and the threshold follows from the average run length. A baseline of n cycles
knows neither: its mean is off by b ~ N(0, sigma^2 L / n), its scatter by a ratio r with
r^2 ~ (m - 1) / chi^2(m - 1), where L is the long-run variance ratio of neighbouring cycles'
correlation and m = n / L the cycles that are worth as much as independent ones. The robot at hand
is one draw of (b, r), so what is kept to is the expected rate over all of them, and the interval
of the rate over them is said. Drift and threshold together are those that find the rise soonest
under that constraint: with a long baseline Moustakides's, with a short one a larger drift.

Two fifths of the accepted false alarms are left to that noise, and two fifths to the compensation's
law being off, which `allowance` meets. The last fifth is for what neither counts: both at once, a
correlation that a short baseline measured too small, a cycle that went wrong.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from agent.monitor.detection.run_length import siegmund, threshold_for
from agent.monitor.detection.series import FeatureSeries
from agent.monitor.detection.soonest import Soonest, doubt_of, soonest, thresholds
from agent.monitor.detection.standing import FEWEST, Standing

YEAR_S = 365.25 * 86400.0
SLOWEST_CYCLES = 30.0
"""A rise that takes longer than this is not what to look for: a larger one is taken instead."""

NEAR_OPTIMUM = 1.25
"""So many times the delay of a detector that knows everything is as near as is asked for."""

SOONEST_CYCLES = 2.0
"""No single cycle decides, so that no rise is found sooner."""

_LONGEST, _LENGTHEN = 400, 1.1  # baselines that are tried for it
_LARGEST_RISE = 64.0  # over the smallest worth finding
_RARE = 0.01  # a year
_HALVINGS = 10  # of that range, so that the rise is the smallest to half a percent of itself
_NOISE, _LAW = 0.4, 0.4  # of the false alarms: left to noise, to the law's error
_TRIALS = 8.0  # of the law's error in a year: a season's two ends, under some four baselines


@dataclass(frozen=True)
class Target:
    """What a detector is tuned to.

    Parameters
    ----------
    smallest_rise : float
        The rise worth finding, as a share of the baseline's level. Where a robot's cycles scatter
        too much for it, the smallest that is found within `SLOWEST_CYCLES` takes its place.
    high_rise : float
        H1 is for a rise of at least this share of the level.
    increased_per_year, high_per_year : float
        False alarms of each state that are accepted in a robot-year.
    """

    smallest_rise: float = 0.02
    high_rise: float = 0.2
    increased_per_year: float = 0.1
    high_per_year: float = 0.01

    def __post_init__(self) -> None:
        if not 0.0 < self.smallest_rise <= self.high_rise:
            raise ValueError(
                "expected a smallest rise above zero and no more than that of H1, got "
                f"{self.smallest_rise} and {self.high_rise}"
            )
        if not 0.0 < self.high_per_year <= self.increased_per_year:
            raise ValueError(
                "expected false-alarm rates above zero, that of H1 no more than that of H0, got "
                f"{self.high_per_year} and {self.increased_per_year}"
            )


@dataclass(frozen=True)
class Tuning:
    """A CUSUM's numbers, in units of one healthy cycle's scatter, and what they promise.

    Parameters
    ----------
    rise : float
        What it is tuned to find, as a share of the level.
    drift, increased : float
        k and h of H0.
    high_drift, high : float
        k and h of H1, whose sum looks for half of `high_rise`; h is infinite where the baseline
        cannot carry the rate.
    allowance, high_allowance : float
        How many deviations of the compensation's shared error are allowed for in H0 and in H1.
        That error lasts a season, not a cycle: it is a few trials a year.
    rate_per_year : float
        Expected false alarms of H0 from noise in a robot-year.
    rate_ci95_per_year : tuple of float
        Between which that rate lies for this robot, from what its baseline leaves open.
    delay_cycles : float
        Expected, from the onset of a lasting rise of the smallest size; at least
        `SOONEST_CYCLES`.
    known_delay_cycles : float
        The same for the CUSUM that knows level, scatter and rise (Moustakides) at the same rate.
    decidable : bool
    sentence : str
    """

    rise: float
    drift: float
    increased: float
    high_drift: float
    high: float
    allowance: float
    high_allowance: float
    rate_per_year: float
    rate_ci95_per_year: tuple[float, float]
    delay_cycles: float
    known_delay_cycles: float
    decidable: bool
    sentence: str


def tune(
    found: Standing | None, target: Target, cycles_per_year: float, share: float = 1.0
) -> Tuning:
    """Return the numbers that find the rise soonest within the false-alarm rates.

    Parameters
    ----------
    found : Standing or None
        None where the baseline is too short to stand on.
    target : Target
    cycles_per_year : float
    share : float
        Of the false alarms that this test may cause; the rest belongs to others beside it.
    """
    if found is None or found.level <= 0.0:
        return _undecided(f"a baseline of fewer than {FEWEST} cycles does not tell their scatter")
    known = _Known(
        found.cycles,
        found.left_out,
        round(found.long_run, 2),
        found.level,
        found.scatter,
        round(found.borrowed, 1),
    )
    return _tuned(known, target, cycles_per_year, share)


class _Known(NamedTuple):
    """What tuning knows of a baseline; one baseline is asked about again and again."""

    cycles: int
    left_out: int
    long_run: float
    level: float
    scatter: float
    borrowed: float

    @property
    def words(self) -> str:
        """Return how many healthy cycles there are, and how many of them do not count."""
        said = f"{self.cycles + self.left_out} healthy cycles"
        return said if not self.left_out else f"{said} ({self.left_out} left out, too far off)"


@functools.lru_cache(maxsize=512)
def _tuned(found: _Known, target: Target, cycles_per_year: float, share: float) -> Tuning:
    """Return the numbers for a baseline; see `tune`."""
    doubt = doubt_of(found.cycles, found.long_run, found.borrowed)
    scatters = found.level / found.scatter
    rate = _NOISE * share * target.increased_per_year

    def cusum_for(share_of_level: float) -> Soonest:
        return soonest(doubt, share_of_level * scatters, rate, cycles_per_year)

    sought = _smallest(lambda r: cusum_for(r).delay <= SLOWEST_CYCLES, target.smallest_rise)
    if sought is None:
        return _undecided(
            f"with {found.words} that scatter by "
            f"{100.0 / scatters:.1f} %, not even a rise of "
            f"{100.0 * _LARGEST_RISE * target.smallest_rise:.0f} % is found within "
            f"{SLOWEST_CYCLES:.0f} cycles at {share * target.increased_per_year:.2g} false alarms "
            "a year"
        )
    best = cusum_for(sought)
    drift, line = np.array([best.drift]), np.array([best.threshold])
    half = np.maximum(drift, 0.5 * target.high_rise * scatters)
    high = thresholds(doubt, half, _NOISE * share * target.high_per_year, cycles_per_year)
    rates = doubt.rates(drift, line, cycles_per_year)[0]
    low, up = (float(q) for q in np.quantile(rates, (0.025, 0.975)))
    delay = max(SOONEST_CYCLES, best.delay)
    return Tuning(
        sought,
        best.drift,
        best.threshold,
        float(half[0]),
        float(high[0]),
        allowance(share * target.increased_per_year),
        allowance(share * target.high_per_year),
        float(np.mean(rates)),
        (low, up),
        delay,
        _known_delay(sought * scatters, found.long_run, float(np.mean(rates)), cycles_per_year),
        decidable=True,
        sentence=(
            f"{found.words}: a lasting rise of "
            f"{100.0 * sought:.1f} % is found after about {delay:.0f} cycles; "
            f"false alarms from noise: {_said(float(np.mean(rates)))} a year expected, "
            f"{_said(up)} at most (97.5 %)"
        ),
    )


def _said(rate: float) -> str:
    """Return a rate as it is said; how much rarer than one in a hundred years nobody can tell."""
    return f"{rate:.2g}" if rate >= _RARE else f"under {_RARE:g}"


def _smallest(in_time: Callable[[float], bool], least: float) -> float | None:
    """Return the smallest rise, `least` or larger, that is found in time; None where none is."""
    if in_time(least):
        return least
    low, high = least, _LARGEST_RISE * least
    if not in_time(high):
        return None
    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if in_time(middle) else (middle, high)
    return high


def cycles_within(
    found: Standing, tuning: Tuning, cycles_per_year: float, ratio: float = NEAR_OPTIMUM
) -> int | None:
    """Return how long a baseline has to be for a delay of at most `ratio` times the optimum.

    For the rise and the rate that the detector is tuned to. None where even `_LONGEST` cycles are
    too few.
    """
    rise = tuning.rise * found.level / found.scatter
    length, best = found.cycles, tuning.delay_cycles
    while best > ratio * tuning.known_delay_cycles:
        length = math.ceil(_LENGTHEN * length)
        if length > _LONGEST:
            return None
        doubt = doubt_of(length, round(found.long_run, 2), round(found.borrowed, 1))
        best = soonest(doubt, rise, tuning.rate_per_year, cycles_per_year).delay
    return length


def _known_delay(rise: float, long_run: float, rate: float, cycles_per_year: float) -> float:
    """Return the delay of a CUSUM that knows everything, at a rate of false alarms in a year."""
    spread = math.sqrt(long_run)
    drift = 0.5 * rise / spread
    return float(siegmund(drift, threshold_for(-drift, cycles_per_year / rate)))


def cycles_per_year(series: FeatureSeries) -> float:
    """Return how many cycles a year the healthy ones amount to; one alone counts as nightly."""
    gaps = np.diff(series.time_s[: series.healthy])
    return YEAR_S / (float(np.median(gaps)) if gaps.size else 86400.0)


def _undecided(reason: str) -> Tuning:
    return Tuning(
        rise=np.inf,
        drift=np.inf,
        increased=np.inf,
        high_drift=np.inf,
        high=np.inf,
        allowance=0.0,
        high_allowance=0.0,
        rate_per_year=0.0,
        rate_ci95_per_year=(0.0, 0.0),
        delay_cycles=np.inf,
        known_delay_cycles=np.inf,
        decidable=False,
        sentence=f"not decidable: {reason}",
    )


def allowance(rate_per_year: float) -> float:
    """Return how many deviations of the law's shared error to allow for.

    Two fifths of the accepted false alarms are the law's. Its error is largest where the season is
    warmest and where it is coldest, and it is another under each baseline that a year brings.
    """
    return float(norm.isf(min(0.5, _LAW * rate_per_year / _TRIALS)))
