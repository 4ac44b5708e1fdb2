"""A hose beside a weight that the simulation has wrong: both are told, and no place of the gear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.candidate import Known, Together
from agent.explain.choosing.rivals import Term, with_rivals
from agent.explain.choosing.search import Library
from agent.explain.findings import findings_of
from agent.explain.forms.library import FORMS
from agent.explain.numbers.cancelling import cancelled_by
from agent.explain.numbers.model import fit_model
from agent.explain.numbers.short_stroke import PAYLOAD, without_gravity
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import (
    GEAR_RATIO,
    TWIN,
    Conditions,
    record,
    stair,
)
from trajectories import SetPoints

SIN_NM, COS_NM = 1.6, 0.55
CYCLE = stair((3, 10, 30, 60), 2.1 * GEAR_RATIO, 30.0)


def hose_nm(arm_rad: Floats) -> Floats:
    """Return a hose that is e times as stiff for every 0.36 rad further on."""
    return np.asarray(0.094 * 0.36 * np.sinh((arm_rad + 0.07) / 0.36))


def hangs(points: SetPoints, at: Conditions) -> Floats:
    del at
    arm = points.position_rad / GEAR_RATIO
    return np.asarray(SIN_NM * np.sin(arm) + COS_NM * np.cos(arm) + hose_nm(arm))


def test_a_hose_that_stiffens_is_no_bump_at_the_end_of_the_stroke() -> None:
    """The flank of a bump that is centred there stood for it, with a probability of one."""
    given = replace(TWIN, gravity_sin_nm=0.93 * SIN_NM, gravity_cos_nm=1.1 * COS_NM)
    runs = [record(CYCLE, hangs, Conditions(started_s=100.0 * k), k) for k in range(3)]
    found = study(given, tabulate(given, runs))
    named = {finding.effect for finding in findings_of(found)}
    assert "cable-force" in named
    assert "local-fault" not in named
    assert found.left.ratio < 1.2


@pytest.mark.parametrize(("sine_nm", "known"), [(0.2, True), (-0.475, False)])
def test_of_two_laws_that_take_each_other_back_neither_is_known(
    sine_nm: float, known: bool
) -> None:
    def pulls(points: SetPoints, at: Conditions) -> Floats:
        del at
        arm = points.position_rad / GEAR_RATIO
        return np.asarray(0.5 * arm + sine_nm * np.sin(arm))

    table = without_gravity(tabulate(TWIN, [record(CYCLE, pulls, Conditions(), 0)]))
    delta, left = refit(table)
    given = np.array([getattr(TWIN, name) for name in BASE])
    scene = Scene(table, given + delta, np.where(table.used, left, 0.0), given=given)
    spring = next(form for form in FORMS if (form.effect, form.name) == ("cable-force", "spring"))
    library = Library.of(scene, weigh(table, left), [spring, PAYLOAD])
    hose, weight = (library.candidate(form, ()) for form in (spring, PAYLOAD))
    (beside_weight,), (beside_hose,) = (
        [s for s in library.rank([other]) if s.form is form]
        for form, other in ((spring, weight), (PAYLOAD, hose))
    )
    terms = [Term(beside_weight, 0.0), Term(beside_hose, 0.0)]
    model = fit_model(library, TWIN, terms)
    assert "held as given" in model.base["gravity_sin_nm"].reason  # it is not that nothing moves
    cancelled = cancelled_by(library, model)
    assert cancelled == ({} if known else {0: 1, 1: 0})


@pytest.mark.parametrize(("more_nm", "tied"), [(0.1, True), (1.0, False)])
def test_a_straight_spring_stands_for_a_weight_as_far_as_noise_hides_the_rest(
    more_nm: float, tied: bool
) -> None:
    """A sine of a hundred times the noise was tied with a spring that left four times as much.

    One of ten times the noise was a wrong inertia and wrong friction, both as given within their
    intervals: friction under a load, a copy of the weight here, had taken the weight's place.
    """
    given = replace(TWIN, gravity_sin_nm=0.5)

    def heavier(points: SetPoints, at: Conditions) -> Floats:
        del at
        return np.asarray((0.5 + more_nm) * np.sin(points.position_rad / GEAR_RATIO))

    short = stair((3, 10, 30), 0.9 * GEAR_RATIO, 24.0)
    runs = [record(short, heavier, Conditions(started_s=100.0 * k), k) for k in range(3)]
    (weight,) = findings_of(study(given, tabulate(given, runs)))
    assert weight.effect == "gravity-imbalance"
    assert [other.effect for other in weight.alternatives] == ["cable-force"] * tied


@pytest.mark.parametrize(("sine_nm", "cosine_nm"), [(2.9575, 0.4974), (3.045, 0.495)])
def test_a_weight_that_is_one_percent_off_is_a_number_and_no_hose(
    sine_nm: float, cosine_nm: float
) -> None:
    """It was a payload tied with a hose, though its direction is the twin's own."""
    given = replace(TWIN, gravity_sin_nm=sine_nm, gravity_cos_nm=cosine_nm)

    def weighs(points: SetPoints, at: Conditions) -> Floats:
        del at
        arm = points.position_rad / GEAR_RATIO
        return np.asarray(3.0 * np.sin(arm) + 0.5 * np.cos(arm))

    runs = [record(CYCLE, weighs, Conditions(started_s=100.0 * k), k) for k in range(3)]
    (weight,) = findings_of(study(given, tabulate(given, runs)))
    assert weight.effect == "gravity-imbalance"
    assert not weight.alternatives
    assert weight.parameters["gravity_sin_nm"].value == pytest.approx(3.0 - sine_nm, abs=0.01)


