"""What an effect is worth: its share of the mismatch, the least that gets a name, bent numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.explain.choosing.candidate import Candidate, Known
from agent.explain.choosing.choice import choose
from agent.explain.choosing.materiality import (
    CLOSE,
    above_band_nm2,
    beyond,
    least_gain,
    worth,
)
from agent.explain.choosing.search import Library
from agent.explain.choosing.shares import above_noise, shares_of, without_term
from agent.explain.choosing.weighted import DELAY
from agent.explain.forms.library import FORMS
from agent.explain.numbers.explained_before import least_beside_effects
from agent.explain.numbers.model import fit_model
from agent.explain.numbers.plain_refits import moves_through_reversals, plain_moves
from agent.explain.numbers.short_stroke import PAYLOAD, without_gravity
from agent.explain.numbers.wrong import wrong_numbers
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from agent.physics.twin import Effect, Twin
from tests.science.explain_joint import (
    GEAR_RATIO,
    NOISE_NM,
    TWIN,
    Conditions,
    record,
    stair,
)
from trajectories import SetPoints, stair_paired

SPEEDS = (4.0, 8.0, 16.0, 30.0)


def bare(*runs: Run, twin: Twin = TWIN) -> Library:
    """Return recordings without candidates."""
    table = tabulate(twin, runs)
    delta, left = refit(table)
    theta = np.array([getattr(twin, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0))
    return Library.of(scene, weigh(table, left), ())


def ripple(library: Library, order: float) -> Candidate:
    form = next(f for f in FORMS if (f.effect, f.name) == ("torque-ripple", "one order"))
    return library.candidate(form, (order,))


def driven(first_nm: float, other_nm: float = 0.0, order: float = 3.0) -> Library:
    """Return a joint with torque that repeats once, and some other times, a motor turn."""

    def missing(points: SetPoints, _at: Conditions) -> Floats:
        angle = points.position_rad
        return np.asarray(first_nm * np.cos(angle) + other_nm * np.sin(order * angle))

    return bare(record(stair(SPEEDS), missing, Conditions(), seed=3))


def test_a_share_is_not_of_gravity_that_is_carried_on_to_another_place() -> None:
    """Learnt on four short strokes and held against the fifth, it is off by more than an offset."""
    twin = replace(TWIN, gravity_sin_nm=1.5)

    def missing(points: SetPoints, _at: Conditions) -> Floats:
        angle = points.position_rad
        return np.asarray(1.5 * np.sin(angle / GEAR_RATIO) + 0.3 + 0.05 * np.cos(angle))

    def at(place_rad: float, seed: int) -> Run:
        there = stair_paired(
            place_rad,
            place_rad + 40.0,
            speeds_rad_s=SPEEDS,
            duration_s=16.0,
            acceleration_rad_s2=200.0,
            jerk_rad_s3=5000.0,
            dwell_min_s=0.1,
        )
        return record(there, missing, Conditions(), seed, name=str(seed))

    places = (-70.0, -40.0, -20.0, 0.0, 30.0)
    library = bare(*(at(place, seed) for seed, place in enumerate(places)), twin=twin)
    form = next(f for f in FORMS if f.effect == "torque-offset")
    offset, wave = library.candidate(form, ()), ripple(library, 1.0)
    of_offset, of_wave = shares_of(library, [offset, wave], 0.2 * NOISE_NM)
    own = offset.columns[:, 0]
    left = 0.3 * (own - library.base @ np.linalg.lstsq(library.base, own)[0])
    slides = library.scene.table.sliding[library.weighing.rows]
    energy = float(np.mean((left / library.weighing.weight)[slides] ** 2))
    truth = energy / (energy + 0.5 * 0.05**2)
    assert (of_offset, of_wave) == pytest.approx((truth, 1.0 - truth), abs=0.05)


def test_a_gain_close_above_the_least_must_be_sure_and_a_large_one_may_come_from_one_block() -> (
    None
):
    even = np.full(25, 1.0) + np.tile([0.2, -0.2], 13)[:25]  # 25 in all, give or take 1
    assert beyond(even, 22.0) > 0.0
    assert beyond(even, 24.5) < 0.0
    once = np.r_[25.0, np.zeros(24)]
    assert beyond(once, 16.0) > 0.0
    assert beyond(once, 17.0) < 0.0
    assert beyond(np.full(25, -1.0), 0.0) < 0.0 < beyond(np.full(25, 1.0), 0.0)


def test_what_takes_the_last_of_a_mismatch_need_not_surely_be_as_much() -> None:
    """A weak effect beside a strong one would leave twice the noise without a name."""
    whole = np.full(25, 1.0)
    without = whole + np.r_[np.full(2, 12.5), np.zeros(23)]  # 25 more, in two of the blocks
    assert beyond(without - whole, 22.0) < 0.0 < worth(without, whole, 22.0, noise=25.0)
    assert worth(without, whole, 26.0, noise=25.0) < 0.0  # less than the least has no name
    assert worth(without, whole, 22.0, noise=15.0) < 0.0  # more than the noise is left
    assert worth(without, whole, 22.0, noise=42.0) < 0.0  # nothing was missing


def test_what_surely_takes_a_good_part_of_a_mismatch_need_not_surely_be_as_much() -> None:
    """A third of what stands above the noise is no accident where it is surely more than none."""
    gain = np.r_[np.full(5, 5.0), np.zeros(20)]  # 25, give or take 10
    whole = np.full(25, 3.0)
    assert beyond(gain, 22.0) < 0.0 < worth(whole + gain, whole, 22.0, noise=25.0)
    assert worth(whole + gain, whole, 26.0, noise=25.0) < 0.0  # less than the least has no name
    assert worth(4.0 * whole + gain, 4.0 * whole, 22.0, noise=25.0) < 0.0  # much else is missing
    assert worth(whole + gain, whole, 22.0, noise=90.0) < 0.0  # nothing was missing
    once = np.r_[25.0, np.zeros(24)]  # in one block, and in no other
    assert worth(whole + once, whole, 22.0, noise=25.0) < 0.0


@pytest.mark.parametrize("times_noise", [0.25, 1.0, 4.0])
def test_all_of_a_mismatch_is_all_of_it_however_small(times_noise: float) -> None:
    library = driven(times_noise * NOISE_NM)
    left = library.residual([ripple(library, 1.0)]) / library.weighing.weight
    # A floor that misses slow noise, as floors within half a second do.
    floor_nm = 0.95 * math.sqrt(float(np.mean(left**2)))
    (share,) = shares_of(library, [ripple(library, 1.0)], floor_nm)
    assert share == pytest.approx(1.0, abs=0.02)


def test_two_effects_share_by_their_energies() -> None:
    library = driven(0.05, 0.1)
    shares = shares_of(library, [ripple(library, 1.0), ripple(library, 3.0)], 0.2 * NOISE_NM)
    assert shares == pytest.approx((0.2, 0.8), abs=0.03)


def test_effects_that_resemble_each_other_both_carry_what_they_carry_together() -> None:
    """A share is of the joint without the effect, not of a model whose other law stands in."""
    order = 1.008
    library = driven(0.1, 0.1, order)
    terms = [ripple(library, 1.0), ripple(library, order)]
    rows = library.weighing.rows
    angle = library.scene.table.rows["position_rad"][rows]
    parts = 0.1 * np.cos(angle), 0.1 * np.sin(order * angle)
    both, alone = np.mean((parts[0] + parts[1]) ** 2), np.mean(np.square(parts), axis=1)
    shares = shares_of(library, terms, 0.2 * NOISE_NM)
    assert shares == pytest.approx(1.0 - alone[::-1] / both, abs=0.05)
    left = [float(np.sum(library.residual(x) ** 2)) for x in ([], terms[1:], terms)]
    assert (left[1] - left[2]) / left[0] < shares[0] - 0.15  # what the other one cannot copy


def test_without_a_delay_nothing_is_late() -> None:
    library = driven(0.1)
    late = replace(library, scene=replace(library.scene, late_s=0.02), known={})
    form = next(f for f in FORMS if f.effect == DELAY)
    terms = [late.candidate(form, (0.02,)), ripple(late, 1.0)]
    assert not np.allclose(terms[1].columns, ripple(library, 1.0).columns)
    (on_time,) = without_term(late, terms, 0)
    np.testing.assert_allclose(on_time.columns, ripple(library, 1.0).columns)
    assert without_term(late, terms, 1) == terms[:1]


@pytest.mark.parametrize("since", ["stribeck", "power law", "shear thinning with a plateau"])
def test_what_yields_before_it_slips_has_nothing_left_to_yield_of_friction_that_is_gone(
    since: str,
) -> None:
    """Else a Stribeck fall of half of a mismatch had no share of it beside presliding.

    Nor had what was found by one form of a law, and stands by another one since.
    """
    library = driven(0.1)
    named = {(f.effect, f.name): f for f in FORMS}
    known = "stribeck", "exponential fall"
    if since != "stribeck":
        known = "viscous-nonlinear", "power law"
    fallen = library.candidate(named[known], named[known].grid(library.scene)[0])
    scene = replace(library.scene, sliding=(Known(fallen, np.array([0.3])),))
    yielding = replace(library, scene=scene, known={})
    presliding = named["presliding-hysteresis", "Dahl"]
    at = presliding.grid(library.scene)[4]
    form = named.get(("viscous-nonlinear", since), named[known])
    terms = [yielding.candidate(presliding, at), library.candidate(form, form.grid(scene)[0])]
    plain = library.candidate(presliding, at).columns
    assert np.linalg.norm(terms[0].columns - plain) > 0.05 * np.linalg.norm(plain)
    (left,) = without_term(yielding, terms, 1)
    np.testing.assert_allclose(left.columns, plain)
    assert without_term(yielding, terms, 0) == terms[1:]


@given(st.floats(0.0, 10.0), st.floats(0.0, 1.0), st.floats(0.0, 3.0))
def test_mismatch_is_what_was_removed_and_what_stands_above_the_noise(
    removed: float, after: float, floor_nm: float
) -> None:
    above = above_noise(after + removed, after, floor_nm)
    assert above >= removed * (1.0 - 1e-9) - 1e-12
    if after <= (CLOSE * floor_nm) ** 2:
        assert above == pytest.approx(removed, abs=1e-9)


def test_what_the_raw_torque_drowns_gets_no_name() -> None:
    """White noise lies above the band for the most part, and the least gain follows all of it."""
    library = driven(0.0)
    table = library.scene.table
    assert above_band_nm2(table) == pytest.approx(
        NOISE_NM**2 * (1.0 - 2.0 * table.cutoff_hz * 0.004), rel=0.2
    )
    least = least_gain(library, np.zeros(1), []) / float(np.sum(library.weighing.weight**2))
    assert 0.01 * NOISE_NM**2 < least < 0.04 * NOISE_NM**2


@pytest.mark.parametrize(("rubbing_nm", "named"), [(0.05, True), (0.004, False)])
def test_what_would_leave_twice_the_noise_has_a_name_beside_however_much(
    rubbing_nm: float, named: bool
) -> None:
    """Of a ripple of half a newton metre 2 % of the energy had been asked: 0.07 N m of friction."""

    def missing(points: SetPoints, _at: Conditions) -> Floats:
        rubs = rubbing_nm * np.sign(points.velocity_rad_s)
        return np.asarray(
            0.5 * np.cos(points.position_rad) + rubs * np.cos(8.0 * points.position_rad / 100.0)
        )

    found = study(TWIN, tabulate(TWIN, [record(stair(SPEEDS), missing, Conditions(), seed=6)]))
    effects = [term.scored.form.effect for term in found.choice.terms]
    expected = ["position-dependent-friction", "torque-ripple"] if named else ["torque-ripple"]
    assert sorted(effects) == expected
    assert found.left.ratio < 1.2


def test_a_number_bent_by_a_fit_to_raw_samples_is_recognised() -> None:
    """Velocity that shakes where the joint does not makes raw least squares find less inertia."""
    plain = record(stair(SPEEDS), lambda p, _: np.zeros(p.position_rad.shape), Conditions(), seed=4)
    assert plain.signals.velocity_rad_s is not None
    shaken = 0.05 * np.random.default_rng(5).standard_normal(plain.signals.velocity_rad_s.shape)
    signals = replace(plain.signals, velocity_rad_s=plain.signals.velocity_rad_s + shaken)
    run = replace(plain, signals=signals)
    in_band, *_, as_recorded = plain_moves(bare(run), TWIN)
    bent = as_recorded["inertia_kg_m2"]
    assert bent < -0.02 * TWIN.inertia_kg_m2
    assert abs(in_band["inertia_kg_m2"]) < 0.2 * abs(bent)
    twin = replace(TWIN, inertia_kg_m2=TWIN.inertia_kg_m2 + bent)
    again = plain_moves(bare(run, twin=twin), twin)[-1]
    assert abs(again["inertia_kg_m2"]) < 0.05 * abs(bent)


@pytest.mark.parametrize(("given", "said"), [(None, []), (1.25, ["inertia-error"])])
def test_an_inertia_bent_by_reversals_with_play_is_not_called_wrong(
    given: float | None, said: list[str]
) -> None:
    """While the teeth are apart the motor turns alone, and all its samples are in a twin's fit."""

    def loose(points: SetPoints, _at: Conditions) -> Floats:
        velocity = points.velocity_rad_s
        alone = np.convolve(np.diff(np.sign(velocity), prepend=0.0) != 0.0, np.ones(16), "full")
        lost = -TWIN.inertia_kg_m2 * points.acceleration_rad_s2 * (alone[: velocity.size] > 0)
        return np.asarray(lost + 0.2 * np.cos(points.position_rad))

    run = record(stair(SPEEDS), loose, Conditions(), seed=3)
    bent = TWIN.inertia_kg_m2 + moves_through_reversals(bare(run), TWIN)["inertia_kg_m2"]
    assert bent < 0.9 * TWIN.inertia_kg_m2
    twin = replace(TWIN, inertia_kg_m2=given * TWIN.inertia_kg_m2 if given else bent)
    library = bare(run, twin=twin)
    ripples = Library.of(library.scene, library.weighing, [ripple(library, 1.0).form])
    choice = choose(ripples)
    model = fit_model(ripples, twin, choice.terms)
    numbers = wrong_numbers(ripples, twin, model, choice.candidates, NOISE_NM)
    assert [number.effect for number in numbers] == said


