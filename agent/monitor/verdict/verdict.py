"""From a joint's history to its verdict: baseline, compensation, detector, reasons, in this order.

A history is cut at its events; each stretch has a baseline of its own and is judged by itself. The
last stretch says how the joint is now.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from agent.monitor.baseline.baseline import LEAST, baseline_of, compensated
from agent.monitor.baseline.first_cycles import running_in, watch_of
from agent.monitor.baseline.growth import watched
from agent.monitor.change.change_time import ChangeTime, change_time
from agent.monitor.change.outlook import outlook
from agent.monitor.detection.series import Detector, FeatureSeries, State
from agent.monitor.history.history import JointHistory, Segment
from agent.monitor.schedule.cooling import COLD, WARM, Warmth, next_comparable, warmth
from agent.monitor.verdict.beside import beside_of
from agent.monitor.verdict.comparison import compare
from agent.monitor.verdict.finding import NOT_DECIDABLE, Finding, Track
from agent.monitor.verdict.reasons import UNKNOWN_COURSE, reasons_of
from agent.monitor.verdict.since_first import compared_with, since_first
from agent.monitor.verdict.words import (
    alarmed,
    as_sentence,
    dated,
    day,
    quiet,
    rising,
    since,
    unsettled,
)

__all__ = ["NOT_DECIDABLE", "NOW", "Finding", "Track", "judge"]

NOW = 3
"""The last so many cycles are compared with the baseline."""

_NOT = "not decidable: "


def judge(history: JointHistory, detector: Detector, baseline: int | None = None) -> Finding:
    """Judge one joint.

    Parameters
    ----------
    history : JointHistory
    detector : Detector
    baseline : int, optional
        How many of the first cycles of each stretch are healthy; else by the rule
        (`agent.monitor.baseline.baseline`).

    Raises
    ------
    ValueError
        The baseline is too short for any.
    """
    tracks = _begun(
        history, [_track(history, segment, detector, baseline) for segment in history.segments]
    )
    if not tracks:
        why = "no cycle is usable" if history.set_aside else "there is no cycle"
        return _undecided(history, detector, tracks, why, _USABLE)
    last = tracks[-1]
    rises = _rising(history, detector, tracks) if last.rising else None
    if rises is not None:
        return rises
    return _settled(_against_baseline(history, detector, tracks), detector)


def _against_baseline(
    history: JointHistory, detector: Detector, tracks: tuple[Track, ...]
) -> Finding:
    """Say how a joint is against its baseline, or why that is not decidable."""
    last = tracks[-1]
    if last.series is None:
        return _undecided(history, detector, tracks, _too_few(last), _more_cycles(last))
    if last.judgement is None:
        return _undecided(history, detector, tracks, _unable(detector, last.series), _LONGER)
    after = last.segment.stop - last.segment.start - last.baseline.cycles
    if not after:
        sentence = (
            f"The baseline of {last.baseline.cycles} healthy cycles is complete; the next cycle is "
            "the first to be judged."
        )
        return Finding(history, detector.name, tracks, State.NO_FAULT.value, sentence)
    return _judged(history, detector, tracks, min(NOW, after))


_USABLE = (
    "correct what is said of each cycle that was set aside (its clock, its temperature, its "
    "trajectory), or run new cycles",
)
_LONGER = ("take a longer baseline: leave --baseline out, or give it a larger number",)


def _track(history: JointHistory, segment: Segment, detector: Detector, asked: int | None) -> Track:
    """Learn from a stretch's first cycles and judge the others."""
    cycles = history.cycles[segment.start : segment.stop]
    features = history.table(segment.start, segment.stop)
    time_s = np.array([c.started_s for c in cycles])
    baseline = baseline_of(features, asked)
    watch = None if baseline.asked else watch_of(features, time_s, detector)
    if not baseline.enough:
        alone = None if watch is None else watch.alone(detector.name)
        by_itself = Track(segment, baseline, judgement=alone)
        return by_itself if by_itself.rising else Track(segment, baseline)
    baseline, series, judgement = watched(features, time_s, baseline, detector, watch)
    found = compensated(features, baseline)
    able = bool(judgement.traces)
    track = Track(segment, baseline, found, "", series, judgement if able else None)
    promised = able and not track.rising
    return dataclasses.replace(track, promise=_promise(detector, series)) if promised else track