def test_a_weight_that_follows_a_wrong_torque_constant_is_no_payload_as_well() -> None:
    """Held as given beside friction that falls, it was off by the constant, and told once more."""
    joint, factor, fall_nm = replace(TWIN, gravity_sin_nm=2.0), 0.94, 0.1

    def reported_otherwise(points: SetPoints, at: Conditions) -> Floats:
        del at
        way = np.sign(points.velocity_rad_s)
        motion = points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2
        fall = fall_nm * way * np.exp(-np.abs(points.velocity_rad_s) / 6.0)
        real = joint.predict_torque(*motion, way) + fall
        return np.asarray(real / factor - TWIN.predict_torque(*motion, way))

    runs = [record(CYCLE, reported_otherwise, Conditions(), k) for k in range(3)]
    named = {
        finding.effect: finding for finding in findings_of(study(joint, tabulate(joint, runs)))
    }
    assert named.keys() == {"torque-constant-error", "stribeck"}
    assert named["torque-constant-error"].parameters["factor"].value == pytest.approx(
        factor, abs=0.005
    )


def test_friction_under_a_load_is_no_rival_of_what_the_load_is_made_of() -> None:
    """Of a load that swings less than the dry friction it is that load's own copy.

    A cable stayed tied with it, and experiments to decide between the two were offered for ever.
    """
    joint = replace(TWIN, gravity_sin_nm=0.12)

    def pulls(points: SetPoints, at: Conditions) -> Floats:
        del at
        arm = points.position_rad / GEAR_RATIO
        return np.asarray(0.15 * arm + joint.gravity_sin_nm * np.sin(arm))

    cycle = stair((3, 10, 30, 60), 1.7 * GEAR_RATIO, 40.0)
    runs = [record(cycle, pulls, Conditions(), seed) for seed in range(3)]
    table = without_gravity(tabulate(joint, runs))
    delta, left = refit(table)
    given = np.array([getattr(joint, name) for name in BASE])
    scene = Scene(table, given + delta, np.where(table.used, left, 0.0), given=given)
    forms = [f for f in FORMS if f.name == "proportional, with viscous friction in the load"]
    forms += [f for f in FORMS if (f.effect, f.name) == ("cable-force", "spring")]
    library = Library.of(scene, weigh(table, left), forms)
    (hose,) = (s for s in library.rank([]) if s.form.effect == "cable-force")
    held = Together((Known(hose.candidate, hose.coefficients),))
    library = Library.of(replace(scene, held=held), library.weighing, forms)
    ranked = library.rank([])
    copy, hose = ranked
    assert copy.form.effect == "load-dependent-friction"
    assert copy.error < hose.error
    assert with_rivals(library, [], ranked, hose, 0.0, {}).rivals == ()


def test_a_torque_constant_beside_a_payload_is_no_wrong_inertia() -> None:
    """The payload took the weight's part of it, and what was left of friction was not told."""
    joint, factor, payload_nm = replace(TWIN, gravity_sin_nm=2.0), 0.9, 0.3

    def reported_otherwise(points: SetPoints, at: Conditions) -> Floats:
        del at
        motion = points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2
        real = joint.predict_torque(*motion, np.sign(points.velocity_rad_s))
        real = real + payload_nm * np.sin(points.position_rad / GEAR_RATIO)
        plain = TWIN.predict_torque(*motion, np.sign(points.velocity_rad_s))
        return np.asarray(real / factor - plain)

    cycle = stair((10, 30, 60, 90), 5.0 * GEAR_RATIO, 60.0)
    runs = [record(cycle, reported_otherwise, Conditions(), seed) for seed in range(2)]
    named = {
        finding.effect: finding for finding in findings_of(study(joint, tabulate(joint, runs)))
    }
    assert named.keys() == {"torque-constant-error", "gravity-imbalance"}
    constant, weight = named["torque-constant-error"], named["gravity-imbalance"]
    assert constant.parameters["factor"].value == pytest.approx(factor, abs=0.005)
    more = weight.parameters["gravity_sin_nm"]
    assert more.value == pytest.approx(payload_nm / factor, abs=0.02)  # in reported torque
    assert "in the torque that is reported" in weight.said.lead
