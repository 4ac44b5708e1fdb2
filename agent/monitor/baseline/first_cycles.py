"""Wear that is there from the first cycle on: an alarm that needs no healthy period.

A baseline learns what its cycles bring, wear as well, and while it is short nothing is judged at
all. So the first cycles are asked by themselves whether friction rises with time (`trend`): from
the tenth on after each cycle, for quick wear has come far by a few more of them, and past the
fortieth each time that there are a tenth more. The alarm stands from a Bayes factor of 1/a until
the odds have turned; it begins within the cycles that a baseline may learn from (`LATEST`).

`a` is a tenth of the false alarms that are accepted in a year; the test is made once in the life of
a baseline. H1 asks for its own odds, and for a rise beyond its bound with all of its 95 % interval.

Friction that falls is no alarm: a new gear, or fresh grease, runs in. But a baseline that has
learned it lies too high, which is said. Where no gearbox temperature is known nothing is asked: a
hall that cools or warms over the weeks would answer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.monitor.baseline.trend import FEWEST, Trend, trend
from agent.monitor.detection.cusum import DECIDING, Cusum, warned_states
from agent.monitor.detection.decision import Marks
from agent.monitor.detection.series import Detector, FeatureSeries, Judgement, State, Trace
from agent.monitor.history.table import Features
from agent.physics.friction_drift import come_share

TRACE = "since_first_cycle"
_SHARE = 0.1  # of the accepted false alarms of a year, for each baseline
_FALLING = math.log(100.0)  # of the Bayes factor: one settled joint in 100 is said to run in
_EACH, _STEP = 40, 1.1
_SETTLES = (math.inf, 30.0, 10.0)  # intervals in which a fall has gone down to 1/e
LATEST = 250
"""Cycles after which the alarm does not begin any more."""

_ORDER = (State.NO_FAULT, State.INCREASED, State.HIGH)


@dataclass(frozen=True)
class Watch:
    """What the first cycles say at each cycle, knowing nothing of later ones; shapes (n,).

    Parameters
    ----------
    log_rising : ndarray
        Logarithm of the Bayes factor of a rise, as it was last asked; zero before.
    asked : ndarray of bool
        Where it was asked.
    far : ndarray of bool
        Where H1's odds are reached and the rise is beyond its bound with all of its 95 % interval.
    limit : float
        Logarithm of the Bayes factor that H0 asks for.
    """

    log_rising: Floats
    asked: Marks
    far: Marks
    limit: float

    def beside(self, judged: Judgement) -> Judgement:
        """Return a detector's judgement with this alarm beside it."""
        rising = self._rising()
        own = warned_states(rising, rising & self.far)
        states = tuple(max(a, b, key=_ORDER.index) for a, b in zip(judged.states, own, strict=True))
        clear = None if judged.clear is None else judged.clear & ~rising
        traces = {**judged.traces, **self._trace()} if judged.traces else judged.traces
        return replace(judged, states=states, traces=traces, clear=clear, rising=rising)

    def alone(self, name: str) -> Judgement:
        """Return the judgement of this alarm where there is no baseline yet."""
        nothing = (State.NO_FAULT,) * self.asked.size
        return self.beside(Judgement(name, nothing, self._trace()))

    def _trace(self) -> Mapping[str, Trace]:
        statistic = np.maximum(self.log_rising, 0.0)
        return {TRACE: Trace(statistic, np.full_like(statistic, self.limit))}

    def _rising(self) -> Marks:
        """Return where the alarm stands."""
        out = np.zeros_like(self.asked)
        stands = False
        for i, odds in enumerate(self.log_rising.tolist()):
            if self.asked[i]:
                stands = odds > 0.0 if stands else odds >= self.limit and i < LATEST
            out[i] = stands
        return out


@dataclass(frozen=True)
class WithFirstCycles:
    """A detector with the first cycles' alarm beside it."""

    detector: Detector
    watch: Watch

    @property
    def name(self) -> str:
        """Return the detector's word."""
        return self.detector.name

    def judge(self, series: FeatureSeries) -> Judgement:
        """Return the state at each cycle."""
        return self.watch.beside(self.detector.judge(series))


def watch_of(features: Features, time_s: Floats, detector: Detector) -> Watch | None:
    """Return what the first cycles say of a trend.

    Parameters
    ----------
    features : Features
        Of n cycles since the last event, in order of time.
    time_s : ndarray, shape (n,)
    detector : Detector

    Returns
    -------
    Watch or None
        None without a temperature, and beside a detector that is not the product's own: those are
        what their sources say.
    """
    if not isinstance(detector, Cusum) or not _warmth_known(features):
        return None
    n, target = features.count, detector.target
    limit, high_limit = (
        -math.log(_SHARE * rate) for rate in (target.increased_per_year, target.high_per_year)
    )
    rising = np.zeros(n)
    asked, far = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    for count in _counts(n):
        first, since = features.take(slice(0, count)), slice(count - 1, n)
        time = intervals(time_s[:count])
        trends = _trends(first, time, time, detector)
        rising[since] = _odds(trends, detector, 1.0)
        asked[count - 1] = True
        far[since] = rising[-1] >= high_limit and _beyond(trends[DECIDING], target.high_rise)
    return Watch(rising, asked, far, limit)


def running_in(features: Features, time_s: Floats, detector: Detector) -> Parameter | None:
    """Return by how much friction fell over these cycles where it did, as in a new gear.

    It may have fallen all the way, or settled within them; None where it did not, where there are
    fewer than `FEWEST`, and where `watch_of` is None.
    """
    few = features.count < FEWEST
    if not isinstance(detector, Cusum) or few or not _warmth_known(features):
        return None
    time = intervals(time_s)
    odds, fallen = [], []
    for decay in _SETTLES:
        course = time if math.isinf(decay) else decay * come_share(time, decay)
        trends = _trends(features, time, course, detector)
        odds.append(_odds(trends, detector, -1.0))
        fallen.append(trends[DECIDING])
    mean = float(np.logaddexp.reduce(odds)) - math.log(len(odds))
    return fallen[int(np.argmax(odds))].rise(-1.0) if mean >= _FALLING else None


def intervals(time_s: Floats) -> Floats:
    """Return time since the first of n >= 2 cycles in usual intervals between two, shape (n,)."""
    return np.asarray((time_s - time_s[0]) / np.median(np.diff(time_s)))


def _warmth_known(features: Features) -> bool:
    return bool(np.all(np.isfinite(features.conditions.temperature_degc)))


def _counts(n: int) -> Iterator[int]:
    """Yield how many of the first cycles are asked: each at first, then each time a tenth more."""
    count = FEWEST
    while count <= n:
        yield count
        count = count + 1 if count < _EACH else math.ceil(_STEP * count)


def _trends(features: Features, time: Floats, course: Floats, detector: Cusum) -> dict[str, Trend]:
    """Return what cycles say of each feature that the detector tests."""
    tested = [name for name in detector.features if name in features.values]
    return {name: trend(features, time, name, course) for name in tested}


def _odds(trends: Mapping[str, Trend], detector: Cusum, side: float) -> float:
    """Return the logarithm of the features' Bayes factors' mean, by their shares."""
    whole = sum(detector.features[name] for name in trends)
    log = [
        math.log(detector.features[name] / whole) + found.against_none(side)
        for name, found in trends.items()
    ]
    return float(np.logaddexp.reduce(log))


def _beyond(found: Trend, bound: float) -> bool:
    """Return whether a rise is beyond a bound with all of its 95 % interval."""
    interval = found.rise(1.0).ci95
    return interval is not None and interval[0] > bound