def falls_with_speed(points: SetPoints, at: Conditions) -> Floats:
    del at
    velocity = points.velocity_rad_s
    return np.asarray(0.4 * np.sign(velocity) * np.exp(-np.abs(velocity) / 6.0))


def test_what_misses_most_of_a_strong_effect_is_no_rival_however_few_blocks_show_it() -> None:
    run = record(stair((2, 4, 8, 16, 40, 80), 100.0, 26.0), falls_with_speed, Conditions(), 0)
    plain = bare(run)
    weighed = {"stribeck", "position-dependent-friction", "local-fault"}
    forms = tuple(form for form in FORMS if form.effect in weighed)
    choice = choose(Library.of(plain.scene, plain.weighing, forms))
    assert [(term.scored.form.effect, term.rivals) for term in choice.terms] == [("stribeck", ())]


def wears(points: SetPoints, at: Conditions) -> Floats:
    """Return Coulomb friction that is the twin's own in the first hour, and grows."""
    return np.asarray(0.02 * at.started_s / 3600.0 * np.sign(points.velocity_rad_s))


@pytest.mark.parametrize(("given", "said"), [(1.0, []), (0.6, ["wrong-number"])])
def test_a_number_that_drifts_away_from_the_twins_own_is_not_called_wrong(
    given: float, said: list[str]
) -> None:
    trajectory = stair((5, 20, 60), 100.0, 12.0)
    runs = [record(trajectory, wears, Conditions(started_s=3600.0 * h), h) for h in range(4)]
    twin = replace(TWIN, coulomb_nm=given * TWIN.coulomb_nm)
    plain = bare(*runs, twin=twin)
    drifts = [form for form in FORMS if form.name == "Coulomb level, steady"]
    library = Library.of(plain.scene, plain.weighing, drifts)
    choice = choose(library)
    assert [term.scored.form.effect for term in choice.terms] == ["friction-drift"]
    model = fit_model(library, twin, choice.terms)
    numbers = wrong_numbers(library, twin, model, choice.candidates, NOISE_NM)
    assert [number.effect for number in numbers] == said


