"""From a joint's history to its verdict: baseline, compensation, detector, reasons, in this order.

A history is cut at its events; each stretch has a baseline of its own and is judged by itself. The
last stretch says how the joint is now.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline import LEAST, Baseline, baseline_of, compensated, features_table
from agent.monitor.change_time import ChangeTime, change_time
from agent.monitor.comparison import Comparison, compare
from agent.monitor.compensation import Compensated
from agent.monitor.cooling import COLD, WARM, Warmth, next_comparable, warmth
from agent.monitor.cycle import Cycle
from agent.monitor.growth import watched
from agent.monitor.history import JointHistory, Segment
from agent.monitor.outlook import Outlook, outlook
from agent.monitor.reasons import Beside, Reasons, reasons_of
from agent.monitor.series import Detector, FeatureSeries, Judgement, State
from agent.monitor.verdict_words import alarmed, as_sentence, day, quiet, since

NOW = 3
"""The last so many cycles are compared with the baseline."""

NOT_DECIDABLE = "not-decidable"
_NOT = "not decidable: "


@dataclass(frozen=True)
class Track:
    """One stretch between two events, and what was made of it.

    `promise` says what the detector can find after this baseline, and how often it is wrong, where
    it says so itself. `found` and `series` are None where the baseline is too short; so is
    `judgement`, and also where the detector says that it cannot judge.
    """

    segment: Segment
    baseline: Baseline
    found: Mapping[str, Compensated] | None = None
    promise: str = ""
    series: FeatureSeries | None = None
    judgement: Judgement | None = None


@dataclass(frozen=True)
class Finding:
    """What is said of one joint.

    Parameters
    ----------
    history : JointHistory
    detector : str
    tracks : tuple of Track
        One for each stretch, in order of time; empty without a usable cycle.
    status : str
        ``NF``, ``H0`` or ``H1`` at the last cycle, or ``not-decidable``.
    sentence : str
        For a technician.
    comparison : Comparison or None
        Now against the baseline; None where there is no cycle after it.
    reasons : Reasons or None
        Of an alarm.
    change : ChangeTime or None
        Of an alarm.
    outlook : Outlook or None
        Of an alarm.
    next_steps : tuple of str
    warmth : Warmth or None
        Whether the last cycle was run warm or cold; None where nothing was compared.
    """

    history: JointHistory
    detector: str
    tracks: tuple[Track, ...]
    status: str
    sentence: str
    comparison: Comparison | None = None
    reasons: Reasons | None = None
    change: ChangeTime | None = None
    outlook: Outlook | None = None
    next_steps: tuple[str, ...] = ()
    warmth: Warmth | None = None

    @property
    def alarm(self) -> bool:
        """Return whether friction is increased now."""
        return self.status in (State.INCREASED.value, State.HIGH.value)

    @property
    def timing(self) -> tuple[str, ...]:
        """Return when the change began and what is ahead, a sentence each; empty without alarm."""
        out = []
        if self.change is not None and self.change.decidable and self.current is not None:
            start = self.history.cycles[self.current.segment.start].started_s
            low, high = (day(start + t) for t in self.change.time_ci95_s)
            shape, share = max(self.change.shapes.items(), key=lambda s: s[1])
            how = f"as a {shape} ({100.0 * share:.0f} %)"
            out.append(f"The change began between {low} and {high} (95 %), {how}.")
        elif self.change is not None:
            out.append(as_sentence(self.change.sentence))
        return (*out, *([as_sentence(self.outlook.sentence)] if self.outlook is not None else []))

    @property
    def current(self) -> Track | None:
        """Return the last stretch."""
        return self.tracks[-1] if self.tracks else None


def judge(history: JointHistory, detector: Detector, baseline: int | None = None) -> Finding:
    """Judge one joint.

    Parameters
    ----------
    history : JointHistory
    detector : Detector
    baseline : int, optional
        How many of the first cycles of each stretch are healthy; else by the rule
        (`agent.monitor.baseline`).

    Raises
    ------
    ValueError
        The baseline is too short for any.
    """
    tracks = tuple(_track(history, segment, detector, baseline) for segment in history.segments)
    if not tracks:
        why = "no cycle is usable" if history.set_aside else "there is no cycle"
        return _undecided(history, detector, tracks, why, _USABLE)
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
    features = features_table(cycles, history.features[segment.start : segment.stop])
    time_s = np.array([c.started_s for c in cycles])
    baseline = baseline_of(features, asked)
    if not baseline.enough:
        return Track(segment, baseline)
    baseline, series, judgement = watched(features, time_s, baseline, detector)
    found = compensated(features, baseline)
    able = bool(judgement.traces)
    promise = _promise(detector, series) if able else ""
    return Track(segment, baseline, found, promise, series, judgement if able else None)


def _judged(
    history: JointHistory, detector: Detector, tracks: tuple[Track, ...], window: int
) -> Finding:
    """Say how the joint is now, and in an alarm why."""
    last = tracks[-1]
    assert last.series is not None
    assert last.judgement is not None
    assert history.grid is not None
    segment = last.segment
    cycles = history.cycles[segment.start : segment.stop]
    now = slice(len(cycles) - window, len(cycles))
    found = compare(
        cycles,
        history.features[segment.start : segment.stop],
        history.grid,
        last.baseline.cycles,
        now,
    )
    degc = np.array([c.temperature_degc for c in cycles])
    warm = warmth(float(degc[-1]), degc[: last.baseline.cycles])
    state = last.judgement.states[-1]
    if state is State.NO_FAULT:
        sentence = quiet(found, last.baseline.cycles)
        return Finding(
            history,
            detector.name,
            tracks,
            state.value,
            sentence,
            found,
            next_steps=_comparable(warm),
            warmth=warm,
        )
    reasons = reasons_of(found, history.grid.low_rad_s, _beside(cycles, last.baseline.cycles, now))
    change = change_time(last.series)
    ahead = outlook(last.series)
    return Finding(
        history,
        detector.name,
        tracks,
        state.value,
        alarmed(state, found, reasons, since(change, cycles)),
        found,
        reasons,
        change,
        ahead,
        (*reasons.actions, *_comparable(warm)),
        warm,
    )


def _comparable(warm: Warmth) -> tuple[str, ...]:
    """Return what to do about a cycle that was run warmer or colder than the healthy ones."""
    if warm.word not in (WARM, COLD):
        return ()
    return (f"the last cycle was {warm.sentence}; {next_comparable(warm).sentence}",)


def _beside(cycles: tuple[Cycle, ...], healthy: int, now: slice) -> Beside:
    """Return what gravity and inertia did meanwhile."""
    load = np.array([c.load_nm for c in cycles])
    inertia = np.array([c.inertia_kg_m2 for c in cycles])
    payload = np.array([c.payload_kg for c in cycles])
    before, latest = payload[:healthy], payload[now]
    stated = bool(
        np.all(np.isfinite(before))
        and np.all(latest >= before.min())
        and np.all(latest <= before.max())
    )
    load_level, load_change, load_deviation = _moved(load, healthy, now)
    level, change, deviation = _moved(inertia, healthy, now)
    return Beside(load_level, load_change, load_deviation, level, change, deviation, stated)


def _moved(values: Floats, healthy: int, now: slice) -> tuple[float, float, float]:
    """Return healthy mean, change since, and the change's deviation; infinite where unknown."""
    before, latest = values[:healthy], values[now]
    if not (np.all(np.isfinite(before)) and np.all(np.isfinite(latest))) or healthy < 3:
        return math.nan, 0.0, math.inf
    scatter = max(float(np.std(before, ddof=1)), 1e-3 * abs(float(before.mean())), 1e-12)
    deviation = scatter * math.sqrt(1.0 / latest.size + 1.0 / healthy)
    return float(before.mean()), float(latest.mean() - before.mean()), deviation


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
