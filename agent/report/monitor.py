"""The offline page of a monitored history: one HTML file without network or script."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from agent.identify.result import Parameter
from agent.monitor.detection.series import FEATURES
from agent.monitor.history.cycle import Joint
from agent.monitor.verdict.comparison import Comparison, Effect
from agent.monitor.verdict.reasons import Reasons
from agent.monitor.verdict.verdict import NOT_DECIDABLE, Finding, Track
from agent.monitor.verdict.words import in_percent, parts_of
from agent.numbers import (
    Scale,
    scale_for,
    signed_interval,
    significant,
    units_unbroken,
)
from agent.report.estimate import Picture
from agent.report.figures.canvas import data_uri
from agent.report.figures.monitor_curves import HEALTHY, curves_in_words, figure_monitor_curves
from agent.report.figures.monitor_trends import figure_monitor_trends, trends_in_words
from agent.report.page import render

STATUS = {
    "NF": "No alarm",
    "H0": "Alarm: friction has increased",
    "H1": "Urgent alarm: friction has increased a lot",
    NOT_DECIDABLE: "Not decidable yet",
}
_KINDS = {"NF": "decided", NOT_DECIDABLE: "open"}  # all else is an alarm
_UNITS = {
    "coulomb_nm": "N m",
    "viscous_nm_s_per_rad": "N m s/rad",
    "integral_w": "W",
    "low_integral_w": "W",
}
_LISTED = 40


@dataclass(frozen=True)
class JointView:
    """What the page shows of one joint, every number written."""

    label: str
    id: str
    status: str
    kind: str
    sentence: str
    why: Sequence[str]
    promise: str
    causes: Sequence[tuple[str, str, float]]
    explained: tuple[str, str] | None
    next_steps: Sequence[str]
    facts: Sequence[tuple[str, str]]
    before: str
    effects: Sequence[tuple[str, str, str, str]]
    curves: Picture | None
    trends: Picture | None
    laws: Sequence[tuple[str, str, str, str, str]]
    segments: Sequence[tuple[str, str, str, str, str, str]]
    notes: Sequence[str]
    set_aside: Sequence[tuple[str, str]]
    not_listed: int


def monitor_html(
    findings: Sequence[Finding],
    unreadable: Sequence[tuple[str, str]],
    explained: Mapping[Joint, tuple[str, str]] | None = None,
) -> str:
    """Return the page as text; the same findings give the same text.

    Parameters
    ----------
    findings : sequence of Finding
        One a joint, at least one.
    unreadable : sequence of (name, reason)
        Files that are no recordings.
    explained : mapping of Joint to (sentence, page), optional
        What the explain engine says of an alarm, and its page beside this one; empty for none.
    """
    explained = explained or {}
    joints = [
        _view(finding, f"joint{i}", explained.get(finding.history.joint))
        for i, finding in enumerate(findings)
    ]
    first = findings[0].history.joint
    alone = len(findings) == 1
    return render(
        "monitor.html.j2",
        robot=first.robot if alone else "",
        axis=str(first.axis) if alone else "",
        joints=joints,
        unreadable=list(unreadable),
    )


def _view(finding: Finding, name: str, explained: tuple[str, str] | None) -> JointView:
    history, reasons, found = finding.history, finding.reasons, finding.comparison
    grid, track = history.grid, finding.current
    headline, numbers = parts_of(finding.sentence)
    before = HEALTHY if finding.since_first is None else f"the first {finding.compared_with}"
    return JointView(
        label=history.joint.label,
        id=name,
        status=STATUS[finding.status],
        kind=_KINDS.get(finding.status, "undecided"),
        sentence=_without_status(headline),
        why=[units_unbroken(s) for s in (numbers, *_reasons(finding)) if s],
        promise="" if track is None else units_unbroken(track.promise),
        causes=() if reasons is None else _causes(reasons),
        explained=None if explained is None else (units_unbroken(explained[0]), explained[1]),
        next_steps=[units_unbroken(step) for step in finding.next_steps],
        facts=_facts(finding),
        before=before,
        effects=()
        if found is None
        else [
            _effect(key, found.effects[key], scale_for("N m", found.changes_nm))
            for key in ("low", "high", "whole")
        ],
        curves=None
        if found is None or grid is None
        else Picture(
            data_uri(figure_monitor_curves(found, grid.low_rad_s, before)),
            data_uri(figure_monitor_curves(found, grid.low_rad_s, before, narrow=True)),
            curves_in_words(found, before),
        ),
        trends=None
        if not history.cycles
        else Picture(
            data_uri(figure_monitor_trends(finding)),
            data_uri(figure_monitor_trends(finding, narrow=True)),
            trends_in_words(finding),
        ),
        laws=() if track is None else _laws(track),
        segments=[_segment(finding, t) for t in finding.tracks],
        notes=[units_unbroken(note) for note in history.notes],
        set_aside=[(s.name, s.reason) for s in history.set_aside[:_LISTED]],
        not_listed=max(0, len(history.set_aside) - _LISTED),
    )


def _without_status(sentence: str) -> str:
    """Leave out what the headline says already."""
    for start in (
        "No alarm, yet ",
        "No alarm, ",
        "Not decidable yet: ",
    ):
        if sentence.startswith(start):
            rest = sentence.removeprefix(start)
            return units_unbroken(f"{rest[0].upper()}{rest[1:]}")
    return units_unbroken(sentence)


def _reasons(finding: Finding) -> tuple[str, ...]:
    """Return why an alarm is one, since when, and what is ahead; nothing without an alarm."""
    return () if finding.reasons is None else (finding.reasons.sentence, *finding.timing)


def _causes(reasons: Reasons) -> list[tuple[str, str, float]]:
    """Return each cause with its share, written and drawn; those of next to nothing in one row."""
    rows = [(c.words, c.share, 100.0 * c.probability) for c in reasons.causes if not c.slight]
    slight = [c.short for c in reasons.causes if c.slight]
    share = "under 1 % each" if len(slight) > 1 else "under 1 %"
    return [*rows, ("; ".join(slight), share, 0.0)] if slight else rows


def _facts(finding: Finding) -> list[tuple[str, str]]:
    """Return what the comparison stands on."""
    history, grid, track = finding.history, finding.history.grid, finding.current
    rows = [("Cycles", f"{len(history.cycles)} counted, {len(history.set_aside)} set aside")]
    if history.cycles:
        first, last = history.cycles[0].started_at[:10], history.cycles[-1].started_at[:10]
        rows.append(("From, to", f"{first}, {last}"))
    if track is not None:
        baseline = track.baseline
        how = "as asked" if baseline.asked else "by the rule"
        if baseline.cycles > baseline.needed:
            how = f"grown from {baseline.needed}"
        have = f"{baseline.cycles} cycles, {how}"
        short = f"{track.baseline.cycles} of {track.baseline.needed} cycles"
        rows.append(("Baseline", have if track.baseline.enough else short))
    if grid is not None:
        low, high = grid.speed_rad_s[0], grid.speed_rad_s[-1]
        span = f"{low:.3g} to {high:.3g} rad/s, low speed up to {grid.low_rad_s:.3g}"
        rows.append(("Compared over", units_unbroken(span)))
    if finding.lent:
        rows.append(("Siblings", finding.lent))
    return rows


def _effect(key: str, effect: Effect, scale: Scale) -> tuple[str, str, str, str]:
    """Return range, change in per cent and in torque, and the healthy torque, as written."""
    names = {"low": "low speed", "high": "high speed", "whole": "all speeds"}
    span = f"{names[key]} ({effect.from_rad_s:.3g} to {effect.to_rad_s:.3g} rad/s)"
    healthy = scale_for("N m", [effect.healthy_nm])
    return (
        span,
        signed_interval(Parameter(effect.percent, effect.ci95_percent), Scale(1.0, "%")),
        signed_interval(Parameter(effect.change_nm, effect.ci95_nm), scale),
        f"{significant(healthy.factor * effect.healthy_nm, 3)} {healthy.unit}",
    )


def _laws(track: Track) -> list[tuple[str, str, str, str, str]]:
    """Return what temperature does to each feature: level, law, slope, learned range."""
    rows = []
    for name, law in track.baseline.laws.items():
        scale = scale_for(_UNITS[name], [law.level])
        slope, deviation = (100.0 * s for s in law.slope_per_k)
        low, high = law.basis.lowest[0], law.basis.highest[0]
        known = math.isfinite(low)
        rows.append(
            (
                FEATURES[name],
                f"{significant(scale.factor * law.level, 4)} {scale.unit}",
                f"{100.0 * law.scatter / abs(law.level):.2f} %",
                f"{slope:+.2f} ± {1.96 * deviation:.2f} %/K".replace("-", "−") if known else "–",
                f"{low:.1f} to {high:.1f} °C, {law.name}" if known else "no temperature",
            )
        )
    return rows


def _segment(finding: Finding, track: Track) -> tuple[str, str, str, str, str, str]:
    """Return when a stretch began and why, what that changed, its baseline, and its last state."""
    cycles = finding.history.cycles[track.segment.start : track.segment.stop]
    events = "; ".join(e.label for e in track.segment.events) or "first cycle"
    state = track.judgement.states[-1].value if track.judgement else NOT_DECIDABLE
    baseline = f"{track.baseline.cycles} of {track.baseline.needed}"
    low, high = ("–", "–") if track.begun is None else _at_both(track.begun)
    held = f"{len(cycles)} ({baseline})"
    return (cycles[0].started_at[:10], events, low, high, held, STATUS[state])


def _at_both(begun: Comparison) -> tuple[str, str]:
    """Return what changed at low and at high speed, in per cent."""
    low, high = (begun.effects[name] for name in ("low", "high"))
    return units_unbroken(in_percent(low)), units_unbroken(in_percent(high))
