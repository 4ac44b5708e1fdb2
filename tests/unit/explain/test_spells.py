"""What follows nothing that was recorded may come in spells: when they are is told."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from agent.explain.answer.as_if import in_spells
from agent.explain.answer.located import Spells
from agent.explain.location.spells import spells_of
from agent.explain.rows.table import Table, tabulate
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, nothing, record, stair

RUBS_S = {0: ((3.0, 4.2), (15.0, 16.0)), 1: ((8.5, 9.6),)}
RUB_NM = 0.15


@pytest.fixture(scope="module")
def table() -> Table:
    cycle = stair((3.0, 10.0, 30.0, 60.0), 200.0, 20.0)
    runs = [record(cycle, nothing, Conditions(), k, name=f"run-{k}") for k in range(2)]
    return tabulate(TWIN, runs, 20.0)


def left_of(table: Table, size_nm: float) -> tuple[NDArray[np.int64], Floats]:
    rows = np.flatnonzero(table.used)
    time_s, run = table.rows["time_s"][rows], table.run[rows]
    left: Floats = NOISE_NM * np.random.default_rng(1).standard_normal(rows.size)
    for index, spells in RUBS_S.items():
        for begin, end in spells:
            left[(run == index) & (time_s >= begin) & (time_s < end)] += size_nm
    return rows, left


def test_spells_are_told_with_their_recording_and_their_times(table: Table) -> None:
    found = spells_of(table, *left_of(table, RUB_NM), NOISE_NM, 1.0)
    assert found is not None
    told = {(name, round(begin), round(end)) for name, begin, end in found.at}
    assert told == {("run-0", 3, 4), ("run-0", 15, 16), ("run-1", 8, 10)}
    assert found.share > 0.9
    assert found.seconds < 0.2 * found.whole_s


@pytest.mark.parametrize("size_nm", [0.0, 0.1 * NOISE_NM])
def test_noise_has_no_spells(table: Table, size_nm: float) -> None:
    rows, left = left_of(table, size_nm)
    assert spells_of(table, rows, left, NOISE_NM, 1.0) is None


def test_what_is_there_all_along_comes_in_none(table: Table) -> None:
    rows, left = left_of(table, 0.0)
    assert spells_of(table, rows, 3.0 * left, NOISE_NM, 1.0) is None


def test_many_spells_are_counted_and_the_strongest_told() -> None:
    at = tuple((f"run-{k}", 3.0 * k, 3.0 * k + 1.25) for k in range(1, 6))
    assert in_spells(Spells(at, 0.92, 6.3, 101.0)) == (
        "It comes in 5 spells, the strongest at 3.00 to 4.25 s of run-1; 6.00 to 7.25 s of run-2; "
        "9.00 to 10.2 s of run-3. They hold 92 % of it in 6.3 of 101 s."
    )
    assert in_spells(Spells(at[:1], 0.92, 1.25, 101.0)).startswith("It comes in one spell, at 3.00")
