"""A torque constant beside a law, too little to be told as a wrong number, is said all the same."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from agent.explain.off_alike import off_alike_said
from agent.identify.result import Parameter
from tests.science.explain_joint import TWIN

GIVEN = {
    name: float(getattr(TWIN, name))
    for name in (
        "inertia_kg_m2",
        "viscous_nm_s_per_rad",
        "coulomb_nm",
        "gravity_sin_nm",
        "gravity_cos_nm",
    )
}


def study(factors: tuple[float, float, float], *, named: bool = True, told: bool = False) -> Any:
    """Return a study as far as it is asked: three numbers found, each known to half a percent."""
    base = {
        name: Parameter(by * GIVEN[name], ((by - 0.005) * GIVEN[name], (by + 0.005) * GIVEN[name]))
        for name, by in zip(GIVEN, (*factors, 1.0, 1.0), strict=True)
    }
    choice = SimpleNamespace(terms=("a law",) if named else ())
    numbers = ("a number",) if told else ()
    return SimpleNamespace(
        twin=TWIN, model=SimpleNamespace(base=base), choice=choice, numbers=numbers
    )


@pytest.mark.parametrize(
    ("found", "is_said"),
    [
        (study((1.07, 1.07, 1.072)), True),
        (study((1.07, 1.07, 1.0)), False),
        (study((1.01, 1.01, 1.01)), False),  # no drive knows its torque to a percent
        (study((1.07, 1.07, 1.07), named=False), False),  # without a law it is told
        (study((1.07, 1.07, 1.07), told=True), False),
    ],
)
def test_numbers_that_all_moved_alike_beside_a_law_are_said_to_be_so(
    found: Any, is_said: bool
) -> None:
    said = off_alike_said(found)
    assert bool(said) is is_said
    if is_said:
        assert "7 % larger" in said
        assert "times 0.93" in said
