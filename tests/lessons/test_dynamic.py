"""Dynamic candidates of an explanation against joints that were integrated apart from them."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agent.explain.choosing.candidate import Scored, basis_of
from agent.explain.choosing.choice import choose
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.valleys import deepest
from agent.explain.findings import findings_of
from agent.explain.forms import arm as forms_arm
from agent.explain.forms import gap as forms_gap
from agent.explain.forms import reversal as forms_reversal
from agent.explain.forms import signal as forms_signal
from agent.explain.forms import stiffening as forms_stiffening
from agent.explain.forms.crossings import likely_gaps
from agent.explain.forms.form import Form
from agent.explain.forms.hidden_arm import HiddenArm
from agent.explain.forms.library import judgeable
from agent.explain.forms.twin_law import best_entry
from agent.explain.numbers.model import predicted
from agent.explain.numbers.uneven import compared
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.saturation import saturation_evidence
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.explain.rows.twin_effects import effects_nm
from agent.explain.study import study
from agent.physics.twin import Effect, Twin, TwinError
from tests.science.explain_plant import GEAR, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
GAP = Joint(half_gap=0.004)
OILED = Joint(half_gap=0.1, film=0.12)
SOFT = Joint(stiffness=25.0, damping=0.03)
HARMONIC = SOFT._replace(cubic=1.2e4)  # twice as stiff at a twist of 0.046 rad
RUBBING = Joint(stiffness=14.0, damping=0.02, arm_coulomb=0.03, motor_coulomb=0.45)
HOLDING = Joint(
    stiffness=8.0, damping=0.01, arm_coulomb=0.0, motor_coulomb=0.5, held=0.2, held_over=0.04
)
CREEPING = Joint(motor_reach=0.08)
CARRIED = (*forms_arm.FORMS, *forms_gap.FORMS)
ARMS = (*CARRIED, *forms_stiffening.FORMS)


def scene_of(runs: list[Run]) -> Scene:
    table = tabulate(TWIN, runs)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    return Scene(table, theta, np.where(table.used, left, 0.0))


@functools.cache
def seen(joint: Joint, torque_late_s: float = 0.0, gravity: bool = True) -> Scene:
    if not gravity:
        joint = joint._replace(gravity_sin=0.0, gravity_cos=0.0)
    return scene_of([record(joint, seed, torque_late_s=torque_late_s) for seed in (1, 2)])


@functools.cache
def library_of(scene_key: tuple[Joint, float, bool]) -> Library:
    scene = seen(*scene_key)
    return Library.of(scene, weigh(scene.table, scene.residual_nm), judgeable(scene.table)[0])


def best(effect: str, library: Library) -> Scored:
    return next(s for s in library.rank([]) if s.form.effect == effect)


@pytest.mark.parametrize(
    ("effect", "joint", "late_s"),
    [
        ("backlash", GAP, 0.0),
        ("joint-flexibility", SOFT, 0.0),
        ("presliding-hysteresis", CREEPING, 0.0),
        ("measurement-delay", Joint(), 0.0053),
    ],
)
def test_names_what_was_concealed(effect: str, joint: Joint, late_s: float) -> None:
    choice = choose(library_of((joint, late_s, True)))
    assert choice.terms[0].scored.form.effect == effect


@pytest.mark.parametrize(
    ("joint", "form", "stiffening"),
    [
        (HARMONIC, "one stiffening spring, and an arm with friction", 1.2e4 / 25.0),
        (SOFT, "one spring, and an arm with friction", 0.0),
    ],
)
def test_a_gear_stiffens_behind_a_rubbing_arm_only_where_it_does(
    joint: Joint, form: str, stiffening: float
) -> None:
    """A harmonic drive, as most are: its spring stiffens, and the arm has friction of its own."""
    found = choose(library_of((joint, 0.0, True))).terms[0].scored
    assert found.form.name == form
    values = found.values()
    own_hz = math.sqrt(joint.stiffness / joint.arm_inertia) / (2.0 * math.pi)
    assert values["antiresonance_hz"] == pytest.approx(own_hz, rel=0.05)
    assert values.get("stiffening_per_rad2", 0.0) == pytest.approx(stiffening, rel=0.25)


@pytest.mark.parametrize(
    ("joint", "form"),
    [
        (RUBBING, "one spring, and an arm with friction"),
        (HOLDING, "one spring with inner friction"),
    ],
)
def test_little_friction_of_the_arm_and_what_its_gear_holds_leave_noise(
    joint: Joint, form: str
) -> None:
    """A search from everyday friction had two thirds of this arm, and left 2.6 times the noise.

    And a spring alone left 1.4 times the noise of a gear that holds a part of its twist.
    """
    found = study(TWIN, tabulate(TWIN, [record(joint, seed) for seed in (1, 2)]))
    first = next(f for f in findings_of(found) if f.effect == "joint-flexibility")
    assert first.form == form
    assert first.parameters["arm_inertia_kg_m2"].value == pytest.approx(0.003, rel=0.1)
    left_nm = float(np.sqrt(np.mean(found.left.residual_nm**2)))
    assert left_nm < 1.25 * found.floor.value_nm


def test_a_gap_before_a_soft_spring_is_a_gap_and_no_spring_that_stiffens() -> None:
    """Together they are a spring that stiffens, which had the name, or teeth 27 times as hard."""
    joint = Joint(
        stiffness=25.0, damping=0.03, half_gap=0.015, arm_coulomb=0.05, motor_coulomb=0.45
    )
    found = study(TWIN, tabulate(TWIN, [record(joint, seed) for seed in (1, 2)]))
    (gap,) = findings_of(found)
    assert gap.effect == "backlash"
    assert gap.parameters["half_gap_rad"].value == pytest.approx(joint.half_gap, rel=0.2)
    assert gap.parameters["stiffness_nm_per_rad"].value == pytest.approx(joint.stiffness, rel=0.2)
    assert gap.parameters["arm_inertia_kg_m2"].value == pytest.approx(joint.arm_inertia, rel=0.2)


def test_a_tight_stiff_joint_is_not_said_to_have_play() -> None:
    named = {t.scored.form.effect for t in choose(library_of((Joint(), 0.0, True))).terms}
    assert "backlash" not in named


def test_finds_the_gap_and_what_part_of_the_joint_is_behind_it() -> None:
    library = library_of((GAP, 0.0, True))
    found = best("backlash", library)
    values = found.values()
    assert values["half_gap_rad"] == pytest.approx(0.004, rel=0.15)
    assert values["arm_share"] == pytest.approx(0.5, rel=0.05)
    assert values["arm_friction_share"] == pytest.approx(0.15 / 0.5, rel=0.15)
    # Grids lead to a gap once; when a model is settled, what was found is not lost again.
    bare = replace(library, candidates=tuple(c for c in library.candidates if c.form != found.form))
    again = bare.rank([], refined=False, known=[found.candidate])
    assert [s.candidate for s in again if s.form == found.form] == [found.candidate]


def test_a_gap_is_found_from_the_valley_of_another_and_its_interval_holds_it() -> None:
    """Half as wide, with a soft contact and a film: a search that only goes downhill stays there.

    By the squared error's curvature the gap would be known to a percent, whatever it is.
    """
    library = library_of((GAP, 0.0, True))
    found = best("backlash", library)
    wrong = library.candidate(found.form, (0.002, 0.52, 0.28, 20.0, 0.9, 15.0, 0.0, 0.07, 0.0))
    downhill = library.deeper(wrong, basis_of(library.base), library.target)
    assert downhill.point[0] < 0.0037
    stuck = replace(found, candidate=downhill, blocks=library.errors([downhill]))
    deep = deepest(library, [], stuck, far=True)
    assert deep.candidate.point[0] == pytest.approx(0.004, rel=0.05)
    interval = compared(library, [Term(deep, 0.0)], 0, 0).ci95
    assert interval is not None
    assert interval[0] < 0.004 < interval[1]
    assert interval[1] - interval[0] < 0.001


@pytest.mark.parametrize("gravity", [True, False])
def test_a_gap_shows_by_when_it_would_be_crossed(gravity: bool) -> None:
    followed = likely_gaps(seen(GAP, 0.0, gravity), 1e-4, 0.2, 3)
    # Oil that brakes the arm is nearly as likely in place of a part of its dry friction.
    half_gap, inertia, friction, *_ = next(gap for gap in followed if not gap[4])
    assert friction / inertia == pytest.approx(0.3 / 0.5, rel=0.2)
    if gravity:  # without a weight only their ratio shows
        assert inertia == pytest.approx(0.5, rel=0.1)
        assert half_gap == pytest.approx(0.004, rel=0.5)


def test_a_gap_shows_in_a_narrow_band_behind_an_arm_that_oil_brakes_as_well() -> None:
    """Teeth are apart for less than one of its rows; a dry arm would part from them elsewhere."""
    friction = {"motor_coulomb": 0.14, "arm_coulomb": 0.06, "viscous": 0.007, "arm_viscous": 0.003}
    oily = Joint(half_gap=0.02, **friction)
    table = tabulate(TWIN, [record(oily, seed, noise_nm=0.003) for seed in (1, 2)], 12.0)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0))
    half_gap, inertia, dry, _, oil = likely_gaps(scene, 1e-3, 0.2, 1)[0]
    assert inertia == pytest.approx(0.5, rel=0.1)
    assert dry == pytest.approx(0.3, rel=0.15)
    assert oil == pytest.approx(0.3, rel=0.15)
    assert half_gap == pytest.approx(0.02, rel=0.5)


def test_a_gap_that_is_lost_in_the_twist_of_its_own_contact_is_a_spring() -> None:
    """A gear of 90 Hz without play had been named a clearance of 0.8 mrad at the motor."""
    (gap,) = forms_gap.FORMS
    values = dict(zip(gap.nonlinear, (1e-5, 0.3, 0.0, 20.0, 0.2, 0.0, 0.0, 0.07, 0.0), strict=True))
    with pytest.raises(TwinError, match="lost in a contact"):
        gap.to_twin(seen(SOFT), values)


def test_finds_a_gap_whose_arm_is_dragged_along_while_the_teeth_are_apart() -> None:
    scene = seen(OILED, 0.0, False)
    library = Library.of(scene, weigh(scene.table, scene.residual_nm), CARRIED)
    choice = choose(library, rivals=False)
    # A joint has one arm: no spring carries it again beside the gap.
    assert [t.scored.form.effect for t in choice.terms] == ["backlash"]
    values = choice.terms[0].scored.values()
    assert values["half_gap_rad"] == pytest.approx(0.1, rel=0.15)
    assert values["film_per_s"] == pytest.approx(0.12 / 0.003, rel=0.3)


def test_an_arm_that_the_twin_carries_is_not_carried_again() -> None:
    spring = {"arm_inertia_kg_m2": 0.003, "stiffness_nm_per_rad": 430.0}
    forms, reasons = judgeable(
        seen(GAP).table, replace(TWIN, effects=(Effect("joint-flexibility", spring),))
    )
    assert not {"backlash", "joint-flexibility"} & {form.effect for form in forms}
    assert "carries the arm already" in reasons["backlash"]
    assert "the twin has it already" in reasons["joint-flexibility"]


def test_no_gap_is_likely_where_nothing_is_left() -> None:
    scene = seen(GAP)
    still = Scene(scene.table, scene.theta, np.zeros_like(scene.residual_nm))
    assert likely_gaps(still, 1e-4, 0.2, 2) == ()


def test_finds_the_spring() -> None:
    values = best("joint-flexibility", library_of((SOFT, 0.0, True))).values()
    locked_hz = math.sqrt(SOFT.stiffness / SOFT.arm_inertia) / (2.0 * math.pi)
    assert values["antiresonance_hz"] == pytest.approx(locked_hz, rel=0.15)


def test_finds_how_far_friction_yields() -> None:
    library = library_of((CREEPING, 0.0, True))
    values = {s.form.name: s.values() for s in library.rank([])}
    assert values["Dahl"]["reach_rad"] == pytest.approx(0.08, rel=0.05)
    # Half of the way up after the travel at which Dahl's curve is: ln 2 of its reach.
    slip = values["Maxwell slip"]
    half = slip["sliding_travel_rad"] * (1.0 - 0.5 ** (1.0 / slip["shape_exponent"]))
    assert half == pytest.approx(0.08 * math.log(2.0), rel=0.5)


@pytest.mark.parametrize("name", ["Dahl", "Maxwell slip"])
def test_the_twin_predicts_the_presliding_that_was_found(name: str) -> None:
    scene = seen(CREEPING)
    library = library_of((CREEPING, 0.0, True))
    found = next(s for s in library.rank([]) if s.form.name == name)
    (entry,) = found.form.to_twin(scene, found.values())
    # Close to any nearby entry of the same law, and better than one that is far off.
    far = {key: 20.0 * value for key, value in entry.items()}
    assert best_entry(scene, "presliding-hysteresis", [far, entry]) == (entry,)


@pytest.mark.parametrize("late_s", [0.0053, -0.0053])
def test_a_delay_is_found_to_a_fraction_of_a_sample_with_its_sign(late_s: float) -> None:
    found = best("measurement-delay", library_of((Joint(), late_s, True)))
    assert found.values()["torque_delay_s"] == pytest.approx(late_s, abs=0.0004)
    (entry,) = found.form.to_twin(seen(Joint(), late_s), found.values())
    assert math.copysign(1.0, entry["torque_delay_s"]) == math.copysign(1.0, late_s)


def test_a_law_that_does_not_help_is_left_out_of_the_twin() -> None:
    scene = seen(Joint())
    wild = {"arm_inertia_kg_m2": 0.003, "stiffness_nm_per_rad": 0.5, "damping_nm_s_per_rad": 0.0}
    assert best_entry(scene, "joint-flexibility", [wild]) == ()


@pytest.mark.parametrize(("effect", "joint"), [("backlash", GAP), ("joint-flexibility", SOFT)])
def test_the_twin_predicts_the_hidden_arm_that_was_found(effect: str, joint: Joint) -> None:
    scene = seen(joint)
    found = best(effect, library_of((joint, 0.0, True)))
    (entry,) = found.form.to_twin(scene, found.values())
    assert removed_by_twin(scene, effect, entry) > 0.6 * found.screened


def removed_by_twin(scene: Scene, effect: str, entry: Mapping[str, Any]) -> float:
    """Return which share of the squared residual the twin's own law removes."""
    table = scene.table
    inertia, viscous, coulomb, sine, cosine = (float(x) for x in scene.theta)
    twin = Twin("plant", 1, GEAR, inertia, coulomb, viscous, sine, cosine, (Effect(effect, entry),))
    extra = table.band(effects_nm(twin, table.runs, table.pieces, table.full))
    left = refit(table, extra)[1][table.used]
    return 1.0 - float(np.sum(left**2) / np.sum(scene.residual_nm[table.used] ** 2))


