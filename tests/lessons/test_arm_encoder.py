"""The arm's own encoder: a skew is no spring, and what it does not show is not named."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from agent.explain.experiment.menu import menu
from agent.explain.experiment.motion import elsewhere
from agent.explain.explain import explain
from agent.explain.forms import gap
from agent.explain.forms.arm_encoder import Twist, refuted, twist_of
from agent.explain.forms.library import FORMS
from agent.explain.forms.seen_arm import SEEN, shown_gear
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
STIFF = Joint(stiffness=4000.0, damping=0.8)
SOFT = Joint(stiffness=25.0, damping=0.03)
LOOSE = Joint(stiffness=4000.0, damping=0.8, half_gap=0.004)


def seen_in(*runs: Run) -> tuple[Scene, Twist]:
    table = tabulate(TWIN, runs)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0))
    twist = twist_of(scene)
    assert twist is not None
    return scene, twist


@cache
def seen(joint: Joint, arm_late_s: float) -> tuple[Scene, Twist]:
    return seen_in(*(record(joint, k, duration_s=20.0, arm_late_s=arm_late_s) for k in (1, 2)))


@pytest.mark.parametrize("arm_late_s", [-0.003, 0.0, 0.004])
def test_a_skew_between_the_encoders_is_measured_and_is_no_spring(arm_late_s: float) -> None:
    scene, twist = seen(STIFF, arm_late_s)
    low, high = twist.skew_s
    assert low - 1e-4 <= arm_late_s <= high + 1e-4
    assert "joint-flexibility" in refuted(scene, twist)


@pytest.mark.parametrize("arm_late_s", [0.0, 0.004])
def test_a_soft_gear_is_seen_beside_a_skew(arm_late_s: float) -> None:
    scene, twist = seen(SOFT, arm_late_s)
    assert np.mean(twist.swing_s2) == pytest.approx(SOFT.arm_inertia / SOFT.stiffness, rel=0.3)
    assert "joint-flexibility" not in refuted(scene, twist)


def test_lost_motion_is_seen_only_where_there_is_some() -> None:
    assert "backlash" in refuted(*seen(STIFF, 0.0))
    scene, twist = seen(LOOSE, 0.0)
    assert twist.lost_rad > 0.5 * LOOSE.half_gap
    assert "backlash" not in refuted(scene, twist)


@pytest.mark.parametrize("half_gap", [0.0, 0.001, 0.004])
def test_a_spring_that_the_arms_encoder_shows_is_no_gap(half_gap: float) -> None:
    """It stayed tied with one, and an encoder on the arm was advised, which was there."""
    rubs_at_the_motor = SOFT._replace(motor_coulomb=0.5, arm_coulomb=0.0)
    why = refuted(*seen(rubs_at_the_motor._replace(half_gap=half_gap), 0.0))
    assert ("backlash" in why) == (half_gap == 0.0)


def test_a_gap_that_the_arms_encoder_shows_is_looked_for_as_wide() -> None:
    worn = LOOSE._replace(half_gap=0.05)
    scene, _ = seen(worn, 0.0)
    shown = shown_gear(scene)
    (form,) = gap.FORMS
    assert shown is not None
    assert shown.size in {point[0] for point in form.grid(scene)}


@pytest.mark.parametrize(
    ("joint", "effect", "size"),
    [
        (LOOSE, "backlash", LOOSE.half_gap),
        (LOOSE._replace(half_gap=0.02, stiffness=25.0, damping=0.03), "backlash", 0.02),
        (LOOSE._replace(half_gap=0.01, film=0.1), "backlash", 0.01),
        (SOFT, "joint-flexibility", SOFT.stiffness),
        (SOFT._replace(arm_coulomb=0.35, motor_coulomb=0.15), "joint-flexibility", 25.0),
        (SOFT._replace(stiffness=10.0, cubic=4000.0), "joint-flexibility", None),
        (SOFT._replace(stiffness=5.0, cubic=2e4), "joint-flexibility", None),
        (SOFT._replace(held=0.3), "joint-flexibility", None),
        (STIFF, None, None),
    ],
)
def test_a_gap_is_told_from_a_spring_that_stiffens_or_holds(
    joint: Joint, effect: str | None, size: float | None
) -> None:
    shown = shown_gear(seen(joint, 0.0)[0])
    assert (shown and shown.effect) == effect
    if shown is not None and size is not None:
        assert shown.size == pytest.approx(size, rel=0.06)


@pytest.mark.parametrize(
    ("joint", "effect", "told"),
    [
        (LOOSE._replace(half_gap=0.02), "backlash", "half_gap_rad"),
        (SOFT._replace(held=0.3), "joint-flexibility", "stiffness_nm_per_rad"),
    ],
    ids=["an arm that bounces", "a spring whose law nobody has"],
)
def test_an_arm_that_is_seen_needs_no_simulation(joint: Joint, effect: str, told: str) -> None:
    """Without the encoder the first is half explained, and the second not at all."""
    runs = [record(joint, k, duration_s=20.0, arm_late_s=0.001) for k in (1, 2, 3)]
    found = explain(TWIN, runs[:2], runs[2:])
    (finding,) = found.findings
    assert (found.verdict, finding.effect) == ("explained", effect)
    assert found.extended.rmse_nm < 1.1 * found.floor.value_nm
    assert "The arm's encoder shows" in finding.sentence
    assert finding.parameters["arm_inertia_kg_m2"].value == pytest.approx(
        joint.arm_inertia, rel=0.1
    )
    assert finding.parameters[told].value > 0.0
    extended = found.twin
    assert extended is not None
    assert explain(extended, runs[:2], runs[2:]).verdict == "no-mismatch"


def test_on_a_motion_that_is_only_proposed_nobody_has_seen_the_arm() -> None:
    """An experiment to tell what stands beside the spring ended in a fault of our own."""
    scene, _ = seen(SOFT, 0.0)
    form = next(form for form in FORMS if form.name == SEEN)
    assert np.any(form.columns(scene, (0.0,)))
    proposed = elsewhere(scene, [proposal.parts for proposal in menu(scene, None)[:1]])
    np.testing.assert_array_equal(form.columns(proposed, (0.0,)), 0.0)


def test_recordings_without_the_encoder_leave_what_the_others_show() -> None:
    first, second = (record(LOOSE, k, duration_s=20.0, arm_late_s=0.0) for k in (1, 2))
    bare = {name: x for name, x in first.columns.items() if name != "position_arm_rad"}
    _, alone = seen_in(second)
    scene, beside = seen_in(replace(first, columns=bare), second)
    assert beside.lost_rad == pytest.approx(alone.lost_rad, rel=0.05)
    assert "backlash" not in refuted(scene, beside)


@pytest.mark.parametrize(
    ("joint", "other"),
    [
        (STIFF._replace(wobble=6e-4), "resolver-error"),
        (STIFF._replace(misread=6e-4), "kinematic-error"),
    ],
)
def test_a_wave_that_shakes_the_arm_alone_is_the_gears(joint: Joint, other: str) -> None:
    """A misread angle shakes the motor with it; the two had stayed tied with the encoder, too."""
    out = refuted(*seen(joint, 0.001))
    assert {"kinematic-error", "resolver-error"} & out.keys() == {other}
