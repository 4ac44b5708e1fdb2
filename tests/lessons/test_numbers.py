"""A twin whose own numbers are wrong is never told that it agrees with the recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.explain.explain import explain
from agent.explain.findings import findings_of
from agent.explain.rows.table import tabulate
from agent.explain.study import Study, study
from agent.explain.verdict import left_share, verdict_of
from agent.explain.written_down import experiments
from agent.identify.result import Floats
from agent.physics.twin import Effect, Twin
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, nothing, record, stair
from trajectories import SetPoints

SPEEDS = (2.0, 6.0, 20.0, 50.0)
PAIR = {"torque-offset", "direction-asymmetry"}
FELT = {
    "inertia_kg_m2": 4e-4,
    "coulomb_nm": NOISE_NM,
    "viscous_nm_s_per_rad": 8e-4,
    "gravity_sin_nm": 1.5 * NOISE_NM,
    "gravity_cos_nm": 1.5 * NOISE_NM,
}
"""Errors about as large as the noise."""


def studied(twin: Twin, stroke_rad: float, offset_nm: float = 0.0, seed: int = 0) -> Study:
    def constant(points: SetPoints, at: Conditions) -> Floats:
        del at
        return np.full_like(points.position_rad, offset_nm)

    run = record(stair(SPEEDS, stroke_rad), constant, Conditions(), seed)
    return study(twin, tabulate(twin, [run]))


errors = st.one_of(st.just(0.0), st.floats(-3.0, 3.0))


@settings(max_examples=3, deadline=None)
@given(
    wrong=st.tuples(*[errors] * len(FELT)),
    offset=errors,
    stroke_rad=st.sampled_from((30.0, 60.0, 120.0, 240.0)),
    seed=st.integers(0, 1000),
)
def test_what_is_clearly_off_is_never_denied(
    wrong: tuple[float, ...], offset: float, stroke_rad: float, seed: int
) -> None:
    numbers = {
        name: getattr(TWIN, name) + share * size
        for (name, size), share in zip(FELT.items(), wrong, strict=True)
    }
    found = studied(replace(TWIN, **numbers), stroke_rad, offset * NOISE_NM, seed)
    off_nm = np.sqrt(np.mean(found.table.target_nm[found.table.sliding] ** 2))
    verdict = verdict_of(found, findings_of(found), left_share(found))
    if off_nm > 1.3 * found.floor.value_nm:
        assert verdict != "no-mismatch"


@pytest.mark.parametrize(("share", "wrong"), [(0.004, False), (0.015, True)])
def test_a_number_that_is_off_by_less_than_anybody_knows_it_is_not_wrong(
    share: float, wrong: bool
) -> None:
    """It shows, and still no drive knows its torque to half a percent."""
    heavy = replace(TWIN, coulomb_nm=0.25 * NOISE_NM / share)
    twin = replace(heavy, coulomb_nm=heavy.coulomb_nm * (1.0 - share))

    def more(points: SetPoints, _at: Conditions) -> Floats:
        return np.asarray((heavy.coulomb_nm - TWIN.coulomb_nm) * np.sign(points.velocity_rad_s))

    run = record(stair(SPEEDS), more, Conditions(), 0)
    numbers = study(twin, tabulate(twin, [run])).numbers
    assert bool(numbers) == wrong


def test_a_wrong_number_has_the_share_that_it_makes_not_what_a_law_would_leave_of_it() -> None:
    """Put back as given, a Stribeck fall and viscous friction would take half of it over."""

    def fall(points: SetPoints, _at: Conditions) -> Floats:
        speed = np.abs(points.velocity_rad_s)
        return np.asarray(0.15 * np.exp(-speed / 15.0) * np.sign(points.velocity_rad_s))

    twin = replace(TWIN, coulomb_nm=TWIN.coulomb_nm + 1.0)
    found = study(twin, tabulate(twin, [record(stair(SPEEDS), fall, Conditions(), 0)]))
    assert [term.scored.form.effect for term in found.choice.terms] == ["stribeck"]
    (wrong,) = found.numbers
    assert wrong.effect == "wrong-number"
    assert wrong.energy_share > 0.9


def test_a_constant_on_a_short_stroke_is_a_constant_first_and_may_be_gravity() -> None:
    """Gravity has two numbers, and copies a constant: the one number comes first."""
    first, *more = findings_of(studied(TWIN, stroke_rad=60.0, offset_nm=0.05))
    assert not more
    assert first.effect in PAIR
    others = {alternative.effect for alternative in first.alternatives}
    assert PAIR - {first.effect} <= others
    assert "gravity-imbalance" in others
    (number,) = first.parameters.values()
    size = 1.0 if first.effect == "torque-offset" else 2.0
    assert number.value == pytest.approx(size * 0.05, rel=0.1)


def test_an_offset_too_small_for_a_name_is_no_gravity_either() -> None:
    """On a short stroke gravity does all that it does, with a number more; neither is worth it."""
    found = studied(TWIN, stroke_rad=60.0, offset_nm=0.15 * NOISE_NM)
    assert findings_of(found) == ()
    assert verdict_of(found, (), left_share(found)) == "no-mismatch"


@pytest.mark.parametrize(
    ("inertia", "said"), [(1.04, ["torque-constant-error"]), (1.0, ["wrong-number"])]
)
def test_one_factor_that_misses_little_of_what_three_numbers_gain_is_the_torque_constants(
    inertia: float, said: list[str]
) -> None:
    """Small effects of the joint move each number by a percent of its own; no number is right."""
    given = replace(
        TWIN,
        inertia_kg_m2=inertia * TWIN.inertia_kg_m2,
        coulomb_nm=1.03 * TWIN.coulomb_nm,
        viscous_nm_s_per_rad=1.05 * TWIN.viscous_nm_s_per_rad,
    )
    assert [finding.effect for finding in findings_of(studied(given, 120.0))] == said


def strong(points: SetPoints, at: Conditions) -> Floats:
    """Make the joint twenty times as strong, so that its noise is a thousandth of its torque."""
    del at
    return np.asarray(
        19.0
        * (
            TWIN.inertia_kg_m2 * points.acceleration_rad_s2
            + TWIN.viscous_nm_s_per_rad * points.velocity_rad_s
            + TWIN.coulomb_nm * np.sign(points.velocity_rad_s)
        )
    )


@pytest.mark.parametrize(
    ("inertia", "coulomb", "viscous", "constant"),
    [
        (1.080, 1.085, 1.088, True),  # no twin's numbers are known to a tenth of a percent
        (1.080, 1.100, 0.970, False),  # the greatest torque makes no constant of three numbers
        (1.080, 1.100, 1.000, False),
    ],
)
def test_one_factor_stands_for_numbers_that_are_off_alike(
    inertia: float, coulomb: float, viscous: float, constant: bool
) -> None:
    given = replace(
        TWIN,
        inertia_kg_m2=20.0 * inertia * TWIN.inertia_kg_m2,
        coulomb_nm=20.0 * coulomb * TWIN.coulomb_nm,
        viscous_nm_s_per_rad=20.0 * viscous * TWIN.viscous_nm_s_per_rad,
    )
    table = tabulate(given, [record(stair(SPEEDS), strong, Conditions(), 0)])
    said = findings_of(study(given, table))
    names = {finding.effect for finding in said}
    assert (names == {"torque-constant-error"}) if constant else ("inertia-error" in names)
    assert not said[0].alternatives


@pytest.mark.parametrize(
    ("coulomb_nm", "coulomb", "probability"),
    [
        (0.004, 1.0, 0.5),  # the inertia alone says it
        (0.3, 1.08, 0.75),  # two numbers that are off alike: a constant, or a coincidence
    ],
)
def test_a_factor_that_rests_on_one_or_two_numbers_may_be_those(
    coulomb_nm: float, coulomb: float, probability: float
) -> None:
    """Without a weight, and with hardly any viscous friction, a factor had been told as sure."""
    faint = replace(TWIN, coulomb_nm=coulomb_nm, viscous_nm_s_per_rad=5e-4)

    def faintly(points: SetPoints, at: Conditions) -> Floats:
        del at
        velocity = points.velocity_rad_s
        less = faint.viscous_nm_s_per_rad - TWIN.viscous_nm_s_per_rad
        return np.asarray(less * velocity + (coulomb_nm - TWIN.coulomb_nm) * np.sign(velocity))

    given = replace(faint, inertia_kg_m2=1.08 * TWIN.inertia_kg_m2, coulomb_nm=coulomb * coulomb_nm)
    found = study(given, tabulate(given, [record(stair(SPEEDS), faintly, Conditions(), 0)]))
    (finding,) = findings_of(found)
    assert finding.effect == "torque-constant-error"
    assert finding.probability == probability
    assert [other.effect for other in finding.alternatives] == ["inertia-error"]
    (advice,) = experiments(found, [finding], None, frozenset())
    assert advice.trajectory is None
    assert "gravity and friction" in advice.set_up


@pytest.mark.parametrize(("warm_degc", "said"), [(45.0, True), (26.0, False)])
def test_friction_of_a_gear_that_is_otherwise_warm_may_be_no_wrong_number(
    warm_degc: float, said: bool
) -> None:
    learnt = {"learnt_over": {"gearbox_temperature_degc": [24.0, 25.0]}}
    twin = replace(TWIN, coulomb_nm=1.3 * TWIN.coulomb_nm, extra=learnt)
    runs = [record(stair(SPEEDS), nothing, Conditions(warm_degc), seed) for seed in range(2)]
    reasons = explain(twin, runs).reasons
    assert any("gearbox temperatures of 45 °C where" in reason for reason in reasons) is said


@pytest.mark.parametrize(("second_degc", "said"), [(30.0, True), (45.0, False)])
def test_at_one_temperature_a_wrong_number_may_be_a_law_of_warmth(
    second_degc: float, said: bool
) -> None:
    law = Effect(
        "temperature-dependent-friction", {"coulomb_nm_per_k": -0.001, "reference_degc": 30.0}
    )
    twin = replace(TWIN, coulomb_nm=1.3 * TWIN.coulomb_nm, effects=(law,))
    runs = [
        record(stair(SPEEDS), nothing, Conditions(degc), seed)
        for seed, degc in enumerate((30.0, second_degc))
    ]
    reasons = explain(twin, runs).reasons
    assert any("may be that law, which is off there" in reason for reason in reasons) is said