def thins_with_warmth(points: SetPoints, at: Conditions) -> Floats:
    thinner = np.exp((20.0 - at.gearbox_degc) / 30.0) - 1.0
    return np.asarray(TWIN.viscous_nm_s_per_rad * thinner * points.velocity_rad_s)


@pytest.mark.parametrize(
    ("coulomb", "said"),
    [(1.08, ["torque-constant-error"]), (1.3, ["wrong-number", "inertia-error"])],
)
def test_a_torque_constant_is_told_beside_friction_that_the_warmth_changes(
    coulomb: float, said: list[str]
) -> None:
    """Nobody knows at which warmth the twin's viscous friction was right: no factor moves it."""
    warmths = (20.0, 27.0, 34.0, 41.0)
    runs = [
        record(stair((5, 20, 60), 100.0, 12.0), thins_with_warmth, Conditions(gearbox_degc=t), k)
        for k, t in enumerate(warmths)
    ]
    twin = replace(
        TWIN,
        inertia_kg_m2=1.08 * TWIN.inertia_kg_m2,
        coulomb_nm=coulomb * TWIN.coulomb_nm,
        viscous_nm_s_per_rad=0.8 * TWIN.viscous_nm_s_per_rad,
    )
    plain = bare(*runs, twin=twin)
    forms = [form for form in FORMS if form.effect == "temperature-dependent-friction"]
    library = Library.of(plain.scene, plain.weighing, forms)
    choice = choose(library)
    model = fit_model(library, twin, choice.terms)
    numbers = wrong_numbers(library, twin, model, choice.candidates, NOISE_NM)
    assert [number.effect for number in numbers] == said