@pytest.mark.parametrize("driven_hz", [4.0, 12.0, 33.0])
def test_an_arm_on_a_spring_answers_a_sine_as_theory_says(driven_hz: float) -> None:
    scene = seen(Joint())
    time = scene.full("time_s")
    omega, own, damping = 2.0 * math.pi * driven_hz, 2.0 * math.pi * 20.0, 0.15
    swung = {**scene.table.full, "velocity_raw_rad_s": np.cos(omega * time)}
    alone = Scene(
        replace(scene.table, full=swung), np.append(scene.theta[:3], (0.0, 0.0)), scene.residual_nm
    )
    extra = HiddenArm(20.0, damping).extra_rad_s2(alone)
    # Ja aa = k x + d dx/dt with x = q - qa, for a motor that moves as it likes.
    carried = (own**2 + 2j * damping * own * omega) / (
        own**2 - omega**2 + 2j * damping * own * omega
    )
    expected = np.real((carried - 1.0) * 1j * omega * np.exp(1j * omega * time))
    settled = slice(2000, 12000)  # the first swing has died down, and the first stretch lasts
    wrong = np.std(extra[settled] - expected[settled])
    assert wrong < 0.04 * np.std(expected[settled])


def test_an_arm_that_creeps_on_a_stiff_spring_stays_finite() -> None:
    scene = seen(GAP)
    creeping = HiddenArm(150.0, 2.0, 300.0, 0.07)
    assert np.max(np.abs(creeping.extra_rad_s2(scene))) < 1e5


