"""What a forty-second foreign bank showed: a bend's slope is the twin's, and a wave is a wave."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agent.explain import named
from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.explain import explain
from agent.explain.findings import findings_of
from agent.explain.numbers.model import Model, extended_twin, fit_model, left_by
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from agent.physics.twin import DrivingFrictionError, Twin
from tests.science.explain_joint import TWIN, Conditions, library_of, record, stair
from trajectories import SetPoints

SPEEDS = (3, 8, 20, 50, 110)
HALF_AT = 18.0  # rad/s


def thins(points: SetPoints, _at: Conditions) -> Floats:
    """Return what oil lacks that thins from the twin's viscosity to a quarter of it."""
    speed = np.abs(points.velocity_rad_s)
    lost = 0.75 * TWIN.viscous_nm_s_per_rad * speed / (speed + HALF_AT)
    return np.asarray(-lost * points.velocity_rad_s)


def test_oil_that_thins_from_the_twins_viscosity_has_no_wrong_number() -> None:
    """The plateau's form had the slope, and "viscous friction is 0.00120, not 0.120" beside it."""
    runs = [record(stair(SPEEDS), thins, Conditions(), seed, name=f"run {seed}") for seed in (1, 2)]
    found = study(TWIN, tabulate(TWIN, runs))
    assert [finding.effect for finding in findings_of(found)] == ["viscous-nonlinear"]
    assert found.left.ratio < 1.1


def test_a_number_that_comes_out_below_zero_is_none_and_the_law_another() -> None:
    """Zero beside a bend that had more than all of the viscous friction explained nothing."""

    def shears(points: SetPoints, _at: Conditions) -> Floats:
        speed = points.velocity_rad_s
        return np.asarray(0.35 * np.arcsinh(speed / 12.0) - TWIN.viscous_nm_s_per_rad * speed)

    library = library_of([record(stair(SPEEDS), shears, Conditions(), 1)])
    (form,) = {c.form for c in library.candidates if c.form.name == "shear thinning with a plateau"}
    law = library.candidate(form, (45.0,))
    columns = library.model([law])
    free = np.linalg.lstsq(columns, library.target)[0]
    assert TWIN.viscous_nm_s_per_rad + free[1] < 0.0
    scored = Scored(law, np.asarray(free[-1:], dtype=np.float64), 1.0, library.errors([law]))
    model = fit_model(library, TWIN, [Term(scored, 0.0)])
    assert model.base["viscous_nm_s_per_rad"].value == pytest.approx(0.0)
    twin = extended_twin(library, TWIN, model)
    left_nm = left_by(twin, library.scene.table)[library.weighing.rows]
    assert np.std(left_nm) < 1.05 * np.std(model.residual_nm)


@pytest.mark.parametrize("size_nm", [0.0, 0.06])
def test_a_wave_of_many_periods_is_named_beside_what_has_no_name(size_nm: float) -> None:
    """Three quarters of a mismatch had no name, as a brake that drags once left a third."""

    def missing(points: SetPoints, at: Conditions) -> Floats:
        wave = size_nm * np.sin(24.0 * points.position_rad + 0.4)
        seconds = np.arange(points.velocity_rad_s.shape[0]) / 250.0
        # Nothing that was recorded goes along with it, and no law of the library does.
        drags = np.sin(2.0 * math.pi * np.cumsum(0.4 + 0.35 * np.sin(0.9 * seconds)) / 250.0)
        drags *= np.maximum(np.sin(0.31 * seconds + at.started_s), 0.0)
        return np.asarray(wave + 0.1 * drags)

    runs = [
        record(stair(SPEEDS, 90.0), missing, Conditions(started_s=600.0 * k), k, name=f"run {k}")
        for k in range(4)
    ]
    answer = explain(TWIN, runs[:3], runs[3:])
    if not size_nm:
        assert answer.verdict == "unexplained"
        return
    assert answer.verdict == "partly-explained"
    (wave,) = answer.findings
    assert (wave.effect, wave.rank) == ("torque-ripple", 1)
    assert wave.parameters["order_per_motor_rev"].value == pytest.approx(24.0, abs=0.05)


def test_laws_that_a_twin_takes_one_by_one_and_not_together_end_in_an_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A run-in and a warm torque constant left friction below zero: the user's twin was blamed."""

    def missing(points: SetPoints, at: Conditions) -> Floats:
        return thins(points, at) + 0.06 * np.sin(24.0 * points.position_rad)

    def one_alone(library: Library, twin: Twin, model: Model) -> Twin:
        if len(model.terms) > 1:
            raise DrivingFrictionError("effects: both leave friction below zero.")
        return extended_twin(library, twin, model)

    monkeypatch.setattr(named, "extended_twin", one_alone)
    table = tabulate(TWIN, [record(stair(SPEEDS), missing, Conditions(), 1)])
    assert len(study(TWIN, table).choice.terms) == 1