@pytest.mark.parametrize("too_little_nm", [0.0, 0.03])
def test_beside_wrong_numbers_an_effect_is_held_against_what_the_given_twin_leaves(
    too_little_nm: float,
) -> None:
    runs = record(stair(SPEEDS), lambda points, _at: 0.0 * points.position_rad, Conditions(), 5)
    library = bare(runs, twin=replace(TWIN, coulomb_nm=TWIN.coulomb_nm - too_little_nm))
    plain = library.errors([])
    usual = least_gain(library, plain, ())
    asked = least_gain(library, plain, (), beside_wrong_numbers=True)
    more = asked - usual
    wrong = 0.02 * too_little_nm**2 * float(np.sum(library.weighing.weight**2))
    assert more == pytest.approx(wrong, rel=0.1, abs=0.1 * usual)


def stiffening_hose(points: SetPoints, _at: Conditions) -> Floats:
    away = (points.position_rad - 15.0) / 45.0
    return np.asarray(0.1 * away + 0.08 * away**3)


def test_a_second_law_that_only_bends_the_first_is_no_effect_of_its_own() -> None:
    runs = [record(stair(SPEEDS), stiffening_hose, Conditions(), seed) for seed in (3, 4)]
    table = without_gravity(tabulate(TWIN, runs))
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0))
    forms = (*(f for f in FORMS if f.effect == "cable-force"), PAYLOAD)
    library = Library.of(scene, weigh(table, left), forms)
    named = [term.scored.form.effect for term in choose(library, rivals=False).terms]
    assert named == ["cable-force"]