def test_a_search_for_an_arm_stays_within_what_gears_are() -> None:
    scene = seen(GAP)
    for form in ARMS:
        assert form.limits is not None
        limits = form.limits(scene)
        for point in form.grid(scene):
            inside = [low <= x <= high for x, (low, high) in zip(point, limits, strict=True)]
            assert all(inside), (form.name, point)


@pytest.mark.parametrize(
    ("form", "friction"), list(zip(forms_stiffening.FORMS, ((), (0.5, 0.01)), strict=True))
)
def test_a_stiffening_spring_is_the_twins_and_hangs_on_its_weight(
    form: Form, friction: tuple[float, ...]
) -> None:
    """A linear spring of the same swing is another column, and so is one without the weight.

    `friction` is the arm's share of the joint's, and how far it gives way, rad.
    """
    scene = seen(Joint())
    inertia, hertz, damping, cube = 0.6 * float(scene.theta[0]), 9.0, 0.05, 40.0
    stiffness = inertia * (2.0 * math.pi * hertz) ** 2
    loaded = replace(scene, theta=np.append(scene.theta[:3], (0.0, 0.1 * stiffness)))
    entry = {
        "arm_inertia_kg_m2": inertia,
        "stiffness_nm_per_rad": stiffness,
        "damping_nm_s_per_rad": 2.0 * damping * inertia * 2.0 * math.pi * hertz,
        "cubic_stiffness_nm_per_rad3": cube * stiffness,
    }
    own, viscous, coulomb, sine, cosine = (float(x) for x in loaded.theta)
    if friction:
        share, reach_rad = friction
        entry |= {"arm_coulomb_nm": 0.6 * share * coulomb, "arm_yield_rad": reach_rad}
    laws = (Effect("joint-flexibility", entry),)
    twin = Twin("plant", 1, GEAR, own, coulomb, viscous, sine, cosine, laws)
    table = loaded.table
    said = table.band(effects_nm(twin, table.runs, table.pieces, table.full))[table.used]

    def missed(stiffening: float, share: float) -> float:
        column = form.columns(loaded, (hertz, damping, stiffening, share, *friction))[:, 0]
        return float(np.std(inertia * table.band(column)[table.used] - said) / np.std(said))

    assert missed(cube, 0.6) < 0.05
    assert missed(1e-9, 0.6) > 0.3
    assert missed(cube, 60.0) > 0.1


