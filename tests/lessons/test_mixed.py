"""Columns that are mixed of filtered parts are those that are filtered as a whole."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.explain.choosing.search import Library
from agent.explain.forms import cable, ripple
from agent.explain.forms.form import Form, Point
from agent.explain.forms.mixed import Mixed
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints

MIXED = [f for f in (*cable.FORMS, *ripple.FORMS) if isinstance(f.columns, Mixed)]


def a_cable(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.asarray(2e-4 * (points.position_rad - 30.0))


@cache
def scene() -> Scene:
    table = tabulate(TWIN, [record(stair((5.0, 20.0, 60.0)), a_cable, Conditions(), 1)])
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    return Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)


def point_of(form: Form, share: float) -> Point:
    """Return a point between the first and the last of the form's grid."""
    grid = np.array(form.grid(scene()))
    return tuple(grid[0] + share * (grid[-1] - grid[0])) if grid.shape[1] else ()


@pytest.mark.parametrize("form", MIXED, ids=lambda f: f"{f.effect}, {f.name}")
@settings(deadline=None, max_examples=8)  # the machine may be busy
@given(shares=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=3))
def test_mixing_filtered_parts_is_filtering_what_was_mixed(form: Form, shares: list[float]) -> None:
    library = Library.of(scene(), weigh(scene().table, scene().residual_nm), ())
    for share in shares:  # one library: a part is met again beside another point
        point = point_of(form, share)
        whole = library.weighing.weighted(scene().table.band(form.columns(scene(), point)))
        assert whole.shape[1] == len(form.linear)
        size = np.sqrt(np.mean(whole**2, axis=0))
        found = library.candidate(form, point).columns
        assert np.max(np.abs(found - whole) / size) < 1e-9


@given(share=st.floats(0.0, 1.0), stiffness=st.floats(0.0, 5.0), cubic=st.floats(0.0, 5.0))
def test_a_cable_that_stiffens_pulls_by_its_spring_and_cube_about_where_it_rests(
    share: float, stiffness: float, cubic: float
) -> None:
    (form,) = (f for f in cable.FORMS if f.name == "spring that stiffens")
    (rest,) = point_of(form, share)
    away = scene().arm_rad - rest
    pulls = form.columns(scene(), (rest,)) @ (stiffness, cubic)
    np.testing.assert_allclose(pulls, stiffness * away + cubic * away**3, atol=1e-9)
