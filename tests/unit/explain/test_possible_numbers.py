"""Viscous friction of "-0.21, not 1.90" was told for certain, beside a drag that had bent it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from agent.explain.numbers.borne_out import below_zero
from agent.explain.numbers.wrong import WrongNumber
from agent.explain.plausible import below_zero_said
from agent.identify.result import Parameter
from tests.science.explain_joint import TWIN

COULOMB, VISCOUS = TWIN.coulomb_nm, TWIN.viscous_nm_s_per_rad
NEGATIVE = Parameter(-1.2 * VISCOUS, (-1.3 * VISCOUS, -1.1 * VISCOUS))


def left(times_the_noise: float) -> Any:
    """Return a model of noise of one newton metre, as far as it is asked here."""
    return SimpleNamespace(residual_nm=times_the_noise * np.ones(9))


@pytest.mark.parametrize(
    ("extra", "found", "is_one"),
    [
        ("viscous_extra_nm_s_per_rad", NEGATIVE, True),
        (
            "viscous_extra_nm_s_per_rad",
            Parameter(-1.1 * VISCOUS, (-1.2 * VISCOUS, -VISCOUS)),
            False,
        ),
        ("coulomb_extra_nm", Parameter(-1.2 * COULOMB, (-1.3 * COULOMB, -1.1 * COULOMB)), True),
        ("gravity_sin_nm", Parameter(-1.0, (-1.1, -0.9)), False),
        ("factor", Parameter(0.9, (0.89, 0.91)), False),
    ],
)
def test_no_inertia_or_friction_of_a_joint_is_surely_below_zero(
    extra: str, found: Parameter, is_one: bool
) -> None:
    number = WrongNumber("wrong-number", 1.0, {extra: found})
    assert below_zero([number], TWIN, left(2.4), 1.0) == ((number,) if is_one else ())
    # With nothing left to bend it, the level beside a viscosity is wrong all the same.
    always = is_one and extra != "viscous_extra_nm_s_per_rad"
    assert below_zero([number], TWIN, left(1.0), 1.0) == ((number,) if always else ())


def test_what_comes_out_below_zero_is_said_and_not_told_wrong() -> None:
    parameters = {
        "coulomb_extra_nm": Parameter(0.2, (0.1, 0.3)),
        "viscous_extra_nm_s_per_rad": NEGATIVE,
    }
    said = below_zero_said([WrongNumber("wrong-number", 1.0, parameters)], TWIN)
    assert said.startswith("refitted, the simulation's viscous friction comes out below zero")
    assert not below_zero_said([], TWIN)
