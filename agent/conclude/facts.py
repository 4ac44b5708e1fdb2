"""What a verdict by history says, as data: what is decided, and the numbers that go with it.

The monitor's sentence is English. Whoever says it in another language, or asks whether an alarm has
got worse, reads this and never the sentence.
"""

from __future__ import annotations

import math
from typing import Any

from agent.identify.result import Parameter
from agent.monitor.verdict.comparison import Comparison, Effect
from agent.monitor.verdict.verdict import NOT_DECIDABLE, Finding
from agent.monitor.verdict.words import day, moved

NO_CYCLE, TOO_FEW, UNABLE = "no-cycle", "too-few", "detector-unable"
BASELINE, AS_BEFORE, MOVED = "baseline-complete", "as-before", "moved"
INCREASED, INCREASED_A_LOT = "increased", "increased-a-lot"
RISING, RISING_A_LOT, UNSETTLED = "rising", "rising-a-lot", "unsettled"
SAID = (
    *(NO_CYCLE, TOO_FEW, UNABLE, BASELINE, AS_BEFORE, MOVED, INCREASED, INCREASED_A_LOT),
    *(RISING, RISING_A_LOT, UNSETTLED),
)
"""What may be decided; the key `said`."""


def facts_of(finding: Finding) -> dict[str, Any]:
    """Return what was decided of a joint, as plain JSON.

    `said` is one of `SAID`. Changes of friction at `low` and `high` speed are in per cent with
    their 95 % intervals, `temperature_degc` is null where it is unknown, dates are UTC.
    `since_first` is the change at low speed over the first `cycles` of all, where friction rises or
    falls from the first one on. Only `next_steps` are words: the engine's own, in English.
    """
    steps = {"next_steps": list(finding.next_steps)} if finding.next_steps else {}
    return {**_said(finding), **steps}


def _said(finding: Finding) -> dict[str, Any]:
    track, found = finding.current, finding.comparison
    if finding.since_first is not None and track is not None:
        said = RISING_A_LOT if finding.status == "H1" else RISING
        cycles = track.segment.stop - track.segment.start
        return {"said": said, **_since_first(finding.since_first.rise, cycles), **_why(finding)}
    if finding.fallen is not None and track is not None:
        return {"said": UNSETTLED, **_since_first(finding.fallen, track.baseline.cycles)}
    if finding.status == NOT_DECIDABLE:
        if track is None:
            return {"said": NO_CYCLE}
        if track.series is not None:
            return {"said": UNABLE}
        baseline = track.baseline
        return {"said": TOO_FEW, "healthy": baseline.cycles, "needed": baseline.needed}
    healthy = 0 if track is None else track.baseline.cycles
    if found is None:
        return {"said": BASELINE, "healthy": healthy}
    facts = {"healthy": healthy, **_compared(found)}
    if not finding.alarm:
        word = moved(found)
        return {"said": MOVED if word else AS_BEFORE, "moved": word, **facts}
    said = INCREASED_A_LOT if finding.status == "H1" else INCREASED
    return {"said": said, **facts, **_why(finding), **_when(finding)}


def _compared(found: Comparison) -> dict[str, Any]:
    degc = found.temperature_degc
    return {
        "low": _effect(found.effects["low"]),
        "high": _effect(found.effects["high"]),
        "temperature_degc": float(degc) if math.isfinite(degc) else None,
        "extrapolated": bool(found.extrapolated),
    }


def _since_first(change: Parameter, cycles: int) -> dict[str, Any]:
    low, high = (100.0 * end for end in change.ci95 or (math.nan, math.nan))
    since = {"percent": 100.0 * change.value, "from": low, "to": high}
    return {"since_first": since, "cycles": cycles}


def _effect(effect: Effect) -> dict[str, float]:
    low, high = effect.ci95_percent
    return {"percent": float(effect.percent), "from": float(low), "to": float(high)}


def _why(finding: Finding) -> dict[str, Any]:
    """Return the causes that together are sure, the most probable first."""
    return {} if finding.reasons is None else {"causes": [c.id for c in finding.reasons.likely]}


def _when(finding: Finding) -> dict[str, Any]:
    """Return when the change began, as far as that is decidable."""
    if finding.change is None or not finding.change.decidable or finding.current is None:
        return {}
    start_s = finding.history.cycles[finding.current.segment.start].started_s
    low_s, high_s = finding.change.time_ci95_s
    return {
        "began": day(start_s + finding.change.time_s),
        "began_between": [day(start_s + low_s), day(start_s + high_s)],
    }
