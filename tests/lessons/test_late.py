"""A torque far later than the motion: what swings by the angle is found in step with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.explain import explain
from agent.explain.findings import findings_of
from agent.explain.numbers.anew import chosen_anew
from agent.explain.numbers.in_step import begun_late
from agent.explain.numbers.short_stroke import without_gravity
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate, without_edges
from agent.explain.study import study
from agent.identify.result import Floats
from agent.physics.reported import Delay, Smoothing
from agent.physics.twin import Effect, Twin
from tests.science.explain_joint import (
    GEAR_RATIO,
    NOISE_NM,
    RATE_HZ,
    TWIN,
    Conditions,
    library_of,
    nothing,
    record,
    stair,
)
from trajectories import SetPoints

LATE_S, ORDER, RIPPLE_NM = 0.024, 2.0, 0.08


def recorded(scale: float, seed: int, twin: Twin = TWIN) -> Run:
    """Return a recording of a joint with a ripple, and a torque that is `LATE_S` later."""
    trajectory = stair([scale * v for v in (4.0, 12.0, 25.0, 45.0)])
    time = np.arange(int(trajectory.duration_s * RATE_HZ)) / RATE_HZ
    then = trajectory.sample(np.maximum(time - LATE_S, 0.0))

    def missing(now: SetPoints, at: Conditions) -> Floats:
        del at
        ripple = RIPPLE_NM * np.cos(ORDER * then.position_rad)
        return np.asarray(_plain_nm(then, twin) + ripple - _plain_nm(now))

    return record(trajectory, missing, Conditions(), seed, name=f"run-{seed}")


def _plain_nm(points: SetPoints, twin: Twin = TWIN) -> Floats:
    direction = np.sign(points.velocity_rad_s)
    return twin.predict_torque(
        points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2, direction
    )


def test_a_ripple_beside_a_late_torque_is_one_ripple() -> None:
    """At 45 rad/s the wave is more than two radians late, at 4 rad/s a fifth of one."""
    library, choice = chosen_anew(library_of([recorded(1.0 + 0.1 * k, k) for k in range(4)]))
    named = {term.scored.form.effect for term in choice.terms}
    assert named == {"measurement-delay", "torque-ripple"}
    assert len(choice.terms) == len(named)
    assert library.scene.late_s == pytest.approx(LATE_S, rel=0.01)
    left = library.residual(choice.candidates) / library.weighing.weight
    assert float(np.sqrt(np.mean(left**2))) < 1.1 * NOISE_NM


def test_a_late_torque_turns_round_later() -> None:
    table = library_of([recorded(1.0, 1)]).scene.table
    late = without_edges(table, table.creep_rad_s, LATE_S)
    turned = np.flatnonzero(np.diff(np.sign(table.full["velocity_rad_s"])))
    row = np.searchsorted(table.rows["time_s"], table.full["time_s"][turned] + LATE_S)
    assert not late.used[np.minimum(row, late.used.shape[0] - 1)].any()
    assert np.count_nonzero(late.used) < np.count_nonzero(table.used)


@pytest.mark.parametrize("gravity_nm", [0.0, 0.3])
def test_a_delay_that_a_choice_lacks_is_begun_with(gravity_nm: float) -> None:
    """Slow motion has it, whatever fast motion was taken for; gravity may stay as it was given."""
    twin = replace(TWIN, gravity_sin_nm=gravity_nm)
    runs = [recorded(1.0 + 0.1 * k, k, twin) for k in range(4)]
    table = without_gravity(tabulate(twin, runs))
    delta, left = refit(table)
    theta = np.array([getattr(twin, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)
    forms = dict.fromkeys(c.form for c in library_of(runs).candidates)
    library = Library.of(scene, weigh(table, left), tuple(forms))
    plain = library.errors([])
    begun = begun_late(library, Choice((), plain, plain))
    assert begun is not None
    late, choice = begun
    assert {t.scored.form.effect for t in choice.terms} == {"measurement-delay", "torque-ripple"}
    assert late.scene.late_s == pytest.approx(LATE_S, rel=0.01)
    assert begun_late(late, choice) is None  # it has one


def test_a_joint_on_time_begins_with_no_delay() -> None:
    library = library_of([record(stair((4, 12, 25, 45)), nothing, Conditions(), 1)])
    plain = library.errors([])
    assert begun_late(library, Choice((), plain, plain)) is None


def shaken(late_s: float) -> Run:
    """Return a recording of a joint that swings at 30 Hz while it moves, all of its torque late."""
    trajectory, rng = stair((4, 12, 25, 45)), np.random.default_rng(1)
    time = np.arange(int(trajectory.duration_s * RATE_HZ)) / RATE_HZ
    swing = 2.0 * np.pi * 30.0

    def motion(at: Floats) -> SetPoints:
        points = trajectory.sample(np.maximum(at, 0.0))
        on = 0.5 * (1.0 + np.sin(0.5 * at))  # it grows and fades
        return points._replace(
            position_rad=points.position_rad - 0.8 * on * np.cos(swing * at) / swing,
            velocity_rad_s=points.velocity_rad_s + 0.8 * on * np.sin(swing * at),
            acceleration_rad_s2=points.acceleration_rad_s2 + 0.8 * on * swing * np.cos(swing * at),
        )

    now = motion(time)
    columns = {
        "time_s": time,
        "position_rad": now.position_rad,
        "velocity_rad_s": now.velocity_rad_s,
        "torque_nm": _plain_nm(motion(time - late_s)) + NOISE_NM * rng.standard_normal(time.size),
    }
    return Run.from_columns(columns, GEAR_RATIO, name="shaken")


def test_a_late_torque_is_that_of_the_motion_as_recorded() -> None:
    """The smooth motion would pass the band's filter twice, and leave far more of a swing."""
    late_s = 0.006
    run = shaken(late_s)
    late = replace(TWIN, effects=(Effect("measurement-delay", {"torque_delay_s": late_s}),))
    on_time, in_step = (tabulate(twin, [run], 40.0) for twin in (TWIN, late))
    left, before = (np.std(t.target_nm[t.sliding]) for t in (in_step, on_time))
    assert left < 0.1 * before


