"""`stribeck self-test`: a known friction rise must be caught by the chain that judges the joint."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import typer

from agent.cli.history.self_test_text import AxisTest, axis_json, axis_text
from agent.cli.terminal.exits import BAD_NEWS
from agent.cli.terminal.talk import progress_bar, talker
from agent.conclude.cycles import cache_folder, cycle_from, cycles_of, nothing_usable
from agent.errors import InputError, UsageError
from agent.monitor.change.change_time import change_time
from agent.monitor.detection.detectors import detector as named
from agent.monitor.detection.series import Detector, State
from agent.monitor.history.cycle import Cycle
from agent.monitor.history.features import features_of
from agent.monitor.history.history import JointHistory, histories
from agent.monitor.history.table import features_table
from agent.monitor.self_test.injection import (
    SHAPES,
    FrictionRise,
    added_torque_nm,
    responses,
    rise_of,
)
from agent.monitor.self_test.replay import self_test
from agent.monitor.self_test.result import Healthy, SelfTest
from agent.monitor.verdict.verdict import Track, judge
from agent.record.reading import find, read
from agent.record.recording import Recording

SCHEMA = "stribeck.self-test/1"
_CHECKED = 3
_LARGEST_PERCENT = 200.0
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


def run_self_test(patterns: Sequence[str], request: SelfTestRequest, *, as_json: bool) -> None:
    """Inject a rise into each joint's own healthy history, and print whether it is caught.

    Exit code 1 where one is not; where nothing is decidable, nothing was found.

    Raises
    ------
    agent.errors.InputError
        The recordings or an option cannot be used.
    """
    try:
        detector = named(request.detector)
    except ValueError as error:
        raise UsageError(f"--detector: {error}.") from error
    if not 0.0 < request.rise_percent <= _LARGEST_PERCENT:
        raise UsageError(
            f"--rise: expected a number above 0 and up to {_LARGEST_PERCENT:g}, got "
            f"{request.rise_percent:g}."
        )
    paths = find(patterns)
    with progress_bar("estimating") as show:
        cycles, unreadable = cycles_of(paths, cache_folder() if request.cache else None, show)
    if not cycles:
        raise nothing_usable(unreadable)
    for bad in unreadable:
        talker().print(f"Set aside: {bad.reason}")
    tested = []
    for history in histories(cycles):
        talker().print(f"Replaying {len(history.cycles)} cycles of {history.joint.label} ...")
        tested.append(_axis(history, paths, detector, request))
    if as_json:
        document = {"schema": SCHEMA, "axes": [axis_json(t) for t in tested]}
        typer.echo(json.dumps(document, indent=2, allow_nan=False))
    else:
        typer.echo("\n\n".join(axis_text(t) for t in tested))
    if not all(t.found.passed or t.found.reason for t in tested):
        raise typer.Exit(BAD_NEWS)


def _axis(
    history: JointHistory,
    paths: Sequence[Path],
    detector: Detector,
    request: SelfTestRequest,
) -> AxisTest:
    """Test one joint on the cycles since its last event that are held to be healthy."""
    finding = judge(history, detector, request.baseline)
    track, notes = finding.current, list(history.notes)
    start, stop = (0, 0) if track is None else (track.segment.start, track.segment.stop)
    if finding.since_first is not None:
        nothing = SelfTest(
            "friction has been rising since the first cycle, so that no cycle is "
            "known to be healthy",
            cycles=0,
            baseline=0,
            replays=0,
            within=request.within,
            block=0,
        )
        return AxisTest(history, nothing, {}, (), tuple(notes))
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
