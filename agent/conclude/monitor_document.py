"""The `stribeck.monitor/1` document (docs/monitor.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from agent.conclude.cycles import Unreadable
from agent.identify.result import Floats
from agent.monitor.change.change_time import ChangeTime
from agent.monitor.change.outlook import Outlook
from agent.monitor.compensation.compensation import Law
from agent.monitor.history.cycle import Joint
from agent.monitor.verdict.verdict import Finding, Track

if TYPE_CHECKING:  # it brings the explain engine, which few alarms are asked of
    from agent.conclude.alarm import AlarmExplanation

SCHEMA = "stribeck.monitor/1"


def to_json(
    findings: Sequence[Finding],
    unreadable: Sequence[Unreadable],
    explained: Mapping[Joint, AlarmExplanation] | None = None,
) -> dict[str, Any]:
    """Return plain JSON; null is what is no number, or was not explained."""
    explained = explained or {}
    return {
        "schema": SCHEMA,
        "alarm": any(finding.alarm for finding in findings),
        "joints": [
            _joint(finding) | {"explanation": _explanation(explained.get(finding.history.joint))}
            for finding in findings
        ],
        "unreadable": [{"name": u.name, "reason": u.reason} for u in unreadable],
    }


def _joint(finding: Finding) -> dict[str, Any]:
    history = finding.history
    grid = history.grid
    start = history.cycles[finding.tracks[-1].segment.start].started_s if finding.tracks else 0.0
    return {
        "robot": history.joint.robot,
        "axis": history.joint.axis,
        "gear_ratio": history.joint.gear_ratio,
        "state": finding.status,
        "alarm": finding.alarm,
        "sentence": finding.sentence,
        "detector": finding.detector,
        "cycles": len(history.cycles),
        "speeds_rad_s": None
        if grid is None
        else [float(grid.speed_rad_s[0]), float(grid.speed_rad_s[-1])],
        "low_speed_rad_s": None if grid is None else grid.low_rad_s,
        "comparison": None if finding.comparison is None else finding.comparison.to_json(),
        "reasons": None if finding.reasons is None else finding.reasons.to_json(),
        "change_time": None if finding.change is None else _change(finding.change, start),
        "outlook": None if finding.outlook is None else _outlook(finding.outlook, start),
        "next_steps": list(finding.next_steps),
        "warmth": None
        if finding.warmth is None
        else {"word": finding.warmth.word, "sentence": finding.warmth.sentence},
        "siblings": _siblings(finding),
        "segments": [_segment(finding, track) for track in finding.tracks],
        "set_aside": [{"name": s.name, "reason": s.reason} for s in history.set_aside],
        "notes": list(history.notes),
    }


def _siblings(finding: Finding) -> dict[str, Any] | None:
    """Return what joints of the same kind lend, null where none are known."""
    known, last = finding.history.siblings, finding.current
    if known is None:
        return None
    laws = {} if last is None else last.baseline.laws
    return {
        "sentence": finding.lent,
        "known": known.known,
        "grown": list(known.grown),
        "features": {
            name: {
                "scatter_percent": 100.0 * kind.scatter,
                "scatter_worth_cycles": kind.worth,
                "correlation": kind.tie,
                "correlation_worth_cycles": kind.tie_worth,
                "share": laws[name].lent if name in laws else None,
            }
            for name, kind in known.kinds.items()
        },
    }


def _explanation(asked: AlarmExplanation | None) -> dict[str, Any] | None:
    if asked is None:
        return None
    verdict = None if asked.found is None else asked.found.verdict
    return {"sentence": asked.sentence, "verdict": verdict}


def _segment(finding: Finding, track: Track) -> dict[str, Any]:
    """Return one stretch between events: baseline, laws, and every cycle of it."""
    segment, baseline = track.segment, track.baseline
    cycles = finding.history.cycles[segment.start : segment.stop]
    features = finding.history.features[segment.start : segment.stop]
    return {
        "events": [event.to_json() for event in segment.events],
        "begun": None
        if track.begun is None
        else {name: effect.to_json() for name, effect in track.begun.effects.items()},
        "baseline": {
            "cycles": baseline.cycles,
            "needed": baseline.needed,
            "enough": baseline.enough,
            "asked": baseline.asked,
            "promise": track.promise,
            "standard_error_percent": _number(100.0 * baseline.standard_error),
            "compensation": {name: _law(law) for name, law in baseline.laws.items()},
        },
        "recordings": [c.name for c in cycles],
        "started_at": [c.started_at for c in cycles],
        "temperature_degc": [_number(c.temperature_degc) for c in cycles],
        "payload_kg": [_number(c.payload_kg) for c in cycles],
        "state": [s.value for s in track.judgement.states] if track.judgement else None,
        "features": {
            name: {
                "value": [f.values[name] for f in features],
                "ci95": [list(f.ci95(name)) for f in features],
                **_compensated(track, name),
            }
            for name in (features[0].values if features else ())
        },
        "detector": {}
        if track.judgement is None
        else {
            name: {
                "statistic": _numbers(trace.statistic),
                "threshold": _numbers(trace.threshold),
            }
            for name, trace in track.judgement.traces.items()
        },
    }


def _compensated(track: Track, name: str) -> dict[str, Any]:
    if track.found is None:
        return {}
    found = track.found[name]
    return {
        "at_reference": _numbers(found.value),
        "deviation": _numbers(found.deviation),
        "extrapolated": found.extrapolated.tolist(),
    }


def _law(law: Law) -> dict[str, Any]:
    """Return what temperature does to a feature."""
    slope, deviation = law.slope_per_k
    return {
        "temperature_law": law.name,
        "reference_degc": _number(law.basis.reference[0]),
        "learned_degc": [_number(law.basis.lowest[0]), _number(law.basis.highest[0])],
        "healthy": law.level,
        "healthy_deviation": law.level_deviation,
        "scatter": law.scatter,
        "slope_percent_per_k": _number(100.0 * slope),
        "slope_deviation_percent_per_k": _number(100.0 * deviation),
    }


def _change(change: ChangeTime, start_s: float) -> dict[str, Any]:
    low, high = change.time_ci95_s
    return {
        "decidable": change.decidable,
        "sentence": change.sentence,
        "at": _iso(start_s + change.time_s),
        "ci95": [_iso(start_s + low), _iso(start_s + high)],
        "probability": change.probability if math.isfinite(change.probability) else None,
        "shapes": dict(change.shapes),
        "rise": change.rise.to_json(),
    }


def _outlook(ahead: Outlook, start_s: float) -> dict[str, Any]:
    return {
        "decidable": ahead.decidable,
        "sentence": ahead.sentence,
        "limit_rise": ahead.limit_rise,
        "earliest": _iso(start_s + ahead.earliest_s),
        "latest": _iso(start_s + ahead.latest_s),
    }


def _iso(seconds: float) -> str | None:
    from datetime import UTC, datetime

    if not math.isfinite(seconds):
        return None
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds")


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _numbers(values: Floats) -> list[float | None]:
    return [_number(v) for v in values.tolist()]
