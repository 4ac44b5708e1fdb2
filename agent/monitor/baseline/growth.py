"""A baseline that goes on growing while nothing is suspected.

A short baseline knows neither the level nor the scatter nor many temperatures, and no tuning gives
that back. But each night that passes without suspicion is one more healthy cycle. So the joint is
judged from the first baseline on, and the baseline is learned anew, a tenth longer each time,
compensation and tuning with it: a young joint gains by every night, and steps of half as long again
make it wait for them. What bounds it, so that slow wear is not learned as health:

- only cycles before the detector's last all-clear are taken (from there on nothing that was seen
  speaks for a rise), and none of the last `LAG`;
- friction that has clearly fallen stops it, for that is another joint than the one that was
  learned (an oil change or a swap that nobody entered); but not where the first baseline itself
  falls, as in a gear that runs in (`first_cycles.running_in`), whose level it must follow;
- an alarm stops it. It goes on where the alarm has ended by itself and an all-clear has come since:
  else the one robot whose short baseline misled the detector would keep it, and alarm for ever;
- it ends at `MOST_GROWN` cycles of baseline, or where these scatter so much that a rise is found
  late, when that is mended, at `MOST_SCATTERED` at most; at twice that in all, and at the first H1;
- what was said of a cycle stays said: a later baseline judges later cycles alone.

A detector that has no all-clear (`Judgement.clear` is None) keeps its first baseline.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import Baseline, compensated, lengthened, series_of
from agent.monitor.baseline.first_cycles import Watch, WithFirstCycles, running_in
from agent.monitor.detection.decision import Marks
from agent.monitor.detection.series import (
    FEATURES,
    Detector,
    FeatureSeries,
    Judgement,
    State,
    Trace,
)
from agent.monitor.history.table import Features

MOST_GROWN = 120
MOST_SCATTERED = 240
LAG = 10
_STEP = 1.1

SeriesFor = Callable[[int, Collection[str]], FeatureSeries]
"""The same cycles under a baseline of so many of the first ones, with these features."""


def watched(
    features: Features,
    time_s: Floats,
    baseline: Baseline,
    detector: Detector,
    watch: Watch | None = None,
) -> tuple[Baseline, FeatureSeries, Judgement]:
    """Judge a joint's cycles under its first baseline and, where it was not asked for, grown ones.

    Parameters
    ----------
    features : Features
        Of n cycles in order of time.
    time_s : ndarray, shape (n,)
    baseline : Baseline
        The first, of enough cycles.
    detector : Detector
    watch : Watch, optional
        What the first cycles say by themselves; a baseline that was asked for is believed.

    Returns
    -------
    Baseline, FeatureSeries, Judgement
        The last baseline, the series under it, and what was said of each cycle when it was run.
    """

    def series_for(cycles: int, names: Collection[str]) -> FeatureSeries:
        longer = lengthened(baseline, features, cycles, names)
        return series_of(time_s, compensated(features, longer), longer)

    if baseline.asked:
        series = series_for(baseline.cycles, FEATURES)
        return baseline, series, detector.judge(series)
    judges = detector if watch is None else WithFirstCycles(detector, watch)
    start = slice(0, baseline.cycles)
    runs_in = running_in(features.take(start), time_s[start], detector) is not None
    cycles, judged = grown(series_for, baseline.cycles, judges, runs_in=runs_in)
    last = lengthened(baseline, features, cycles, FEATURES)
    return last, series_of(time_s, compensated(features, last), last), judged


def grown(
    series_for: SeriesFor, first: int, detector: Detector, *, runs_in: bool = False
) -> tuple[int, Judgement]:
    """Judge a joint's cycles under a baseline that grows.

    Parameters
    ----------
    series_for : callable
        Learns from the first n cycles and returns all of them as the detector is given them.
    first : int
        The first baseline's length.
    detector : Detector
    runs_in : bool
        Whether friction falls in the first baseline, so that a fall does not end its growth.

    Returns
    -------
    int, Judgement
        How long the baseline has become; the states and traces of each cycle under the baseline
        that held when it was run.
    """
    judged, length = detector.judge(series_for(first, FEATURES)), first
    parts, ends, at = [judged], [], 0
    while judged.clear is not None:
        most = MOST_GROWN if judged.learned_enough else MOST_SCATTERED
        if length >= most:
            break
        longer = min(most, math.ceil(_STEP * length))
        settled = _settled(judged, longer, at, 2 * most + LAG, runs_in=runs_in)
        if settled is None:
            break
        at = settled
        tested = [name for name in judged.traces if name in FEATURES]
        judged, length = detector.judge(series_for(longer, tested)), longer
        parts.append(judged)
        ends.append(at + 1)
    return length, _joined(parts, [*ends, len(judged.states)])


def _settled(
    judged: Judgement, wanted: int, since: int, latest: int, *, runs_in: bool
) -> int | None:
    """Return the first cycle, `since` to `latest`, at which the first `wanted` ones are healthy."""
    assert judged.clear is not None
    fallen = judged.fallen
    if fallen is None or runs_in:
        fallen = np.zeros_like(judged.clear)
    cleared = -1
    seen = zip(judged.states[:latest], judged.clear[:latest], fallen[:latest], strict=True)
    for i, (state, clear, other) in enumerate(seen):
        if state is State.HIGH:
            return None
        if state is not State.NO_FAULT or other:
            cleared = -1
        elif clear:
            cleared = i
        if cleared >= wanted - 1 and i >= max(since, wanted - 1 + LAG):
            return i
    return None


def _joined(parts: list[Judgement], ends: list[int]) -> Judgement:
    """Join judgements, each of which holds up to its end."""
    last = parts[-1]
    starts = [0, *ends[:-1]]
    spans = [(part, slice(a, b)) for part, a, b in zip(parts, starts, ends, strict=True)]
    states = tuple(s for part, span in spans for s in part.states[span])
    traces = {}
    for name in last.traces:
        kept = [(part.traces[name], span) for part, span in spans if name in part.traces]
        statistic = np.full(len(states), np.nan)
        threshold = np.full(len(states), np.nan)
        for trace, span in kept:
            statistic[span], threshold[span] = trace.statistic[span], trace.threshold[span]
        traces[name] = Trace(statistic, threshold)
    clear = _marks([(p.clear, span) for p, span in spans])
    rising = _marks([(p.rising, span) for p, span in spans])
    fallen = _marks([(p.fallen, span) for p, span in spans])
    return Judgement(last.detector, states, traces, clear, rising, last.learned_enough, fallen)


def _marks(parts: list[tuple[Marks | None, slice]]) -> Marks | None:
    """Join marks, each of which holds over its span; None where there are none."""
    given = [marks[span] for marks, span in parts if marks is not None]
    return np.concatenate(given) if given else None
