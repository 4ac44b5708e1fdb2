"""`stribeck monitor`: a history of cycles in, an alarm with its reason or a quiet sentence out."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from agent.cli.history.monitor_text import monitor_text
from agent.cli.terminal.exits import BAD_NEWS
from agent.cli.terminal.talk import progress_bar, talker
from agent.conclude.cycles import Unreadable, cache_folder, cycles_of, nothing_usable
from agent.conclude.monitor_document import to_json
from agent.errors import InputError, UsageError
from agent.monitor.detection.detectors import DEFAULT, detector
from agent.monitor.detection.series import Detector
from agent.monitor.history.cycle import Cycle, Joint
from agent.monitor.history.events import Event, parse_events
from agent.monitor.history.history import histories
from agent.monitor.verdict.kinship import Pool
from agent.monitor.verdict.verdict import Finding, judge
from agent.record.atomic import check_folder, make_folder, publish
from agent.record.events_file import read_events
from agent.record.reading import find
from drivers.errors import why_unreadable

if TYPE_CHECKING:  # it brings the explain engine, which few alarms are asked of
    from agent.conclude.alarm import AlarmExplanation

EVENTS = "events.toml"
_SAID = {"swap": "swap", "oil": "oil-change", "oil-change": "oil-change"}
_SAID |= {"relubrication": "relubrication", "other": "other"}


@dataclass(frozen=True)
class MonitorRequest:
    """What the command was asked.

    Parameters
    ----------
    patterns : sequence of str
        The history: files, folders or globs.
    baseline : int or None
        How many of the first cycles are healthy; None for the rule.
    events : Path or None
        Of `events.toml`; None to look for it beside the recordings.
    detector : str
    low_rad_s : float or None
        Where the low-speed part of the curve ends.
    cache : bool
        Whether estimates are kept.
    explain : bool
        Whether the explain engine is asked what each alarm is.
    siblings : sequence of str
        Recordings of joints of the same kind, as `patterns`: they teach and are not judged.
    """

    patterns: Sequence[str]
    baseline: int | None = None
    events: Path | None = None
    detector: str = DEFAULT
    low_rad_s: float | None = None
    cache: bool = True
    explain: bool = False
    siblings: Sequence[str] = ()


@dataclass(frozen=True)
class Monitored:
    """The findings, one a joint, the files that could not be read, and alarms explained."""

    findings: tuple[Finding, ...]
    unreadable: tuple[Unreadable, ...]
    explained: Mapping[Joint, AlarmExplanation] = field(default_factory=dict)

    @property
    def alarm(self) -> bool:
        """Return whether any joint's friction is increased now."""
        return any(finding.alarm for finding in self.findings)


def run_monitor(request: MonitorRequest, out: Path | None, *, as_json: bool) -> None:
    """Monitor the joints of a history and print what is said of them; exit 1 on an alarm.

    Raises
    ------
    agent.errors.InputError
        Nothing of the history can be used, or an option cannot.
    """
    if out is not None:
        check_folder(out)
    found = monitor(request)
    document = json.dumps(to_json(found.findings, found.unreadable, found.explained), indent=2)
    if out is not None:
        report = _write(found, document, out)
        talker().print(f"The report is in {report}.")
    typer.echo(
        document if as_json else monitor_text(found.findings, found.unreadable, found.explained)
    )
    if found.alarm:
        raise typer.Exit(BAD_NEWS)


def monitor(request: MonitorRequest) -> Monitored:
    """Read, estimate and judge.

    Raises
    ------
    agent.errors.InputError
        As for `run_monitor`.
    """
    try:
        judges = detector(request.detector)
    except ValueError as error:  # known before a year of recordings is estimated
        raise UsageError(f"--detector: {error}.") from error
    paths = find(request.patterns)
    cycles, unreadable = _read_cycles(request, paths)
    if not cycles:
        raise nothing_usable(unreadable)
    try:
        joints = histories(cycles, events_for(request, paths), request.low_rad_s)
        findings = tuple(judge(history, judges, request.baseline) for history in joints)
        pool = Pool(findings, _given(request, judges))
        siblings = [pool.siblings_of(history) for history in joints]
        findings = tuple(
            finding
            if known is None
            else judge(replace(finding.history, siblings=known), judges, request.baseline)
            for finding, known in zip(findings, siblings, strict=True)
        )
    except ValueError as error:
        raise InputError(f"{str(error)[0].upper()}{str(error)[1:]}.") from error
    return Monitored(findings, unreadable, _explained(findings, paths) if request.explain else {})


