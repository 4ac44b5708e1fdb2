"""Rows that stand alone, and moments that are none of the joint's, hide nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.result import Explanation, Verdict
from agent.explain.explain import explain
from agent.explain.location.moments import Moments, in_beginnings, in_moments, without
from agent.explain.rows.glitches import without_glitches
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.explain.written_down import nothing_decided
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints


def _no_effect(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.zeros_like(points.position_rad)


@pytest.fixture(scope="module")
def run() -> Run:
    return record(stair((6.0, 20.0, 50.0), 200.0), _no_effect, Conditions(), 0)


def _with_torque(run: Run, rows: slice, extra_nm: float) -> Run:
    torque = run.signals.torque_nm.copy()
    torque[rows] += extra_nm
    return replace(run, signals=replace(run.signals, name="hit.csv", torque_nm=torque))


def test_a_row_that_stands_alone_is_left_out_and_a_step_is_not(run: Run) -> None:
    """One sample had left friction that differs by direction without a name."""
    position = run.signals.position_rad
    assert position is not None
    assert position[-1] != 0.0
    zeroed = replace(run.signals, position_rad=np.append(position[:-1], 0.0))
    hit = _with_torque(run, slice(3000, 3001), 30.0)
    cases: list[tuple[Run, list[int]]] = [
        (run, []),
        (hit, [3000]),
        (_with_torque(run, slice(3000, 9000), 5.0), []),
        (replace(run, signals=zeroed), [position.shape[0] - 1]),
    ]
    for given, rows in cases:
        (kept,), said = without_glitches([given])
        assert np.flatnonzero(~kept.signals.valid).tolist() == rows
        assert bool(said) is bool(rows)


@pytest.mark.parametrize("felt", [False, True])
def test_many_single_rows_are_left_out_but_for_kicks_that_moved_the_motor(
    run: Run, felt: bool
) -> None:
    """Lost bits of a bus were what is usual, and noise three times as loud as it is."""
    signals = run.signals
    assert signals.velocity_rad_s is not None
    torque, velocity = signals.torque_nm.copy(), signals.velocity_rad_s.copy()
    rows = np.arange(977, torque.shape[0] - 1, 599)
    torque[rows] += 5.0
    if felt:
        velocity[rows] += 3.0
    hit = replace(run, signals=replace(signals, torque_nm=torque, velocity_rad_s=velocity))
    (kept,), said = without_glitches([hit])
    alone = np.flatnonzero(~kept.signals.valid).tolist()
    assert alone == ([] if felt else rows.tolist())
    assert bool(said) is not felt


def test_a_recording_cut_in_motion_ends_as_it_moves(run: Run) -> None:
    """The last row was the one before once more: a soft gear was 55 % of Stribeck friction."""
    signals = run.signals
    position, velocity = signals.position_rad, signals.velocity_rad_s
    assert position is not None
    assert velocity is not None
    cut = int(np.argmax(np.abs(velocity) > 40.0)) + 200
    fair = replace(
        signals,
        time_s=signals.time_s[:cut],
        valid=signals.valid[:cut],
        position_rad=position[:cut],
        velocity_rad_s=velocity[:cut],
        torque_nm=signals.torque_nm[:cut],
    )
    repeated = position[:cut].copy()
    repeated[-1] = repeated[-2]
    unfinished = velocity[:cut].copy()
    unfinished[-1] = 0.0
    cases = (
        (fair, 0),
        (replace(fair, velocity_rad_s=None, position_rad=repeated), 1),
        (replace(fair, velocity_rad_s=unfinished), 1),
    )
    for given, count in cases:
        (kept,), said = without_glitches([replace(run, signals=given)])
        assert int(np.count_nonzero(~kept.signals.valid[-3:])) == count
        assert len(said) == count


def test_a_moment_that_holds_most_of_what_is_left_is_told_and_left_out(run: Run) -> None:
    hit = _with_torque(run, slice(3000, 3020), 2.0)
    table = tabulate(TWIN, [run, hit])
    rows = np.flatnonzero(table.used)
    clean = tabulate(TWIN, [run, run])
    assert in_moments(clean, np.flatnonzero(clean.used), clean.target_nm[clean.used], 5e-3) is None
    found = in_moments(table, rows, table.target_nm[rows], 5e-3)
    assert found is not None
    assert {name for _, name, _ in found.at} == {"hit.csv"}
    at_s = hit.signals.time_s[3000]
    assert all(abs(start_s - at_s) < 0.3 for _, _, start_s in found.at)
    rest = np.where(np.arange(table.run.size) % 700 < 60, 1.0, 0.0)  # a spell, again and again
    assert in_moments(table, rows, rest[rows], 5e-3) is None
    left_out = without([run, hit], found)
    assert left_out[0] is run
    assert not left_out[1].signals.valid[3000:3020].any()


@pytest.mark.parametrize(("without_it", "taken"), [("no-mismatch", True), ("unexplained", False)])
def test_an_answer_without_moments_is_taken_where_it_settles_more(
    run: Run, monkeypatch: pytest.MonkeyPatch, without_it: Verdict, taken: bool
) -> None:
    """A transient in one of three recordings had left a right twin unexplained."""
    moments = Moments(((1, "hit.csv", 12.0),), 0.9)
    asked: list[int] = []

    def once(_twin: object, runs: list[Run], *_: object) -> tuple[Explanation, Moments | None]:
        asked.append(sum(int(r.signals.valid.sum()) for r in runs))
        answer = nothing_decided("off", (), ())
        return (
            (answer, moments)
            if len(asked) == 1
            else (replace(answer, verdict=without_it, reasons=()), None)
        )

    monkeypatch.setattr("agent.explain.explain.asked_once", once)
    answer = explain(TWIN, [run, run])
    assert asked[1] < asked[0]
    assert (answer.verdict == "no-mismatch") is taken
    assert any("at 12.0 s of hit.csv" in reason for reason in answer.reasons) is taken


def test_moments_hide_behind_moments(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two glitches the louder one was left out, and the other hid what both had hidden."""
    unsettled = nothing_decided("off", (), ())
    loud, quiet = (Moments(((1, name, 12.0),), 0.9) for name in ("loud.csv", "quiet.csv"))
    settled = replace(unsettled, verdict="no-mismatch", reasons=())
    answers = iter([(unsettled, loud), (unsettled, quiet), (settled, None)])
    monkeypatch.setattr("agent.explain.explain.asked_once", lambda *_: next(answers))
    answer = explain(TWIN, [run, run])
    assert answer.verdict == "no-mismatch"
    first, second = answer.reasons
    assert "loud.csv" in first
    assert "quiet.csv" in second


def test_recordings_that_begin_in_motion_may_hide_an_arm_by_how_they_do(run: Run) -> None:
    """A soft gear was not found where a jump of the motor was the first that was recorded."""
    assert in_beginnings(tabulate(TWIN, [run], 30.0)) is None
    speed = run.signals.velocity_rad_s
    assert speed is not None
    moving = np.flatnonzero(np.abs(speed) > 5.0)[100]
    signals = run.signals
    kept = {
        name: getattr(signals, name)[moving:] - (signals.time_s[moving] if "time" in name else 0.0)
        for name in ("time_s", "position_rad", "velocity_rad_s", "torque_nm")
    }
    cut = Run.from_columns(kept, signals.gear_ratio, name="cut", started_s=0.0)
    found = in_beginnings(tabulate(TWIN, [run, cut], 30.0))
    assert found is not None
    assert [name for _, name, _ in found.at] == ["cut"]
    assert not found.comes_back
    _, later = without([run, cut], found)
    left_out = ~later.signals.valid & cut.signals.valid
    assert float(later.signals.time_s[left_out].max()) == pytest.approx(1.0, abs=0.1)
    assert "begin in motion" in found.said(apart=True)