def _begun(history: JointHistory, tracks: Sequence[Track]) -> tuple[Track, ...]:
    """Say of each stretch how its first cycles compare with the healthy ones of that before it."""
    out = list(tracks)
    for i, (before, after) in enumerate(itertools.pairwise(tracks)):
        if before.series is None or history.grid is None:
            continue
        start, first = before.segment.start, after.segment.start
        stop = min(first + NOW, after.segment.stop)
        begun = compare(
            history.cycles[start:stop],
            history.features[start:stop],
            history.grid,
            before.baseline.cycles,
            slice(first - start, stop - start),
        )
        out[i + 1] = dataclasses.replace(after, begun=begun)
    return tuple(out)


def _judged(
    history: JointHistory, detector: Detector, tracks: tuple[Track, ...], window: int
) -> Finding:
    """Say how the joint is now, and in an alarm why."""
    last = tracks[-1]
    assert last.series is not None
    assert last.judgement is not None
    state = last.judgement.states[-1]
    change = None if state is State.NO_FAULT else change_time(last.series)
    finding = _compared(history, detector, tracks, last.baseline.cycles, window, change)
    found = finding.comparison
    assert found is not None
    if change is None:
        fell = last.judgement.fallen is not None and bool(last.judgement.fallen[-1])
        return dataclasses.replace(
            finding,
            sentence=quiet(found, last.baseline.cycles, fell=fell),
            next_steps=(*finding.next_steps, *((_FELL,) if fell else ())),
        )
    assert finding.reasons is not None
    cycles = history.cycles[last.segment.start : last.segment.stop]
    return dataclasses.replace(
        finding,
        sentence=alarmed(state, found, finding.reasons, since(change, cycles)),
        change=change,
        outlook=dated(outlook(last.series)),
    )


_FELL = (
    "look at the lubricant's level, and ask whether oil, gearbox, drive or torque measurement were "
    "changed; enter that as an event: a new baseline begins there, and until then a rise of less "
    "than the fall goes unseen"
)


def _rising(history: JointHistory, detector: Detector, tracks: tuple[Track, ...]) -> Finding | None:
    """Say of friction that rises from the first cycle on how far, and why.

    None where the rise surely began later, so that there is a baseline to compare with.
    """
    last = tracks[-1]
    segment = last.segment
    cycles = history.cycles[segment.start : segment.stop]
    features = history.table(segment.start, segment.stop)
    found = since_first(features, np.array([c.started_s for c in cycles]))
    if last.series is not None and not found.no_healthy_period:
        return None
    window = min(NOW, len(cycles) - 1)
    first = compared_with(len(cycles), window)
    finding = _compared(history, detector, tracks, first, window, found.change)
    assert finding.reasons is not None
    high = finding.status == State.HIGH.value
    return dataclasses.replace(
        finding,
        sentence=rising(found, finding.reasons, len(cycles), high=high),
        change=found.change,
        outlook=dated(found.outlook),
        since_first=found,
    )


def _settled(finding: Finding, detector: Detector) -> Finding:
    """Say beside a quiet or an undecided joint that its baseline is not settled, where so."""
    last = finding.current
    if last is None or last.baseline.asked or finding.alarm:
        return finding
    segment = last.segment
    stop = segment.start + last.baseline.cycles
    cycles = finding.history.cycles[segment.start : stop]
    features = finding.history.table(segment.start, stop)
    time_s = np.array([c.started_s for c in cycles])
    fall = running_in(features, time_s, detector)
    if fall is None:
        return finding
    return dataclasses.replace(
        finding,
        sentence=unsettled(finding.sentence, fall, len(cycles)),
        fallen=fall,
        next_steps=(*finding.next_steps, _WHEN_SETTLED),
    )


