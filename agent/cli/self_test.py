"""`stribeck self-test`: a known friction rise must be caught by the chain that judges the joint."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer

from agent.cli.exits import BAD_NEWS
from agent.cli.monitor_cycles import cache_folder, cycle_from, cycles_of
from agent.cli.talk import progress_bar, talker
from agent.errors import InputError
from agent.monitor.baseline import features_table
from agent.monitor.change_time import change_time
from agent.monitor.cycle import Cycle
from agent.monitor.detectors import detector as named
from agent.monitor.features import features_of
from agent.monitor.history import JointHistory, histories
from agent.monitor.injection import SHAPES, FrictionRise, added_torque_nm, responses, rise_of
from agent.monitor.injection_replay import Catch, Healthy, SelfTest, self_test
from agent.monitor.series import Detector, State
from agent.monitor.verdict import Track, judge
from agent.record.reading import find, read
from agent.record.recording import Recording

SCHEMA = "stribeck.self-test/1"
_CHECKED = 3
_ANSWERS = (0.9, 1.1)


@dataclass(frozen=True)
class SelfTestRequest:
    """What the command line asks for."""

    rise_percent: float
    within: int
    replays: int
    seed: int
    baseline: int | None
    detector: str
    cache: bool = True


@dataclass(frozen=True)
class AxisTest:
    """One joint's self-test; `answers` are the re-estimated recordings' shares by shape."""

    history: JointHistory
    found: SelfTest
    answers: dict[str, dict[str, float]]
    checked: tuple[str, ...]
    notes: tuple[str, ...]


def run_self_test(patterns: Sequence[str], request: SelfTestRequest, *, as_json: bool) -> None:
    """Inject a rise into each joint's own healthy history, and print whether it is caught.

    Raises
    ------
    agent.errors.InputError
        The recordings or an option cannot be used.
    """
    try:
        detector = named(request.detector)
    except ValueError as error:
        raise InputError(f"--detector: {error}.") from error
    paths = find(patterns)
    with progress_bar("estimating") as show:
        cycles, unreadable = cycles_of(paths, cache_folder() if request.cache else None, show)
    for bad in unreadable:
        talker().print(f"Set aside: {bad.reason}")
    tested = []
    for history in histories(cycles):
        talker().print(f"Replaying {len(history.cycles)} cycles of {history.joint.label} ...")
        tested.append(_axis(history, paths, detector, request))
    if as_json:
        document = {"schema": SCHEMA, "axes": [_axis_json(t) for t in tested]}
        typer.echo(json.dumps(document, indent=2, allow_nan=False))
    else:
        typer.echo("\n\n".join(_axis_text(t) for t in tested))
    if not tested or not all(t.found.passed for t in tested):
        raise typer.Exit(BAD_NEWS)


def _axis(
    history: JointHistory,
    paths: Sequence[Path],
    detector: Detector,
    request: SelfTestRequest,
) -> AxisTest:
    """Test one joint on the cycles since its last event that are held to be healthy."""
    track, notes = judge(history, detector, request.baseline).current, list(history.notes)
    start, stop = (0, 0) if track is None else (track.segment.start, track.segment.stop)
    changed = None if track is None else _changed(track)
    if changed is not None:
        notes.append(
            "the history itself has an alarm: only the cycles before "
            f"{history.cycles[start + changed].name}, where the change may have begun, are taken "
            "for healthy"
        )
        stop = start + changed
    if history.grid is None or stop - start < _CHECKED:
        nothing = SelfTest("there are too few usable cycles", stop - start, 0, 0, request.within, 0)
        return AxisTest(history, nothing, {}, (), tuple(notes))
    cycles, features = history.cycles[start:stop], history.features[start:stop]
    healthy = Healthy(
        np.array([c.started_s for c in cycles]), features_table(cycles, features), history.grid
    )
    chosen = [round(k) for k in np.linspace(0, len(cycles) - 1, _CHECKED)]
    answers = _answers(history, start, chosen, paths, healthy, request)
    notes += _surprises(answers)
    try:
        found = self_test(
            healthy,
            detector,
            stated=request.rise_percent / 100.0,
            within=request.within,
            replays=request.replays,
            seed=request.seed,
            asked=request.baseline,
            gains=answers,
        )
    except ValueError as error:
        raise InputError(f"No self-test can be made of that: {error}.") from error
    return AxisTest(history, found, answers, tuple(cycles[k].name for k in chosen), tuple(notes))


def _changed(track: Track) -> int | None:
    """Return the first cycle of a stretch that may be changed; None where there is no alarm.

    An alarm comes later than the change: the earliest change that the cycles allow counts.
    """
    if track.judgement is None or track.series is None:
        return None
    states = track.judgement.states
    alarm = next((i for i, s in enumerate(states) if s is not State.NO_FAULT), None)
    if alarm is None:
        return None
    found = change_time(track.series)
    return min(alarm, found.cycle_ci95[0]) if found.decidable else alarm


def _answers(
    history: JointHistory,
    start: int,
    chosen: Sequence[int],
    paths: Sequence[Path],
    healthy: Healthy,
    request: SelfTestRequest,
) -> dict[str, dict[str, float]]:
    """Estimate some recordings anew with each rise in their torque."""
    grid = healthy.grid
    before = [history.features[start + k] for k in chosen]
    out = {}
    with progress_bar("injecting") as show:
        for done, shape in enumerate(SHAPES):
            rise = rise_of(shape, healthy.low_mean_nm * request.rise_percent / 100.0, grid)
            after = []
            for k in chosen:
                cycle = cycle_from(_risen(_recording_of(history.cycles[start + k], paths), rise))
                if cycle.curve is None or not grid.covered_by(cycle.curve):
                    continue
                after.append(features_of(cycle.curve, grid))
                show(shape, (done + len(after) / len(chosen)) / len(SHAPES))
            if len(after) == len(before):
                out[shape] = responses(before, after, rise, grid)
    return out


def _recording_of(cycle: Cycle, paths: Sequence[Path]) -> Recording:
    """Return the recording that a cycle was made of; names may repeat, joint and day hardly do."""
    found = [read(path) for path in paths if path.name == cycle.name]
    same = [
        r
        for r in found
        if (r.robot, r.axis) == (cycle.joint.robot, cycle.joint.axis)
        and r.metadata.started_at[:10] == cycle.started_at[:10]
    ]
    return (same or found)[0]


def _risen(recording: Recording, rise: FrictionRise) -> Recording:
    """Return the recording with a rise of friction in its torque."""
    columns = recording.columns
    added = added_torque_nm(
        rise, columns["time_s"], columns.get("velocity_rad_s"), columns.get("position_rad")
    )
    return recording.with_columns({"torque_nm": columns["torque_nm"] + added})


def _surprises(answers: dict[str, dict[str, float]]) -> list[str]:
    """Say where a feature answers to an injected rise otherwise than computed."""
    notes = [
        f"estimated anew, an injected {shape} rise moves {name} by {100.0 * share:.0f} % of what "
        "was computed: the replays count that share"
        for shape, shares in answers.items()
        for name, share in shares.items()
        if not _ANSWERS[0] <= share <= _ANSWERS[1]
    ]
    missing = [shape for shape in SHAPES if shape not in answers]
    if missing:
        notes.append(
            f"a recording with an injected {' or '.join(missing)} rise is not decidable any more; "
            "the replays count the computed answer, unchecked"
        )
    return notes


def _axis_json(tested: AxisTest) -> dict[str, Any]:
    found, alarms = tested.found, tested.found.false_alarms
    return {
        "robot": tested.history.joint.robot,
        "axis": tested.history.joint.axis,
        "decidable": not found.reason,
        "reason": found.reason,
        "passed": found.passed,
        "healthy_cycles": found.cycles,
        "baseline": found.baseline,
        "replays": found.replays,
        "block": found.block,
        "within_cycles": found.within,
        "rises": [_catch_json(c) for c in found.catches],
        "false_alarms": None
        if alarms is None
        else {
            "alarms": alarms.alarms,
            "cycles": alarms.cycles,
            "per_year": alarms.per_year,
            "ci95_per_year": list(alarms.ci95_per_year),
        },
        "checked": {"recordings": list(tested.checked), "answers": tested.answers},
        "notes": list(tested.notes),
    }


def _catch_json(catch: Catch) -> dict[str, Any]:
    return {
        "shape": catch.shape,
        "stated_percent": catch.stated_percent,
        "caught": catch.caught,
        "caught_share": catch.caught_share,
        "caught_share_ci95": list(catch.ci95_share),
        "delay_cycles": _finite(catch.delay_cycles),
        "smallest_percent": _finite(catch.smallest_percent),
        "smallest_ci95_percent": [_finite(end) for end in catch.ci95_percent],
        "smallest_nm": _finite(catch.smallest_nm),
    }


def _axis_text(tested: AxisTest) -> str:
    found = tested.found
    lines = [f"{tested.history.joint.label}:"]
    if found.reason:
        lines.append(f"  not decidable: {found.reason}.")
        return "\n".join([*lines, *(f"  note: {note}" for note in tested.notes)])
    lines.append(
        f"  {found.replays} replays of {found.cycles} healthy cycles (blocks of {found.block}), "
        f"baseline of {found.baseline}; caught within {found.within} cycles:"
    )
    lines += [f"  {line}" for catch in found.catches for line in _catch_lines(catch)]
    if found.false_alarms is not None:
        low, high = found.false_alarms.ci95_per_year
        lines.append(
            f"  without a rise: {found.false_alarms.alarms} alarms in "
            f"{found.false_alarms.cycles} replayed cycles ({low:.2g} to {high:.2g} a year)"
        )
    if tested.answers:
        shares = [s for by_name in tested.answers.values() for s in by_name.values()]
        lines.append(
            f"  checked by estimating {len(tested.checked)} injected recordings anew: features "
            f"answer with {100.0 * min(shares):.0f} to {100.0 * max(shares):.0f} % of what was "
            "computed"
        )
    return "\n".join([*lines, *(f"  note: {note}" for note in tested.notes)])


def _catch_lines(catch: Catch) -> list[str]:
    low, high = catch.ci95_share
    verdict = "caught" if catch.caught else "NOT caught"
    lines = [
        f"- {SHAPES[catch.shape]}:",
        f"    {catch.stated_percent:g} % of low-speed friction: {verdict} in "
        f"{100.0 * catch.caught_share:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
        + (f", after {catch.delay_cycles:.0f} cycles (median)" if catch.caught_share > 0.0 else ""),
    ]
    if not math.isfinite(catch.smallest_percent):
        return [*lines, "    no rise up to twice the friction is caught with 95 %"]
    ends = [f"{e:.1f}" if math.isfinite(e) else "unknown" for e in catch.ci95_percent]
    return [
        *lines,
        f"    smallest caught with 95 %: {catch.smallest_percent:.1f} % ({ends[0]} to {ends[1]}), "
        f"{catch.smallest_nm:.3g} N m",
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
