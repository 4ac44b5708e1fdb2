"""Ten million rows are estimated in the memory of a usual computer: copies of all rows are few."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from agent.identify.rigid.carried import variance_inflation
from agent.identify.signals.arrays import Signals
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.sampling import Stretch
from agent.identify.signals.windows import find_windows
from agent.identify.uncertainty import block_jackknife
from agent.monitor.ordinary.swinging import _spectrum, swinging_of

ROWS = 160_000


def bytes_a_row(work: Callable[[], object]) -> float:
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / ROWS
    finally:
        tracemalloc.stop()


def test_what_is_done_to_every_row_takes_little_beside_the_rows() -> None:
    columns = np.random.default_rng(1).standard_normal((ROWS, 6))
    blocks = np.arange(ROWS, dtype=np.int64) // 2000
    # Every row's outer product took 290 bytes, all rows of a filter side by side 300.
    assert bytes_a_row(lambda: block_jackknife(columns, columns[:, 0], blocks)) < 24.0
    assert bytes_a_row(lambda: variance_inflation(columns)) < 8.0
    rows = np.ascontiguousarray(np.column_stack((columns, columns[:, :2])).T)
    assert bytes_a_row(lambda: lowpass(rows, 1e-3, 20.0)) < 64.0 + 48.0


def test_a_row_is_filtered_alike_whether_alone_or_among_many() -> None:
    rows = np.random.default_rng(2).standard_normal((8, ROWS))
    np.testing.assert_array_equal(lowpass(rows, 1e-3, 20.0)[3], lowpass(rows[3], 1e-3, 20.0))


def test_short_moves_are_steady_in_a_long_recording_as_well() -> None:
    # Of 500 s, 2500 blocks were 0.2 s long each: too coarse for moves of two seconds.
    time_s = np.arange(50_000) / 100.0
    moves = np.random.default_rng(3).uniform(5.0, 80.0, 250) * np.resize([1.0, -1.0], 250)
    begin = 2.0 * np.arange(250)
    ends = np.column_stack((begin + 0.3, begin + 1.9)).ravel()
    velocity = np.interp(time_s, ends, np.repeat(moves, 2))
    columns = {"time_s": time_s, "torque_nm": np.sign(velocity), "velocity_rad_s": velocity}
    assert len(find_windows(read_motion(Signals.from_columns(columns, 100.0)))) > 240


def test_the_work_on_thousands_of_moves_grows_with_them_not_with_their_square(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # All of the recording was copied once a move, and searched for a swinging arm at full rate: of
    # ten million rows and five thousand moves, ordinary work came to no end.
    time_s = np.arange(60_000) / 1000.0
    velocity = 20.0 * np.sin(3.0 * time_s) + np.sign(np.sin(np.pi * time_s))
    torque = np.sign(velocity) + 0.01 * velocity + 0.02 * np.gradient(velocity, 1e-3)
    columns = {"time_s": time_s, "torque_nm": torque, "velocity_rad_s": velocity}
    motion = read_motion(Signals.from_columns(columns, 100.0))
    searched: list[int] = []

    def spectrum(thinned: Any) -> Any:
        searched.append(thinned.usable.size)
        return _spectrum(thinned)

    monkeypatch.setattr("agent.monitor.ordinary.swinging._spectrum", spectrum)
    assert swinging_of([motion]) is not None
    assert max(searched) < 15_000

    held = np.repeat(np.resize([5.0, -5.0, 20.0, -20.0], 30), 2000)
    columns = {"time_s": time_s, "torque_nm": np.sign(held), "velocity_rad_s": held}
    motion = read_motion(Signals.from_columns(columns, 100.0))
    copies: list[int] = []
    on_grid = Stretch.on_grid

    def copied(*of: Any) -> Any:
        copies.append(1)
        return on_grid(*of)

    monkeypatch.setattr(Stretch, "on_grid", copied)
    assert len(find_windows(motion)) > 20
    assert len(copies) == 1
