"""Viscous friction of "-0.21, not 1.90" was told for certain, beside a drag that had bent it."""

from __future__ import annotations

import pytest

from agent.explain.numbers.wrong import WrongNumber, possible_ones
from agent.identify.result import Parameter
from tests.science.explain_joint import TWIN

COULOMB, VISCOUS = TWIN.coulomb_nm, TWIN.viscous_nm_s_per_rad


@pytest.mark.parametrize(
    ("extra", "found", "is_told"),
    [
        ("viscous_extra_nm_s_per_rad", Parameter(-1.1 * VISCOUS, (-1.2 * VISCOUS, -VISCOUS)), True),
        (
            "viscous_extra_nm_s_per_rad",
            Parameter(-1.2 * VISCOUS, (-1.3 * VISCOUS, -1.1 * VISCOUS)),
            False,
        ),
        ("coulomb_extra_nm", Parameter(-1.2 * COULOMB, (-1.3 * COULOMB, -1.1 * COULOMB)), False),
        ("gravity_sin_nm", Parameter(-1.0, (-1.1, -0.9)), True),
        ("factor", Parameter(0.9, (0.89, 0.91)), True),
    ],
)
def test_no_inertia_or_friction_is_told_that_is_surely_below_zero(
    extra: str, found: Parameter, is_told: bool
) -> None:
    number = WrongNumber("wrong-number", 1.0, {extra: found})
    assert possible_ones([number], TWIN) == ((number,) if is_told else ())