def test_gravity_only_shifts_the_twist_of_a_gear_without_a_gap() -> None:
    scene = seen(Joint())
    light = HiddenArm(25.0, 0.1, 40.0, 0.01, 0.0, 1.0).extra_rad_s2(scene)
    heavy = HiddenArm(25.0, 0.1, 40.0, 0.01, 0.0, 0.3).extra_rad_s2(scene)
    moved = scene.table.band(heavy - light)[scene.table.used]
    assert np.std(moved) < 0.02 * np.std(scene.table.band(light)[scene.table.used])


def test_a_heavy_arm_holds_a_wide_gap_shut() -> None:
    scene = seen(Joint())
    weightless = Scene(scene.table, np.append(scene.theta[:3], (0.0, 0.0)), scene.residual_nm)
    pressed = Scene(scene.table, np.append(scene.theta[:3], (0.0, 5.0)), scene.residual_nm)
    loose = HiddenArm(40.0, 0.3, 0.0, 1.0, 0.2, 0.5)
    shut = HiddenArm(40.0, 0.3, 0.0, 1.0, 1e-9, 0.5)  # no gap, driven as one is

    def apart(of: Scene) -> float:
        return float(np.mean(np.abs(loose.extra_rad_s2(of) - shut.extra_rad_s2(of)) > 5.0))

    # It hangs over to the other side where the arm passes a quarter turn; and everywhere a little
    # lower, where it weighs a little less or more.
    assert apart(pressed) < 0.05
    assert apart(weightless) > 0.2