_WHEN_SETTLED = (
    'when friction has stopped falling, enter that as an event (kind "other"): a new baseline '
    "begins there"
)


def _compared(
    history: JointHistory,
    detector: Detector,
    tracks: tuple[Track, ...],
    first: int,
    window: int,
    change: ChangeTime | None,
) -> Finding:
    """Compare now with so many of the first cycles; in an alarm, with the reasons."""
    last = tracks[-1]
    assert last.judgement is not None
    assert history.grid is not None
    segment = last.segment
    cycles = history.cycles[segment.start : segment.stop]
    now = slice(len(cycles) - window, len(cycles))
    found = compare(
        cycles, history.features[segment.start : segment.stop], history.grid, first, now
    )
    degc = np.array([c.temperature_degc for c in cycles])
    warm = warmth(float(degc[-1]), degc[:first])
    state = last.judgement.states[-1]
    reasons = None
    if state is not State.NO_FAULT:
        beside = beside_of(cycles, first, now)
        reasons = reasons_of(found, history.grid.low_rad_s, beside, _at_once(change))
    return Finding(
        history,
        detector.name,
        tracks,
        state.value,
        "",
        found,
        first,
        reasons,
        next_steps=(*(() if reasons is None else reasons.actions), *_comparable(warm)),
        warmth=warm,
    )


def _at_once(change: ChangeTime | None) -> float:
    """Return how probable it is that friction changed from one cycle to the next."""
    if change is None or not change.decidable:
        return UNKNOWN_COURSE
    return change.shapes.get("step", 0.0)


def _comparable(warm: Warmth) -> tuple[str, ...]:
    """Return what to do about a cycle that was run warmer or colder than the healthy ones."""
    if warm.word not in (WARM, COLD):
        return ()
    return (f"the last cycle was {warm.sentence}; {next_comparable(warm).sentence}",)


def _undecided(
    history: JointHistory,
    detector: Detector,
    tracks: tuple[Track, ...],
    why: str,
    steps: tuple[str, ...],
) -> Finding:
    sentence = f"Not decidable yet: {why}."
    return Finding(history, detector.name, tracks, NOT_DECIDABLE, sentence, next_steps=steps)


def _too_few(track: Track) -> str:
    baseline, asked = track.baseline, track.baseline.asked
    begun = ""
    if track.segment.events:
        event = track.segment.events[0]
        begun = f" since the {event.label} on {day(event.at_s)}"
    plural = "cycle" if baseline.needed == 1 else "cycles"
    why = ", for they differ much from one another" if baseline.needed > LEAST and not asked else ""
    return f"{baseline.cycles} of {baseline.needed} healthy {plural}{begun}{why}"


def _more_cycles(track: Track) -> tuple[str, ...]:
    missing = track.baseline.needed - track.baseline.cycles
    return (
        f"run {missing} more cycle{'s' * (missing > 1)} of the same trajectory; until then "
        "friction is recorded, not judged",
    )


def _promise(detector: Detector, series: FeatureSeries) -> str:
    """Return what the detector promises after this baseline; empty where it promises nothing."""
    promise = getattr(detector, "promise", None)
    return "" if promise is None else as_sentence(promise(series))


def _unable(detector: Detector, series: FeatureSeries) -> str:
    """Return why a detector cannot judge, in its own words where it has some."""
    tunings = getattr(detector, "tunings", None)
    sentences = () if tunings is None else [t.sentence for t in tunings(series).values()]
    reasons = [s for s in sentences if s.startswith(_NOT)]
    few = f"{series.healthy} healthy cycles are too few for the detector {detector.name}"
    return reasons[0].removeprefix(_NOT) if reasons else few
