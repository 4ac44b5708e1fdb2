"""The twins of a fleet's models questioned on every robot: where they are wrong in the same way.

For each joint whose model has a twin for that axis, the newest recordings are explained, the newest
third held out. What comes out is one row a joint; `agreement` counts the findings of a model.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from agent.fleet.cluster import Opened, outcomes
from agent.fleet.estimates import estimates_of
from agent.fleet.lake import Entry, Lake
from agent.fleet.results import Results
from agent.fleet.roster import Roster, roster_of, twin_of
from agent.fleet.version import explain_version

COLUMNS = {
    "site": "string",
    "robot": "string",
    "axis": "int64",
    "model": "string",
    "recordings": "int64",
    "failure": "string",
    "verdict": "string",
    "effects": "string",
    "explanation": "string",
}
_NEWEST = 6
_HELD_OUT = 2
_FEWEST = 3


@dataclass(frozen=True)
class Question:
    """One joint to explain: which twin, and which recordings."""

    url: str
    options: tuple[tuple[str, Any], ...]
    model: str
    twin: str
    entries: tuple[Entry, ...]
    key: str


@dataclass(frozen=True)
class Agreement:
    """What the robots of a model say of one axis's twin.

    Parameters
    ----------
    model : str
    axis : int
    asked : int
        Joints that were explained.
    without_mismatch : int
        Of these, where the twin suffices.
    effects : tuple of (str, int)
        Each effect that was found, and in how many joints; the most frequent first.
    """

    model: str
    axis: int
    asked: int
    without_mismatch: int
    effects: tuple[tuple[str, int], ...]


def explanations_of(lake: Lake) -> Results:
    """Return the lake's explanations by this code."""
    return Results(lake, "explain", explain_version(), COLUMNS, part_rows=16)


def explain_all(
    lake: Lake, opened: Opened, progress: Callable[[int, int], None] | None = None
) -> tuple[int, tuple[str, ...], int]:
    """Explain every joint that has new recordings; return how many, the failures, and the known.

    Raises
    ------
    agent.errors.InputError
        `fleet.toml` cannot be used, or a twin that it names.
    """
    results = explanations_of(lake)
    asked = list(questions(lake, roster_of(lake)))
    known = results.keys()
    due = [q for q in asked if q.key not in known]
    failed = []
    try:
        for count, outcome in enumerate(outcomes(opened, explain_one, due), start=1):
            row = outcome.value or _row(outcome.item, failure=outcome.failure)
            if row["failure"]:
                failed.append(f"{row['robot']} axis {row['axis']}: {row['failure']}")
            results.add(row)
            if progress is not None:
                progress(count, len(due))
    finally:
        results.flush()
    return len(due) - len(failed), tuple(sorted(failed)), len(asked) - len(due)


def questions(lake: Lake, roster: Roster) -> Iterator[Question]:
    """Yield what is to be explained: each joint with a twin and three decidable recordings."""
    decidable = {r["key"] for r in estimates_of(lake).rows(("decidable",)) if r["decidable"]}
    by_joint: dict[tuple[str, str, int], list[Entry]] = defaultdict(list)
    for entry in lake.entries()[0]:
        if entry.path in decidable:
            by_joint[entry.joint].append(entry)
    options = tuple(sorted(lake.options.items()))
    digests: dict[str, str] = {}
    for (_, robot, axis), entries in sorted(by_joint.items()):
        model = roster.model_of(robot)
        if model is None or axis not in model.twins or len(entries) < _FEWEST:
            continue
        path = model.twins[axis]
        if path not in digests:
            twin_of(lake, path)  # a twin that cannot be used is said before anything is explained
            digests[path] = hashlib.sha256(lake.get(path)).hexdigest()
        newest = tuple(entries[-_NEWEST:])
        content = "".join([digests[path], *(e.path for e in newest)])
        key = hashlib.sha256(content.encode()).hexdigest()[:32]
        yield Question(lake.url, options, model.name, path, newest, key)


def explain_one(question: Question) -> dict[str, Any]:
    """Explain one joint: the very function of `stribeck explain`; a model's twin is any robot's."""
    from pathlib import Path

    from agent.conclude.comparable import check_recordings
    from agent.conclude.explanation import explained
    from agent.errors import InputError

    lake = Lake(question.url, dict(question.options))
    held = min(_HELD_OUT, len(question.entries) - 2)
    try:
        twin = replace(twin_of(lake, question.twin), robot=question.entries[-1].robot)
        recordings = [lake.recording(e) for e in question.entries]
        learnt, unseen = recordings[:-held], recordings[-held:]
        check_recordings(twin, Path(question.twin), learnt, unseen)
        found = explained(twin, Path(question.twin), learnt, unseen).to_json()
    except InputError as error:
        return _row(question, failure=str(error))
    effects = [f["effect"] for f in found["findings"]]
    return _row(
        question,
        verdict=found["verdict"],
        effects=" ".join(effects),
        explanation=json.dumps(found),
    )


def agreements(rows: Iterable[dict[str, Any]], keys: Sequence[str]) -> tuple[Agreement, ...]:
    """Count, for each model and axis, what its joints' present explanations say.

    Parameters
    ----------
    rows : iterable of dict
        Of `explanations_of`.
    keys : sequence of str
        Of the questions as they are now: older ones do not count.
    """
    present = set(keys)
    grouped: dict[tuple[str, int], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        if row["key"] in present and not row["failure"]:
            grouped[row["model"], row["axis"]].append(row)
    found = []
    for (model, axis), joints in sorted(grouped.items()):
        effects = Counter(e for j in joints for e in set(str(j["effects"]).split()))
        without = sum(j["verdict"] == "no-mismatch" for j in joints)
        found.append(Agreement(model, axis, len(joints), without, tuple(effects.most_common())))
    return tuple(found)


def in_words(agreement: Agreement) -> str:
    """Return what the joints of a model agree on, in one sentence."""
    about = f"{agreement.asked} {agreement.model} axis {agreement.axis}"
    if not agreement.effects:
        return f"{agreement.without_mismatch} of {about} agree with their twin."
    effect, count = agreement.effects[0]
    return f"{count} of {about} show {effect} that the twin lacks."


def _row(question: Question, failure: str = "", **values: Any) -> dict[str, Any]:
    entry = question.entries[-1]
    return {
        "key": question.key,
        "site": entry.site,
        "robot": entry.robot,
        "axis": entry.axis,
        "model": question.model,
        "recordings": len(question.entries),
        "failure": failure,
        **values,
    }