@pytest.mark.parametrize(("position_s", "late"), [(0.0, "velocity"), (0.006, "torque")])
def test_the_channel_that_is_late_is_named(position_s: float, late: str) -> None:
    """A filtered velocity beside a position in step had been "the motion", late as a whole."""
    trajectory = stair((4.0, 12.0, 25.0, 45.0))
    run = record(trajectory, nothing, Conditions(), 0)
    time = run.signals.time_s
    then = trajectory.sample(np.maximum(time - 0.006, 0.0))
    where = trajectory.sample(np.maximum(time - position_s, 0.0))
    signals = replace(
        run.signals, velocity_rad_s=then.velocity_rad_s, position_rad=where.position_rad
    )
    found = study(TWIN, tabulate(TWIN, [replace(run, signals=signals)]))
    (finding,) = findings_of(found)
    assert finding.effect == "measurement-delay"
    sign = 1.0 if late == "velocity" else -1.0
    assert finding.parameters[f"{late}_delay_s"].value == pytest.approx(sign * 0.006, abs=0.0006)
    said = "the velocity is reported" if late == "velocity" else "the motion is reported"
    assert said in finding.sentence


@pytest.mark.parametrize("lag_s", [0.006, 0.012])
def test_a_torque_behind_a_low_pass_is_no_soft_gear(lag_s: float) -> None:
    """As a plain delay it left an arm that swings at 5 Hz, with a probability of one."""
    trajectory = stair((4.0, 12.0, 25.0, 45.0))
    runs = []
    for seed in range(3):
        run = record(trajectory, nothing, Conditions(started_s=100.0 * seed), seed)
        time = run.signals.time_s
        late = Delay(0.003).reported(time, Smoothing(lag_s).reported(time, run.signals.torque_nm))
        kept = np.isfinite(late)
        signals = replace(run.signals, torque_nm=np.where(kept, late, 0.0), valid=kept)
        runs.append(replace(run, signals=signals))
    answer = explain(TWIN, runs[:2], runs[2:])
    assert [finding.effect for finding in answer.findings] == ["measurement-delay"]
    assert answer.holdout is not None
    assert answer.holdout.floor_ratio < 1.1
    found = answer.findings[0].parameters
    assert found["torque_lag_s"].value == pytest.approx(lag_s, rel=0.05)
    assert found["torque_delay_s"].value == pytest.approx(0.003, abs=0.0003)
    assert answer.twin is not None
    assert explain(answer.twin, runs[:2], runs[2:]).verdict == "no-mismatch"


def test_a_noisy_motion_makes_no_low_pass_of_a_delay() -> None:
    """Two fifths of the delay were one: what is smooth has less of an inertia's noise."""
    trajectory, late_s = stair((2.0, 5.0, 8.0, 12.0, 16.0, 20.0)), 0.012
    rng = np.random.default_rng(5)
    runs = []
    for seed in range(3):
        run = record(trajectory, nothing, Conditions(started_s=100.0 * seed), seed)
        late = Delay(late_s).reported(run.signals.time_s, run.signals.torque_nm)
        kept, velocity = np.isfinite(late), run.signals.velocity_rad_s
        assert velocity is not None
        signals = replace(
            run.signals,
            torque_nm=np.where(kept, late, 0.0),
            velocity_rad_s=velocity + 0.02 * rng.standard_normal(velocity.shape),
            position_rad=None,
            valid=kept,
        )
        runs.append(replace(run, signals=signals))
    answer = explain(TWIN, runs[:2], runs[2:])
    assert [finding.effect for finding in answer.findings] == ["measurement-delay"]
    found = answer.findings[0].parameters
    assert "torque_lag_s" not in found
    assert found["torque_delay_s"].value == pytest.approx(late_s, abs=0.0004)
