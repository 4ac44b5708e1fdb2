"""Coulomb and viscous friction, freed together, were told for certain where a law is as likely.

A fall with speed of a third of the noise, most of which the two take up: what they leave is hardly
more than noise, both intervals reach over what the twin says, and the law alone leaves less.
"""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.numbers.instead import with_laws_instead
from agent.explain.numbers.wrong import WrongNumber
from agent.explain.rows.table import tabulate
from agent.explain.study import Study, study
from agent.identify.result import Floats, Parameter
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints


def falls_with_speed(points: SetPoints, at: Conditions) -> Floats:
    del at
    speed = points.velocity_rad_s
    return np.asarray(0.1 * np.exp(-np.abs(speed) / 10.0) * np.sign(speed))


def is_higher(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.asarray(0.06 * np.sign(points.velocity_rad_s))


def told(found: Study, ends_nm: tuple[float, float]) -> tuple[WrongNumber, ...]:
    number = WrongNumber("wrong-number", 1.0, {"coulomb_extra_nm": Parameter(0.05, ends_nm)})
    return with_laws_instead([number], found.library)


@pytest.mark.parametrize(
    ("ends_nm", "others"), [((-0.1, 0.2), {"stribeck", "viscous-nonlinear"}), ((0.01, 0.2), set())]
)
def test_numbers_that_are_not_known_by_themselves_are_tied_with_the_law_that_does_as_well(
    ends_nm: tuple[float, float], others: set[str]
) -> None:
    run = record(stair((3.0, 10.0, 30.0, 60.0)), falls_with_speed, Conditions(), 1)
    (number,) = told(study(TWIN, tabulate(TWIN, [run])), ends_nm)
    assert set(number.alternatives) <= others
    assert bool(number.alternatives) == bool(others)
    assert all(chance <= 0.5 for chance in number.alternatives.values())


def test_a_level_that_is_wrong_is_told_for_certain() -> None:
    """A law can copy it, too; but its interval leaves out what the twin says."""
    run = record(stair((3.0, 10.0, 30.0, 60.0)), is_higher, Conditions(), 1)
    (number,) = study(TWIN, tabulate(TWIN, [run])).numbers
    assert not number.alternatives
