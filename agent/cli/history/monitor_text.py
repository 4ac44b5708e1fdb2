"""What `stribeck monitor` says in the terminal: one sentence first, the reasons after it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from agent.conclude.cycles import Unreadable
from agent.identify.result import Parameter
from agent.monitor.detection.series import State
from agent.monitor.history.cycle import Joint
from agent.monitor.verdict.comparison import Effect
from agent.monitor.verdict.finding import NOT_DECIDABLE, Finding
from agent.monitor.verdict.words import parts_of
from agent.numbers import Scale, scale_for, signed_interval

if TYPE_CHECKING:  # it brings the explain engine, which few alarms are asked of
    from agent.conclude.alarm import AlarmExplanation

_MOST = 8
_SAID = {
    State.NO_FAULT.value: "no alarm",
    State.INCREASED.value: "ALARM: friction has increased",
    State.HIGH.value: "URGENT ALARM: friction has increased a lot",
    NOT_DECIDABLE: "not decidable yet",
}


def monitor_text(
    findings: Sequence[Finding],
    unreadable: Sequence[Unreadable],
    explained: Mapping[Joint, AlarmExplanation],
) -> str:
    """Return what a technician reads, joint by joint."""
    parts = [_joint(finding, explained.get(finding.history.joint)) for finding in findings]
    if unreadable:
        parts.append("\n".join(["Not read:", *_listed([f"{u.reason}" for u in unreadable])]))
    return "\n\n".join(parts)


def _joint(finding: Finding, asked: AlarmExplanation | None) -> str:
    history = finding.history
    lines = [f"{history.joint.label}: {_SAID[finding.status]}"]
    lines += [f"  {sentence}" for sentence in parts_of(finding.sentence) if sentence]
    if finding.reasons is not None:
        lines += [
            f"  {said}" for said in (finding.reasons.sentence, finding.reasons.others) if said
        ]
    lines += [] if asked is None else [f"  {asked.sentence}"]
    lines += [f"  {sentence}" for sentence in finding.timing]
    if finding.comparison is not None:
        scale = scale_for("N m", finding.comparison.changes_nm)
        lines += [_effect(name, e, scale) for name, e in finding.comparison.effects.items()]
    if finding.next_steps:
        lines += ["  What to do next:", *(f"    - {step}" for step in finding.next_steps)]
    track = finding.current
    if track is not None and track.promise:
        lines.append(f"  {track.promise}")
    lines += [f"  {finding.lent}"] if finding.lent else []
    if track is not None and track.segment.events:
        lines.append(f"  {finding.began_anew(track)}")
    if history.notes:
        lines += ["  Bear in mind:", *(f"    - {note}" for note in history.notes)]
    if history.set_aside:
        lines.append(f"  Set aside ({len(history.set_aside)}):")
        lines += _listed([f"{s.name}: {s.reason}" for s in history.set_aside])
    return "\n".join(lines)


def _effect(name: str, effect: Effect, scale: Scale) -> str:
    """Return a change in torque, as one line."""
    torque = signed_interval(Parameter(effect.change_nm, effect.ci95_nm), scale)
    span = f"{effect.from_rad_s:.3g} to {effect.to_rad_s:.3g} rad/s"
    which = "all speeds" if name == "whole" else f"{name} speed"
    return f"    {which:<11} {span:<22} {torque}"


def _listed(sentences: Sequence[str]) -> list[str]:
    """Return at most a few of them, and how many more there are."""
    shown = [f"    - {sentence}" for sentence in sentences[:_MOST]]
    more = len(sentences) - _MOST
    return shown + ([f"    - and {more} more (--json lists them all)"] if more > 0 else [])
