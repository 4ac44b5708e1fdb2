"""The twins of a fleet's models questioned on every robot: where they are wrong in the same way.

For each joint whose model has a twin for that axis, the newest recordings are explained, the newest
third held out. What comes out is one row a joint; `agreement` counts the findings of a model.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from agent.explain.answer.names import NAMES
from agent.fleet.cluster import Opened
from agent.fleet.entry import Entry, entry_of, joint_of
from agent.fleet.estimates import estimates_of
from agent.fleet.lake import Lake
from agent.fleet.results import Results
from agent.fleet.roster import Roster, twin_of
from agent.fleet.version import explain_version
from agent.fleet.work import Done, carry_out

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
_OWN_NUMBERS = frozenset({"wrong-number", "inertia-error", "torque-constant-error"})
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

    @property
    def month(self) -> str:
        """Return the month of the newest recording."""
        return self.entries[-1].month

    @property
    def name(self) -> str:
        """Return the joint in words."""
        return f"{self.entries[-1].robot} axis {self.entries[-1].axis}"

    def refused(self, failure: str) -> dict[str, Any]:
        """Return the row of a joint that could not be explained."""
        return _row(self, failure=failure)


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
        Each effect that was found, and in how many joints: what the twin lacks first, the most
        frequent first, then what it has under another number.
    """

    model: str
    axis: int
    asked: int
    without_mismatch: int
    effects: tuple[tuple[str, int], ...]


def explanations_of(lake: Lake) -> Results:
    """Return the lake's explanations by this code."""
    return Results(lake, "explain", explain_version(), COLUMNS, part_rows=4)  # dear ones


def explain_all(
    lake: Lake,
    opened: Opened,
    asked: Sequence[Question],
    progress: Callable[[int, int], None] | None = None,
) -> Done:
    """Put those of the `questions` that this code has not answered yet."""
    results = explanations_of(lake)
    months = sorted({question.month for question in asked})
    known = {key for month in months for key in results.keys(month).to_pylist()}
    due = [q for q in asked if q.key not in known]

    def show(done: int) -> None:
        if progress is not None:
            progress(done, len(due))

    return carry_out(opened, explain_one, due, results, show)


def answers(lake: Lake, asked: Iterable[Question]) -> Iterator[dict[str, Any]]:
    """Yield the rows of these questions, as far as they were put."""
    wanted = {q.key: q.month for q in asked}
    columns = [name for name in COLUMNS if name != "explanation"]
    rows = explanations_of(lake).rows(columns, sorted(set(wanted.values())))
    return (row for row in rows if row["key"] in wanted)


def questions(lake: Lake, roster: Roster) -> Iterator[Question]:
    """Yield what is to be explained: each joint with a twin and three decidable recordings.

    Raises
    ------
    agent.errors.InputError
        A twin that the roster names cannot be used.
    """
    options = tuple(sorted(lake.options.items()))
    digests: dict[str, str] = {}
    for paths in _newest(lake, roster):
        entries = tuple(e for e in (entry_of(p, 0) for p in paths) if e is not None)
        robot, axis = entries[-1].robot, entries[-1].axis
        model = roster.model_of(robot)
        if model is None or axis not in model.twins or len(entries) < _FEWEST:
            continue
        path = model.twins[axis]
        if path not in digests:
            twin_of(lake, path)  # a twin that cannot be used is said before anything is explained
            digests[path] = hashlib.sha256(lake.get(path)).hexdigest()
        content = "".join([digests[path], *paths])
        key = hashlib.sha256(content.encode()).hexdigest()[:32]
        yield Question(lake.url, options, model.name, path, entries, key)


def _newest(lake: Lake, roster: Roster) -> Iterator[tuple[str, ...]]:
    """Yield the newest decidable recordings of each joint of a robot whose model has twins."""
    found: dict[str, deque[str] | None] = {}
    estimates = estimates_of(lake)
    for month in estimates.months():
        rows = estimates.table(month, ("decidable",))
        for path in map(str, rows.filter(rows.column("decidable")).column(0).to_pylist()):
            joint = joint_of(path)
            if joint not in found:
                entry = entry_of(path, 0)
                model = None if entry is None else roster.model_of(entry.robot)
                found[joint] = deque(maxlen=_NEWEST) if model is not None and model.twins else None
            newest = found[joint]
            if newest is not None:
                newest.append(path)
    for _, newest in sorted(found.items(), key=lambda pair: pair[0]):
        if newest:
            yield tuple(newest)


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


def agreements(rows: Iterable[dict[str, Any]]) -> tuple[Agreement, ...]:
    """Count, for each model and axis, what its joints' explanations say.

    Parameters
    ----------
    rows : iterable of dict
        From `answers`: one a joint.
    """
    grouped: dict[tuple[str, int], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        if not row["failure"]:
            grouped[row["model"], row["axis"]].append(row)
    found = []
    for (model, axis), joints in sorted(grouped.items()):
        effects = Counter(e for j in joints for e in set(str(j["effects"]).split()))
        without = sum(j["verdict"] == "no-mismatch" for j in joints)
        ranked = sorted(effects.items(), key=lambda e: (e[0] in _OWN_NUMBERS, -e[1], e[0]))
        found.append(Agreement(model, axis, len(joints), without, tuple(ranked)))
    return tuple(found)


def in_words(agreement: Agreement) -> str:
    """Return what the joints of a model agree on, in one sentence."""
    about = f"{agreement.asked} {agreement.model} axis {agreement.axis}"
    if not agreement.effects:
        return f"{agreement.without_mismatch} of {about} agree with their twin."
    effect, count = agreement.effects[0]
    lacks = "" if effect in _OWN_NUMBERS else ", which the twin lacks"
    calm = agreement.without_mismatch
    rest = f"; {calm} agree{'s' * (calm == 1)} with the twin" if calm else ""
    return f"{count} of {about} show {NAMES[effect]} ({effect}){lacks}{rest}."


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