def _read_cycles(
    request: MonitorRequest, paths: Sequence[Path]
) -> tuple[tuple[Cycle, ...], tuple[Unreadable, ...]]:
    with progress_bar("estimating") as moved:
        return cycles_of(paths, cache_folder() if request.cache else None, moved)


def _given(request: MonitorRequest, judges: Detector) -> tuple[Finding, ...]:
    """Return what the siblings that were handed in are found to be, each by itself."""
    if not request.siblings:
        return ()
    paths = find(request.siblings)
    cycles, unreadable = _read_cycles(request, paths)
    for bad in unreadable:
        talker().print(f"Set aside, of the siblings: {bad.reason}")
    if not cycles:
        raise nothing_usable(unreadable)
    joints = histories(cycles, events_for(request, paths), request.low_rad_s)
    return tuple(judge(history, judges) for history in joints)


def _explained(findings: Sequence[Finding], paths: Sequence[Path]) -> dict[Joint, AlarmExplanation]:
    """Ask the explain engine what each alarm is."""
    from agent.conclude.alarm import explained_alarm

    out = {}
    for finding in findings:
        if finding.alarm:
            joint = finding.history.joint
            talker().print(f"Explaining the alarm of {joint.label} ...")
            out[joint] = explained_alarm(finding, paths)
    return out


def events_for(request: MonitorRequest, paths: Sequence[Path]) -> tuple[Event, ...]:
    """Return what people and the agent wrote down of the joints.

    Raises
    ------
    agent.errors.InputError
        The file cannot be read or is no list of events.
    """
    folders = sorted({path.parent for path in paths})
    beside = [f / EVENTS for f in folders if (f / EVENTS).is_file()]
    files = [request.events] if request.events is not None else beside
    written = [event for file in files for event in _read(file)]
    for folder in folders:
        entries, problems = read_events(folder)
        for problem in problems:
            talker().print(problem)
        written += [
            Event(_seconds(e.at), _SAID[e.kind], e.text, e.robot or None, e.axis)
            for _, e in entries
            if e.kind in _SAID
        ]
    return tuple(sorted(written, key=lambda e: e.at_s))


def _read(path: Path) -> tuple[Event, ...]:
    try:
        return parse_events(tomllib.loads(path.read_text(encoding="utf-8-sig")))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({why_unreadable(error)}).") from error
    except (ValueError, RecursionError) as error:  # a TOML error is a ValueError
        raise InputError(f"{path}: {error}.", "See docs/monitor.md, events.") from error


def _seconds(at: str) -> float:
    try:
        return datetime.fromisoformat(at).timestamp()
    except ValueError as error:
        raise InputError(f"events.jsonl: {at!r} is no time in ISO 8601.") from error


def _write(found: Monitored, document: str, out: Path) -> Path:
    """Write numbers and page, each whole or not at all."""
    from agent.report.monitor import monitor_html

    make_folder(out)
    report = out / "report.html"
    pages = _explanations(found, out)
    page = monitor_html(found.findings, [(u.name, u.reason) for u in found.unreadable], pages)
    publish({out / "monitor.json": f"{document}\n".encode(), report: page.encode()}, overwrite=True)
    return report


def _explanations(found: Monitored, out: Path) -> dict[Joint, tuple[str, str]]:
    """Write the pages of explained alarms; return sentence and page, beside the report, of each."""
    from agent.cli.explain.explain import write_explanation

    pages = {}
    for joint, asked in found.explained.items():
        name = ""
        if asked.found is not None and asked.twin is not None:
            name = f"explanation-{joint.robot}-axis{joint.axis}/report.html"
            write_explanation((out / name).parent, asked.found, asked.twin, asked.recordings)
        pages[joint] = (asked.sentence, name)
    return pages
