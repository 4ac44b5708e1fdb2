"""The night's verdict against the joint's baseline, through the monitor's public function."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from agent.cli.history.monitor import MonitorRequest, monitor
from agent.conclude.facts import facts_of
from agent.errors import AgentError, InputError
from agent.monitor.verdict.verdict import NOT_DECIDABLE, Finding
from agent.record.catalogue.catalogue import Catalogue
from agent.record.seal import content
from agent.record.verdict_file import Verdict, write_verdict


def against_baseline(recording: Path, verdict: Verdict, url: str | None = None) -> Verdict:
    """Judge a cycle by its joint's history, and write the verdict anew with what it stands on.

    Parameters
    ----------
    recording : pathlib.Path
        The newest cycle; its history are the recordings of its joint beside it.
    verdict : Verdict
        On the recording by itself.
    url : str, optional
        Of the catalogue.

    Returns
    -------
    Verdict
        The one given, where the monitor cannot judge; its sentence then says why.
    """
    try:
        finding = _finding(verdict, history_of(recording, verdict))
        judged = _judged(recording, verdict, finding)
        write_verdict(recording, judged)
        with Catalogue(recording.parent, url) as catalogue:
            catalogue.add(recording)
    except AgentError as error:
        return replace(verdict, sentence=f"{verdict.sentence} No verdict on its history: {error}")
    return judged


def history_of(recording: Path, verdict: Verdict) -> list[str]:
    """Return the recordings of the verdict's joint up to its own; their names sort by time."""
    own = recording.parent.glob(f"{verdict.robot}-axis{verdict.axis}-*.parquet")
    return sorted(str(path) for path in own if path.name <= recording.name)


def state_of(recording: Path, verdict: Verdict, history: list[str]) -> str:
    """Return what the monitor says now of the joint as it was at a recording.

    Raises
    ------
    agent.errors.InputError
        The history cannot be judged.
    """
    return _judged(recording, verdict, _finding(verdict, history)).state


def _finding(verdict: Verdict, history: list[str]) -> Finding:
    """Return the monitor's finding on the verdict's joint."""
    for finding in monitor(MonitorRequest(history)).findings:
        joint = finding.history.joint
        if (joint.robot, joint.axis) == (verdict.robot, verdict.axis):
            return finding
    raise InputError(f"The monitor says nothing of {verdict.robot} axis {verdict.axis}.")


def _judged(recording: Path, verdict: Verdict, finding: Finding) -> Verdict:
    """Return the verdict with the monitor's state, sentence and baseline.

    A cycle that carries no estimate keeps its own sentence: the history's is about older cycles.
    """
    used = {cycle.name for cycle in finding.history.cycles}
    if recording.name not in used:
        apart = {s.name: s.reason for s in finding.history.set_aside}
        reason = apart.get(recording.name, "it carries no curve")
        text = f"{verdict.sentence} Not compared with its history: {reason}."
        return replace(verdict, sentence=text)
    return replace(
        verdict,
        alarm=finding.alarm,
        state=finding.status.replace(NOT_DECIDABLE, "not decidable"),
        sentence=" ".join((finding.sentence, *finding.timing)),
        baseline=_baseline(recording.parent, finding),
        facts=facts_of(finding),
    )


def _baseline(folder: Path, finding: Finding) -> tuple[str, ...]:
    """Return the content hashes of the recordings that the joint is compared with now."""
    track = finding.current
    if track is None:
        return ()
    start, first = track.segment.start, finding.compared_with or track.baseline.cycles
    names = [c.name for c in finding.history.cycles[start : start + first]]
    return tuple(content(folder / name).sha256 for name in names)