@pytest.mark.parametrize("name", ["gap", "one spring, and an arm with friction"])
def test_an_arm_keeps_its_friction_when_the_twins_numbers_move(name: str) -> None:
    """A law found beside it takes Coulomb friction over: the arm behind the gap does not notice."""
    scene = seen(GAP)
    form = next(form for form in ARMS if form.name == name)
    point = form.grid(scene)[0]
    now = replace(scene, theta=scene.theta * (1.0, 0.2, 0.8, 1.0, 1.0))
    carried = form.columns(now, form.carried_over(scene, now, point))
    before = form.columns(scene, point)
    assert np.std(form.columns(now, point) - before) > 1e-3 * np.std(before)
    assert carried == pytest.approx(before, abs=1e-9 * float(np.std(before)))


def test_every_form_moves_when_each_of_its_numbers_does() -> None:
    scene = seen(GAP)
    for form in (*forms_reversal.FORMS, *forms_signal.FORMS, *ARMS):
        points = list(form.grid(scene))
        for index in range(len(form.nonlinear)):
            values = sorted({p[index] for p in points})
            if len(values) < 2:
                continue
            pairs = [(p, (*p[:index], values[-1], *p[index + 1 :])) for p in points[-3:]]
            pairs += [(p, (*p[:index], values[0], *p[index + 1 :])) for p in points[-3:]]
            moved = [form.columns(scene, p) - form.columns(scene, q) for p, q in pairs if p != q]
            assert max(np.std(m) for m in moved) > 0.0, (form.effect, form.nonlinear[index])