@pytest.mark.parametrize(("times_noise", "counts"), [(0.1, True), (2.0, False)])
def test_what_a_found_law_left_is_measured_by_what_it_explains(
    times_noise: float, counts: bool
) -> None:
    """The twin that an explanation wrote left 1 % of the mismatch, which was named then."""

    def missing(points: SetPoints, _at: Conditions) -> Floats:
        angle, against = points.position_rad, np.sign(points.velocity_rad_s)
        small = times_noise * NOISE_NM * np.cos(angle / 10.0)
        return np.asarray(0.2 * np.sin(6.0 * angle / 100.0) * against + small)

    law = {"cos_nm": 0.0, "sin_nm": 0.2, "order_per_arm_rev": 6.0}
    twin = replace(TWIN, effects=(Effect("position-dependent-friction", law),))
    library = bare(record(stair(SPEEDS), missing, Conditions(), 3), twin=twin)
    least, alone = least_beside_effects(library, twin), library.residual([])
    energy = float(np.sum((0.2 * library.weighing.weight) ** 2)) / 2.0
    assert (0.5 < least / (0.02 * energy) < 1.0) is counts  # the twin's numbers take up some
    assert (least > 0.1 * float(alone @ alone)) is counts
    assert least_beside_effects(library, TWIN) == 0.0
