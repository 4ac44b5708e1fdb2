"""Loose teeth are heard to meet, far below what their torque shows in the compared band."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.choice import choose
from agent.explain.choosing.entry import Asked, entered
from agent.explain.choosing.rivals import with_rivals
from agent.explain.choosing.search import Library
from agent.explain.forms import arm, gap, speed
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
HAIR = Joint(half_gap=0.0003)  # three microradians of the arm
FALL_NM, FALL_RAD_S = 0.1, 15.0


@functools.cache
def recorded(joint: Joint, hardest_rad_s2: float = 150.0, late_s: float = 0.0) -> tuple[Run, ...]:
    return tuple(
        record(joint, seed, hardest_rad_s2=hardest_rad_s2, torque_late_s=late_s)
        for seed in (1, 2, 3, 4)
    )


def scene_of(runs: tuple[Run, ...]) -> Scene:
    table = tabulate(TWIN, runs)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    return Scene(table, theta, np.where(table.used, left, 0.0))


@pytest.mark.parametrize("half_gap", [0.0003, 0.001])
@pytest.mark.parametrize("gravity", [0.5, 0.0])
@pytest.mark.parametrize("late_s", [0.0, 0.005])
def test_blows_are_heard_with_the_shares_of_the_arm(
    half_gap: float, gravity: float, late_s: float
) -> None:
    joint = Joint(half_gap=half_gap, gravity_sin=gravity, gravity_cos=0.4 * gravity)
    blows = scene_of(recorded(joint, late_s=late_s)).blows
    assert blows is not None
    # Half of the inertia and three tenths of the friction; without a weight only their ratio shows.
    assert blows.friction_share / blows.arm_share == pytest.approx(0.6, rel=0.35)
    if gravity:
        assert blows.arm_share == pytest.approx(0.5, rel=0.25)
    ringing = blows.ringing
    before, after = (ringing.rms_rad_s[side] for side in (ringing.at_s < 0.0, ringing.at_s > 0.0))
    assert after.max() > 1.5 * before.max()


@pytest.mark.parametrize(
    "joint",
    [
        Joint(),
        Joint(stiffness=60.0, damping=0.05),
        Joint(stiffness=150.0, damping=0.02, gravity_sin=0.0, gravity_cos=0.0),
        Joint(motor_reach=0.08, arm_coulomb=0.02),
    ],
    ids=["tight", "soft", "ringing", "creeping"],
)
@pytest.mark.parametrize("hardest_rad_s2", [150.0, 1500.0])
def test_nothing_is_heard_of_teeth_without_play(joint: Joint, hardest_rad_s2: float) -> None:
    # However hard it is driven: jerk rings a soft gear, too.
    assert scene_of(recorded(joint, hardest_rad_s2)).blows is None


def test_nothing_is_heard_in_samples_too_slow_for_it() -> None:
    slow = tuple(
        Run.from_columns(
            {name: values[::4] for name, values in zip(COLUMNS, columns_of(run), strict=True)},
            GEAR,
            name=run.name,
        )
        for run in recorded(HAIR)
    )
    assert scene_of(slow).blows is None


COLUMNS = ("time_s", "position_rad", "velocity_rad_s", "torque_nm")


def columns_of(run: Run) -> list[np.ndarray[tuple[int], np.dtype[np.float64]]]:
    return [np.asarray(getattr(run.signals, name)) for name in COLUMNS]


def falling(run: Run) -> Run:
    """Return a recording whose joint has friction that falls with speed, too."""
    velocity, torque = run.signals.velocity_rad_s, run.signals.torque_nm
    assert velocity is not None
    fall = FALL_NM * np.sign(velocity) * np.exp(-np.abs(velocity) / FALL_RAD_S)
    return replace(run, signals=replace(run.signals, torque_nm=torque + fall))


@pytest.mark.parametrize(("half_gap", "named"), [(0.0003, True), (0.0, False)])
def test_a_gap_that_is_heard_needs_no_size_in_the_compared_band(
    half_gap: float, named: bool
) -> None:
    runs = tuple(falling(run) for run in recorded(Joint(half_gap=half_gap)))
    scene = scene_of(runs)
    library = Library.of(
        scene, weigh(scene.table, scene.residual_nm), (*arm.FORMS, *gap.FORMS, *speed.FORMS)
    )
    choice = choose(library, rivals=False)
    effects = [term.scored.form.effect for term in choice.terms]
    assert effects[0] == "stribeck"
    assert ("backlash" in effects) == named
    if named:
        # Far less than the two percent of the mismatch that a name takes where nothing is heard.
        others = [t.candidate for t in choice.terms if t.scored.form.effect != "backlash"]
        gain = float(library.errors(others).sum() - choice.full.sum())
        assert 0.0 < gain < 0.02 * float(choice.plain.sum())


@pytest.mark.parametrize(
    ("half_gap", "expected"), [(0.0, "joint-flexibility"), (0.001, "backlash")]
)
def test_a_soft_gear_that_rings_is_no_gap_of_no_width(half_gap: float, expected: str) -> None:
    """It was told as backlash for certain: three of eight springs that swing near the band's end.

    Every acceleration that begins turns the load there, and rings; and a gap of next to no width in
    front of a spring removes most of what the spring does.
    """
    stiffness = Joint().arm_inertia * (2.0 * np.pi * 28.0) ** 2
    joint = Joint(half_gap=half_gap, stiffness=stiffness, damping=0.04)
    scene = scene_of(recorded(joint))
    vars(scene)["blows"] = scene_of(recorded(HAIR)).blows  # a soft gear's own ringing is enough
    library = Library.of(scene, weigh(scene.table, scene.residual_nm), (*arm.FORMS, *gap.FORMS))
    ranked = library.rank([])
    best = ranked[0]
    if half_gap == 0.0:
        point = (1e-4, 0.5, 0.3, best.candidate.point[0], 0.2, 0.0, 0.0, 0.07, 0.0)
        narrow = library.candidate(gap.FORMS[0], point)
        ranked.append(Scored(narrow, np.ones(1), 0.0, library.errors([narrow])))
    plain = library.errors([])
    named = entered(library, plain, [], plain, ranked, best, Asked.of(library, plain, []))
    assert named is not None
    assert named[1].form.effect == expected
    term = with_rivals(library, [], ranked, best, 0.0, {})
    effects = {term.scored.form.effect, *(rival.scored.form.effect for rival in term.rivals)}
    assert ("backlash" in effects) == bool(half_gap)
