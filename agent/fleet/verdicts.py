"""Every joint of a lake judged by its history: again only where it has new cycles or events."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from agent.errors import InputError, UsageError
from agent.fleet.cluster import Opened
from agent.fleet.histories import Stand, cycles_of, stands
from agent.fleet.lake import Lake
from agent.fleet.results import Results
from agent.fleet.roster import Roster, roster_of
from agent.fleet.version import monitor_version
from agent.fleet.work import carry_out

COLUMNS = {
    "site": "string",
    "robot": "string",
    "axis": "int64",
    "model": "string",
    "failure": "string",
    "state": "string",
    "alarm": "bool",
    "sentence": "string",
    "cycles": "int64",
    "last_cycle": "string",
    "low_rise_percent": "double",
    "low_rise_from_percent": "double",
    "low_rise_to_percent": "double",
    "limit_earliest": "string",
    "limit_latest": "string",
    "coulomb_nm": "double",
    "viscous_nm_s_per_rad": "double",
    "finding": "string",
}
"""Columns of the verdicts' rows; the low-speed rise is at equal temperature; `finding` is JSON.

`model` is what the recordings say, empty where they do not: `fleet.toml` may say otherwise at any
time, and is asked when rows are read (`verdicts`).
"""

EVENTS = "events.toml"


@dataclass(frozen=True)
class Joint:
    """One joint to judge, with its cycles: JSON, as the lake's estimates have them."""

    site: str
    robot: str
    axis: int
    detector: str
    cycles: tuple[str, ...]
    events: str
    month: str
    key: str

    @property
    def name(self) -> str:
        """Return the joint in words."""
        return f"{self.robot} axis {self.axis}"

    def refused(self, failure: str) -> dict[str, Any]:
        """Return the row of a joint that could not be judged."""
        return _row(self, failure=failure)


@dataclass(frozen=True)
class Judged:
    """What one run over the joints did; `rows` are the present verdicts of all joints."""

    done: int
    already: int
    failed: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]


def verdicts_of(lake: Lake) -> Results:
    """Return the lake's verdicts by this code."""
    return Results(lake, "monitor", monitor_version(), COLUMNS)


def monitor_all(
    lake: Lake,
    opened: Opened,
    detector: str,
    progress: Callable[[int, int], None] | None = None,
) -> Judged:
    """Judge every joint that has estimates this version has not judged yet.

    Raises
    ------
    agent.errors.InputError
        `events.toml` or `fleet.toml` cannot be used, or there is no such detector.
    """
    from agent.monitor.detection.detectors import detector as detector_of

    try:
        detector_of(detector)
    except ValueError as error:
        raise UsageError(f"--detector: {error}.") from error
    roster, results = roster_of(lake), verdicts_of(lake)
    present = present_stands(lake, detector)
    due = _due(present, results)

    def show(done: int) -> None:
        if progress is not None:
            progress(done, len(due))

    joints = _joints(lake, due, detector)
    done = carry_out(opened, judge_one, joints, results, show)
    rows = tuple(verdicts(results, present, roster))
    return Judged(done.done, len(present) - len(due), done.failed, rows)


def present_stands(lake: Lake, detector: str) -> dict[str, Stand]:
    """Return how far each joint's history goes now, by the key that its verdict has then.

    Raises
    ------
    agent.errors.InputError
        `events.toml` cannot be used.
    """
    found = stands(lake, f"{detector}\0{_events(lake)}")
    return {f"{s.site}/{s.robot}/{s.axis}/{s.digest}": s for s in found}


def verdicts(
    results: Results, present: dict[str, Stand], roster: Roster
) -> Iterator[dict[str, Any]]:
    """Yield the verdicts of the joints as they are now; older ones are passed over.

    A joint's model is the one that `fleet.toml` gives its robot now, however long ago the joint was
    judged: no verdict depends on it.
    """
    months = sorted({s.month for s in present.values()})
    for row in results.rows(months=months):
        if row["key"] in present:
            yield row | {"model": roster.name_of(row["robot"], row["model"])}


