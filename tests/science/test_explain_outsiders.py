"""What is in no library: located, and called by no name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.findings import findings_of
from agent.explain.numbers.borne_out import borne_out
from agent.explain.numbers.model import fit_model
from agent.explain.numbers.wrong import WrongNumber
from agent.explain.rows.table import BASE, tabulate
from agent.explain.study import Study, study
from agent.explain.unnamed import unnamed
from agent.explain.verdict import left_share, verdict_of
from agent.identify.result import Floats, Parameter
from tests.science.explain_joint import (
    NOISE_NM,
    TWIN,
    Conditions,
    Missing,
    library_of,
    record,
    stair,
)
from trajectories import SetPoints


def churning(points: SetPoints, at: Conditions) -> Floats:
    """Return friction that is higher in one band of speeds."""
    del at
    speed = np.abs(points.velocity_rad_s)
    bell = np.exp(-(((speed - 35.0) / 9.0) ** 2))
    return np.asarray(0.25 * bell * np.sign(points.velocity_rad_s))


def humming(points: SetPoints, at: Conditions) -> Floats:
    """Return mains in the torque, above the band of the comparison."""
    del at
    time = np.arange(points.velocity_rad_s.shape[0]) / 250.0
    return np.asarray(0.03 * np.sin(2.0 * np.pi * 50.0 * time))


def studied(missing: Missing) -> Study:
    cycle = stair([4.0, 12.0, 25.0, 35.0, 48.0, 90.0])
    return study(TWIN, tabulate(TWIN, [record(cycle, missing, Conditions(), 4)]))


@pytest.mark.parametrize(
    ("missing", "axis"), [(churning, "velocity_rad_s"), (humming, "frequency_hz 50")]
)
def test_what_no_law_carries_is_unexplained_and_located(missing: Missing, axis: str) -> None:
    found = studied(missing)
    findings = findings_of(found)
    assert verdict_of(found, findings, left_share(found)) == "unexplained"
    first = next(cell for cell in found.cells if cell.counts)
    assert first.axis == axis
    told = unnamed(found)  # no law that is not named stays in a number, or in the twin
    assert told.extended.effects == ()
    assert left_share(told) == 1.0


def test_what_has_no_name_may_have_bent_numbers_and_makes_none_of_them_wrong() -> None:
    """Friction that was higher after every rest was three wrong numbers, one that may be right."""
    library = library_of([record(stair([12.0, 35.0, 90.0]), churning, Conditions(), 4)])
    model = fit_model(library, TWIN, ())
    # The simulation as given lacks half of the inertia, far more than what stays without a name.
    lacks = 0.5 * TWIN.inertia_kg_m2 * library.base[:, BASE.index("inertia_kg_m2")]
    off = replace(library, target=library.target + lacks)
    right, small, wrong = (
        WrongNumber("wrong-number", 1.0, {"coulomb_extra_nm": Parameter(0.1, (-0.1, 0.3))}),
        WrongNumber("gravity-imbalance", 0.08, {"gravity_sin_nm": Parameter(0.2, (0.1, 0.3))}),
        WrongNumber("inertia-error", 1.0, {"inertia_extra_kg_m2": Parameter(0.02, (0.01, 0.03))}),
    )
    assert borne_out((right, small, wrong), off, model, NOISE_NM) == (wrong,)
    assert borne_out((right, small, wrong), library, model, NOISE_NM) == ()  # no more than stays
    noisy = float(np.sqrt(np.mean(model.residual_nm**2)))  # then nothing stays beside them
    assert borne_out((right, small, wrong), off, model, noisy) == (right, small, wrong)