def limited(**changes: float | bool) -> Scene:
    options = {"limit": 1.2, "torque_step_nm": 0.0, "has_command": True, **changes}
    joint = Joint(limit=float(options["limit"]))
    return scene_of(
        [
            record(
                joint,
                seed,
                torque_step_nm=float(options["torque_step_nm"]),
                has_command=bool(options["has_command"]),
            )
            for seed in (1, 2)
        ]
    )


@pytest.mark.parametrize("step_nm", [0.0, 0.05])
def test_a_torque_limit_is_found_with_its_interval(step_nm: float) -> None:
    evidence = saturation_evidence(limited(torque_step_nm=step_nm).table)
    assert evidence is not None
    low, high = evidence.limit_ci95_nm
    assert low <= 1.2 <= high
    assert high - low < 0.01 + 1.2 * step_nm
    assert evidence.share > 0.02
    assert evidence.missing_nm > 0.1


def test_a_limit_that_is_met_once_is_found_where_far_more_torque_is_missing_for_long() -> None:
    once = saturation_evidence(scene_of([record(Joint(limit=1.35), 5)]).table)
    assert once is not None
    assert once.tops == 1
    assert once.limit_ci95_nm[0] <= 1.35 <= once.limit_ci95_nm[1]
    # two thirds of a second before; a fifth of one, that hardly falls short, is not enough
    assert saturation_evidence(scene_of([record(Joint(limit=1.4), 3)]).table) is None


@pytest.mark.parametrize("step_nm", [0.0, 0.02, 0.1])
def test_smooth_peaks_and_coarse_torque_are_no_limit(step_nm: float) -> None:
    assert saturation_evidence(limited(limit=1e9, torque_step_nm=step_nm).table) is None


def test_flat_torque_without_a_command_says_nothing() -> None:
    assert saturation_evidence(limited(has_command=False).table) is None


def test_steady_acceleration_is_flat_without_falling_short() -> None:
    table = limited(has_command=True).table
    # The drive kept up with what it was asked for: only then flat torque is what the motion needs.
    kept_up = {**table.full, "velocity_command_rad_s": table.full["velocity_rad_s"] + 0.2}
    assert saturation_evidence(replace(table, full=kept_up)) is None


def test_a_twin_that_knows_the_limit_is_not_told_of_it_again() -> None:
    plain = Twin("r", 1, GEAR, 0.01, coulomb_nm=0.4, viscous_nm_s_per_rad=0.01)
    limited_runs = [record(Joint(limit=1.2), seed) for seed in (1, 2)]
    found = study(plain, tabulate(plain, limited_runs))
    assert [f.effect for f in findings_of(found)][:1] == ["torque-saturation"]
    assert [e.id for e in found.extended.effects].count("torque-saturation") == 1
    again = study(found.extended, tabulate(found.extended, limited_runs))
    assert "torque-saturation" not in [f.effect for f in findings_of(again)]
    # The motion was driven within the limit: held against it, the prediction stays as it is.
    free = replace(found.extended, effects=())
    clipped = predicted(again.table, found.extended) - predicted(again.table, free)
    assert np.sqrt(np.mean(clipped**2)) < 0.2 * found.floor.value_nm
