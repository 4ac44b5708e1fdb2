"""The next experiment: it goes where tied laws differ, and once driven it breaks the tie."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from agent.explain.answer.result import NextExperiment
from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.rivals import Rival
from agent.explain.choosing.search import Library
from agent.explain.experiment.driven import Driven
from agent.explain.experiment.menu import menu
from agent.explain.experiment.motion import elsewhere
from agent.explain.experiment.proposal import DECISIVE, next_experiments
from agent.explain.forms import speed as forms_speed
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.physics.effects.motion import path_rad
from tests.science.explain_joint import (
    NOISE_NM,
    RATE_HZ,
    Conditions,
    Missing,
    chosen,
    library_of,
    record,
    stair,
)
from trajectories import AxisLimits, SetPoints, TorqueModel, Trajectory, check

WARM_UP = (Conditions(25.0, 0.0), Conditions(33.0, 1500.0))
FAST = (8.0, 20.0, 50.0, 80.0)
ALL_SPEEDS = (2.0, 5.0, 12.0, 30.0, 70.0)
TIGHT = AxisLimits(-58.0, 58.0, 65.0, 120.0, 4e3, 10.0, 150.0, 0.1)
LIMITS = AxisLimits(-200.0, 200.0, 150.0, 400.0, 2e4, 10.0, 400.0, 0.1)


def stribeck(points: SetPoints, at: Conditions) -> Floats:
    """A plateau that ends above the slowest speed driven: below it nothing was seen."""
    del at
    speed = np.abs(points.velocity_rad_s)
    return np.asarray(0.05 * np.sign(points.velocity_rad_s) * np.exp(-((speed / 20.0) ** 2)))


def steep(points: SetPoints, at: Conditions) -> Floats:
    del at
    speed = np.abs(points.velocity_rad_s)
    return np.asarray(0.25 * np.sign(points.velocity_rad_s) * np.exp(-((speed / 5.0) ** 1.3)))


def ripple(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.asarray(0.05 * np.cos(3.0 * points.position_rad + 0.3))


def viscosity(points: SetPoints, at: Conditions) -> Floats:
    factor = np.exp(-(at.gearbox_degc - 29.0) / 15.0) - 1.0
    return np.asarray(0.004 * points.velocity_rad_s * factor)


def wear(points: SetPoints, at: Conditions) -> Floats:
    return np.asarray(np.sign(points.velocity_rad_s) * 0.1 * at.started_s / 1500.0)


def offset(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.full(points.velocity_rad_s.shape[0], 0.1)


def recorded(missing: Missing, trajectory: Trajectory) -> list[Run]:
    return [record(trajectory, missing, at, seed) for seed, at in enumerate(WARM_UP)]


def asked(
    runs: Sequence[Run], limits: AxisLimits | None = None
) -> tuple[Library, Choice, tuple[NextExperiment, ...]]:
    """Return what is proposed for the first term."""
    library, choice = chosen(runs)
    floor_nm = NOISE_NM * math.sqrt(2.0 * library.scene.table.cutoff_hz / RATE_HZ)
    return library, choice, next_experiments(library, choice.terms, 0, floor_nm, limits)


@cache
def wave_at_one_speed() -> tuple[tuple[Run, ...], Choice, tuple[NextExperiment, ...]]:
    runs = tuple(recorded(ripple, stair((14.0,))))
    _, choice, proposed = asked(runs)
    return runs, choice, proposed


def rivals(choice: Choice) -> set[str]:
    return {rival.scored.form.effect for rival in choice.terms[0].rivals}


def driven(
    experiment: NextExperiment, missing: Missing, conditions: Sequence[Conditions]
) -> list[Run]:
    """Return what is recorded when an experiment is driven as often as it asks for."""
    trajectory = Trajectory.from_json(experiment.trajectory)
    times = round(experiment.seconds / trajectory.duration_s / len(conditions))
    return [
        record(trajectory, missing, at, 20 + 10 * k + n)
        for k in range(max(times, 1))
        for n, at in enumerate(conditions)
    ]


def test_slower_speeds_tell_stribeck_from_friction_that_bends() -> None:
    runs = recorded(stribeck, stair(FAST))
    _, choice, proposed = asked(runs)
    assert choice.terms[0].scored.form.effect == "stribeck"
    assert rivals(choice) == {"viscous-nonlinear"}
    stairs = [e for e in proposed if (e.trajectory or {}).get("name") == "stair-paired"]
    best = Trajectory.from_json(stairs[0].trajectory)
    slowest = min(abs(w.velocity_rad_s) for w in best.steady_windows())
    assert slowest <= 0.26 * FAST[0]
    assert stairs[0].tells_apart == ("stribeck", "viscous-nonlinear")
    assert "slowest so far" in stairs[0].sentence
    more = driven(stairs[0], stribeck, [Conditions(33.0, 1700.0)])
    _, after, _ = asked([*runs, *more])
    assert after.terms[0].scored.form.effect == "stribeck"
    assert not rivals(after)


def test_other_speeds_tell_ripple_from_a_wobbling_gear() -> None:
    runs, choice, proposed = wave_at_one_speed()
    assert "kinematic-error" in rivals(choice)
    best = proposed[0]
    assert {"torque-ripple", "kinematic-error"} <= set(best.tells_apart)
    more = driven(best, ripple, [Conditions(33.0, 1600.0)])
    _, after, _ = asked([*runs, *more])
    assert after.terms[0].scored.form.effect == "torque-ripple"
    assert after.terms[0].probability > choice.terms[0].probability


@pytest.mark.parametrize(
    ("missing", "effect"),
    [(viscosity, "temperature-dependent-friction"), (wear, "friction-drift")],
)
def test_heating_and_cooling_tell_temperature_from_time(missing: Missing, effect: str) -> None:
    runs = recorded(missing, stair(ALL_SPEEDS))
    _, choice, proposed = asked(runs)
    both = {choice.terms[0].scored.form.effect} | rivals(choice)
    assert both == {"temperature-dependent-friction", "friction-drift"}
    best = proposed[0]
    assert "while heating and while cooling" in best.sentence
    assert all(each.set_up for each in proposed)
    more = driven(best, missing, [Conditions(33.0, 3000.0), Conditions(25.0, 4500.0)])
    _, after, _ = asked([*runs, *more])
    assert after.terms[0].scored.form.effect == effect
    assert not rivals(after)


@cache
def torque_beside() -> tuple[Library, Choice, tuple[NextExperiment, ...]]:
    return asked(recorded(offset, stair(ALL_SPEEDS)))


def test_no_motion_tells_an_offset_from_one_sided_friction_and_the_set_up_is_said() -> None:
    _, choice, proposed = torque_beside()
    assert choice.terms[0].scored.form.effect in ("torque-offset", "direction-asymmetry")
    last = proposed[-1]
    assert set(last.tells_apart) == {"torque-offset", "direction-asymmetry"}
    assert last.trajectory is None
    assert math.isnan(last.seconds)
    assert last.gain_per_s == 0.0
    assert "brake closed" in last.set_up
    assert last.to_json()["seconds"] is None


def test_nor_where_the_friction_has_a_viscous_part_that_may_not_be_there() -> None:
    """Twenty-two minutes of a stair stood below "no run of this axis tells them apart"."""
    library, choice, _ = torque_beside()
    term, forms = choice.terms[0], {form.name: form for form in forms_speed.FORMS}

    def scored(name: str, *numbers: float) -> Scored:
        at = library.candidate(forms[name], ())
        return replace(term.scored, candidate=at, coefficients=np.array(numbers))

    constant = Rival(scored("constant", 0.05), 0.4, 0.99)
    tied = replace(term, scored=scored("Coulomb and viscous", 0.1, 1e-4), rivals=(constant,))
    (advice,) = next_experiments(library, (tied,), 0, NOISE_NM)
    assert advice.trajectory is None
    assert "brake closed" in advice.set_up


def test_nothing_is_proposed_where_nothing_is_tied() -> None:
    _, choice, proposed = asked(recorded(steep, stair((8.0, 12.0, 20.0, 32.0, 50.0, 80.0))))
    assert choice.terms[0].scored.form.effect == "stribeck"
    assert not rivals(choice)
    assert proposed == ()


def test_proposals_are_ranked_and_hold_what_they_say() -> None:
    _, _, proposed = wave_at_one_speed()
    gains = [e.gain_per_s for e in proposed if e.trajectory is not None]
    assert gains == sorted(gains, reverse=True)
    for one in proposed:
        if one.trajectory is None:
            continue
        duration_s = Trajectory.from_json(one.trajectory).duration_s
        times = one.seconds / duration_s
        assert times == pytest.approx(round(times), abs=1e-9)
        assert f"{math.ceil(one.seconds)} s" in one.sentence
        if not one.set_up and len(one.tells_apart) == 3:  # nothing to wait for, and every rival
            assert one.gain_per_s * one.seconds >= DECISIVE


def test_nothing_leaves_what_was_driven_unless_the_limits_are_known() -> None:
    library = library_of(recorded(ripple, stair(ALL_SPEEDS)))
    seen = Driven.of(library.scene)
    assert seen.slowest_rad_s == pytest.approx(2.0, rel=0.05)
    trajectories = [part.trajectory for p in menu(library.scene) for part in p.parts]
    assert len(trajectories) >= 12
    for trajectory in trajectories:
        points = trajectory.sample(np.linspace(0.0, trajectory.duration_s, 20_000))
        assert points.position_rad.min() >= -60.0 - 1e-6
        assert points.position_rad.max() <= 60.0 + 1e-6
        assert np.abs(points.velocity_rad_s).max() <= 70.0
        assert np.abs(points.acceleration_rad_s2).max() <= 200.0
    wider = menu(library.scene, LIMITS)
    assert all(not check(part.trajectory, LIMITS) for p in wider for part in p.parts)
    assert any("times as long" in p.what for p in wider)
    assert any("shifted" in p.what for p in wider)
    tight = menu(library.scene, TIGHT)
    assert len(tight) >= 8
    # What it needs to move is what the joint that was recorded needs, rounded up.
    inertia, viscous, coulomb = (1.1 * float(x) for x in library.scene.theta[:3])
    needed = TorqueModel(inertia, coulomb, viscous)
    assert all(not check(part.trajectory, TIGHT, needed) for p in tight for part in p.parts)


def test_a_motion_elsewhere_keeps_the_recordings_references() -> None:
    library = library_of(recorded(viscosity, stair(ALL_SPEEDS)))
    home = replace(library.scene, held=lambda scene: 0.2 * scene.arm_rad)  # as a cable does
    pair = next(p for p in menu(home) if len(p.parts) == 2)
    scene = elsewhere(home, [pair.parts])
    cable_nm = scene.weight_nm - replace(scene, held=None).weight_nm
    assert cable_nm == pytest.approx(0.2 * scene.arm_rad)
    degc = scene.table.full["gearbox_temperature_degc"]
    warm, cold = (degc[piece.full] for piece in scene.table.pieces)
    assert warm == pytest.approx(33.0, abs=1e-6)
    assert cold == pytest.approx(25.0, abs=1e-6)
    assert scene.mean("gearbox_temperature_degc") == home.mean("gearbox_temperature_degc")
    assert scene.fastest == home.fastest
    assert scene.runs().min() == len(home.table.runs)
    elapsed = scene.full("elapsed_s")
    assert elapsed[0] == np.nanmin(home.full("elapsed_s"))
    assert elapsed[1:].min() > np.nanmax(home.full("elapsed_s"))


def warming(run: Run, k_per_rad: float) -> Run:
    """Return a run whose gearbox warms as the motor turns."""
    velocity = run.signals.velocity_rad_s
    assert velocity is not None
    degc = run.columns["gearbox_temperature_degc"]
    risen = degc + k_per_rad * path_rad(run.signals.time_s, velocity)
    return replace(run, columns={**run.columns, "gearbox_temperature_degc": risen})


def test_every_experiment_begins_with_the_joint_as_the_recordings_left_it() -> None:
    """Only one is driven: what stands before it in the menu has neither used nor warmed it.

    A joint whose friction falls as it warms was told to make one reversal of 7 s: by what the
    menu's other cycles would have turned before it, a running-in had gone on meanwhile.
    """
    runs = [warming(run, 0.003) for run in recorded(viscosity, stair(ALL_SPEEDS))]
    home = library_of(runs).scene
    plain, pair = (next(p for p in menu(home) if len(p.parts) == n) for n in (1, 2))
    scene = elsewhere(home, [plain.parts, pair.parts])
    first, second, third = (
        {
            name: scene.full(name)[piece.full]
            for name in ("operating_s", "turned_rad", "gearbox_temperature_degc")
        }
        for piece in scene.table.pieces
    )
    for name in ("operating_s", "turned_rad"):
        assert first[name][0] == second[name][0] == pytest.approx(home.full(name).max())
        assert third[name][0] == pytest.approx(second[name][-1])
    path = first["turned_rad"] - first["turned_rad"][0]
    degc = first["gearbox_temperature_degc"]
    assert degc - degc[0] == pytest.approx(0.003 * path, rel=0.01, abs=1e-4)


def test_recordings_without_position_are_advised_in_words_only() -> None:
    runs = []
    for run in recorded(viscosity, stair(ALL_SPEEDS)):
        columns = {
            "time_s": run.signals.time_s,
            "velocity_rad_s": run.signals.velocity_rad_s,
            "torque_nm": run.signals.torque_nm,
            **run.columns,
        }
        runs.append(
            Run.from_columns(
                {name: values for name, values in columns.items() if values is not None},
                run.signals.gear_ratio,
                name=run.name,
                started_s=run.started_s,
            )
        )
    _, _, proposed = asked(runs)
    assert proposed
    assert all(one.trajectory is None for one in proposed)
    assert all(one.sentence for one in proposed)
