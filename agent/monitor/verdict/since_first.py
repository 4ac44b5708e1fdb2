"""What is said of friction that rises from the first cycle on: how far, since when, what is ahead.

There is no healthy period, so that now is compared with the first cycles of all: a quarter of them,
which have risen the least. The trend is a straight line; how late it may have begun is asked of
the same likelihood, the line bent at one after the other of some times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.monitor.baseline.baseline import LEAST
from agent.monitor.baseline.first_cycles import intervals
from agent.monitor.baseline.trend import trend
from agent.monitor.change.change_time import ChangeTime, credible
from agent.monitor.change.outlook import AHEAD, Outlook, sentence_of, undecided
from agent.monitor.detection.cusum import DECIDING
from agent.monitor.history.table import Features

_ONSETS = 20  # times at which the rise may have begun, the first cycle among them
_DAY_S = 86_400.0
_LIMIT_RISE = 0.5


@dataclass(frozen=True)
class SinceFirst:
    """A rise of low-speed friction from the first cycle on.

    Parameters
    ----------
    rise : Parameter
        From the first cycle to the last, at equal conditions, as a share of that at the first.
    change : ChangeTime
        Minus infinity stands for a time before the first cycle.
    outlook : Outlook
    """

    rise: Parameter
    change: ChangeTime
    outlook: Outlook

    @property
    def no_healthy_period(self) -> bool:
        """Return whether the rise may have begun before the first cycle."""
        return self.change.cycle_ci95[0] == 0


def since_first(features: Features, time_s: Floats) -> SinceFirst:
    """Return what is said of a rise that is there from the first cycle on.

    Parameters
    ----------
    features : Features
        Of n cycles in order of time.
    time_s : ndarray, shape (n,)
    """
    rise = trend(features, intervals(time_s), DECIDING).rise(1.0)
    change = _change(features, time_s, rise)
    return SinceFirst(rise, change, _outlook(rise, float(time_s[-1] - time_s[0])))


def compared_with(cycles: int, now: int) -> int:
    """Return how many of the first cycles the last `now` ones are compared with."""
    return min(max(LEAST, cycles // 4), cycles - now)


def _change(features: Features, time_s: Floats, rise: Parameter) -> ChangeTime:
    """Return when the rise began: all times are as likely beforehand."""
    time = intervals(time_s)
    places = np.unique(np.arange(_ONSETS) * (time.size - 2) // _ONSETS)
    bent = (trend(features, time, DECIDING, np.maximum(time, time[k])) for k in places)
    log = np.array([found.against_none(1.0) for found in bent])
    share = np.exp(log - np.max(log))
    low, high, probability = credible(share / np.sum(share))
    first, last = int(places[low]), int([*places, time.size - 1][high + 1])
    start, end = (float(time_s[k] - time_s[0]) for k in (first, last))
    days = f"day {end / _DAY_S:.0f}"
    began = f"between day {start / _DAY_S:.0f} and {days}" if first else f"before {days}"
    may = "" if first else ", perhaps before the first cycle"
    return ChangeTime(
        decidable=True,
        cycle=int(places[int(np.searchsorted(np.cumsum(share) / np.sum(share), 0.5))]),
        cycle_ci95=(first, last),
        probability=probability,
        time_s=start if first else -math.inf,
        time_ci95_s=(start if first else -math.inf, end),
        shapes={"ramp": 1.0},
        rise=rise,
        sentence=f"the rise began {began} ({100.0 * probability:.0f} %){may}",
    )


def _outlook(rise: Parameter, span_s: float) -> Outlook:
    """Return when the line reaches the limit, counted from its level at the first cycle."""
    assert rise.ci95 is not None
    low, high = (max(end, 1e-12) for end in rise.ci95)
    earliest, latest = (max(span_s, span_s * _LIMIT_RISE / end) for end in (high, low))
    horizon = (1.0 + AHEAD) * span_s
    if earliest > horizon:
        days = AHEAD * span_s / _DAY_S
        return undecided(
            _LIMIT_RISE,
            f"a rise of {100.0 * _LIMIT_RISE:.0f} % lies more than {days:.0f} days ahead, further "
            "than the trend bears",
        )
    latest = latest if latest <= horizon else math.inf
    said = sentence_of(_LIMIT_RISE, span_s, earliest, latest)
    return Outlook(True, _LIMIT_RISE, earliest, latest, said)
