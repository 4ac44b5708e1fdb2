"""What is left after an answer: louder noise goes along no axis."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from agent.explain.answer.result import Cell, Floor
from agent.explain.left import Left
from agent.explain.rows.table import Table
from tests.science.explain_joint import Conditions, library_of, nothing, record, stair


@pytest.mark.parametrize(
    ("gain", "counts", "noise"),
    [(0.02, True, True), (0.25, False, True), (0.25, True, False)],
)
def test_what_a_number_that_varies_carries_is_no_louder_noise(
    monkeypatch: pytest.MonkeyPatch, gain: float, counts: bool, noise: bool
) -> None:
    """Short and even it may be all the same: starts are over in a tenth of a second."""
    monkeypatch.setattr("agent.explain.left.is_noise_in_kind", lambda *_: True)
    monkeypatch.setattr("agent.explain.left.usual_rows", lambda _, rows: np.ones(rows.shape, bool))
    left_nm = 0.013 * np.resize([1.0, -1.0], 2000)
    cells = (Cell("viscous_nm_s_per_rad", "velocity_rad_s", gain, 1e-6, counts),)
    table, rows = cast(Table, None), np.arange(left_nm.shape[0])
    left = Left(table, rows, left_nm, Floor(0.01, 0.01, 0.01, 0.01), cells, ())
    assert left.louder_noise == noise
    assert left.ratio == (1.0 if noise else pytest.approx(1.3))


@pytest.mark.parametrize(("lasts_s", "brief"), [(0.03, True), (3.0, False)])
def test_blows_are_brief_and_slow_noise_is_not(lasts_s: float, brief: bool) -> None:
    """What a gap's teeth left was told to be like slow noise."""
    scene = library_of([record(stair((6.0, 20.0, 50.0), 200.0), nothing, Conditions(), 0)]).scene
    table, rows = scene.table, np.flatnonzero(scene.table.used)
    time_s = table.rows["time_s"][rows]
    left_nm = np.where(time_s % (8.0 * lasts_s) < lasts_s, 0.1, 0.0)
    left = Left(table, rows, left_nm, Floor(0.01, 0.01, 0.01, 0.01), (), ())
    assert left.is_brief is brief