def _due(present: dict[str, Stand], results: Results) -> dict[str, Stand]:
    """Return the joints that have no verdict of their present history."""
    months = sorted({s.month for s in present.values()})
    known = {key for month in months for key in results.keys(month).to_pylist()}
    return {key: stand for key, stand in present.items() if key not in known}


def _joints(lake: Lake, due: dict[str, Stand], detector: str) -> Iterator[Joint]:
    """Yield the joints that are due, each with all of its cycles, some joints read at a time."""
    events = _events(lake)
    keys = {stand.prefix: key for key, stand in due.items()}
    for stand, cycles in cycles_of(lake, due.values()):
        yield _joint(stand, cycles, detector, events, keys[stand.prefix])


def _joint(stand: Stand, cycles: tuple[str, ...], detector: str, events: str, key: str) -> Joint:
    return Joint(
        stand.site,
        stand.robot,
        stand.axis,
        detector,
        cycles,
        events,
        stand.month,
        key,
    )


def judge_one(joint: Joint) -> dict[str, Any]:
    """Judge one joint: the very functions of `stribeck monitor`.

    Recordings of one robot and axis with several gear ratios are several joints to the monitor;
    the one with the latest cycle is the one that is there.
    """
    from agent.conclude.monitor_document import to_json
    from agent.monitor.detection.detectors import detector
    from agent.monitor.history.cycle import Cycle
    from agent.monitor.history.events import parse_events
    from agent.monitor.history.history import histories
    from agent.monitor.verdict.verdict import judge

    cycles = [Cycle.from_json(json.loads(c)) for c in joint.cycles]
    events = parse_events(tomllib.loads(joint.events)) if joint.events else ()
    findings = [judge(h, detector(joint.detector)) for h in histories(cycles, events)]
    found = max(findings, key=lambda f: f.history.time_s[-1:] or [-1.0])
    document = to_json([found], [])["joints"][0]
    low = ((document["comparison"] or {}).get("effects") or {}).get("low") or {}
    ahead = document["outlook"] or {}
    last = found.history.features[-1].values if found.history.features else {}
    interval = low.get("ci95_percent") or [None, None]
    return _row(
        joint,
        model=found.history.model or "",
        state=found.status,
        alarm=found.alarm,
        sentence=found.sentence,
        cycles=len(found.history.cycles),
        last_cycle=found.history.cycles[-1].started_at if found.history.cycles else "",
        low_rise_percent=low.get("change_percent"),
        low_rise_from_percent=interval[0],
        low_rise_to_percent=interval[1],
        limit_earliest=ahead.get("earliest"),
        limit_latest=ahead.get("latest"),
        coulomb_nm=last.get("coulomb_nm"),
        viscous_nm_s_per_rad=last.get("viscous_nm_s_per_rad"),
        finding=json.dumps(document),
    )


_ORDER = {"H1": 0, "H0": 1, "not-decidable": 3, "NF": 4}


def by_risk(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the verdicts, the most urgent first.

    High friction comes before increased; then a joint that could not be judged at all, because
    nobody knows; then one that nothing can be said of yet; the healthy ones last, by how much of a
    rise their interval leaves possible.
    """

    def urgency(row: dict[str, Any]) -> tuple[int, str, float, str]:
        rank = 2 if row["failure"] else _ORDER[row["state"]]
        rise = row["low_rise_to_percent"]
        soonest = row["limit_earliest"] or "9999"
        return rank, soonest, -(rise if rise is not None else 0.0), row["key"]

    return sorted(rows, key=urgency)


def _events(lake: Lake) -> str:
    if EVENTS not in lake.files_here():
        return ""
    from agent.monitor.history.events import parse_events

    where = f"{lake.url}/{EVENTS}"
    try:
        text = lake.get(EVENTS).decode()
        parse_events(tomllib.loads(text))
    except (ValueError, RecursionError) as error:  # of TOML and of UTF-8, too
        raise InputError(f"{where}: {error}.", "See docs/monitor.md, events.") from error
    return text


def _row(joint: Joint, failure: str = "", **values: Any) -> dict[str, Any]:
    return {
        "key": joint.key,
        "site": joint.site,
        "robot": joint.robot,
        "axis": joint.axis,
        "model": "",
        "failure": failure,
        **values,
    }
