"""The account of a recording's frames: into the metadata and back, summed, and never wrong."""

from __future__ import annotations

import dataclasses
import json
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.acquisition import KEY, Acquisition, total
from agent.conclude.explanation import runs_of
from agent.conclude.outcome import signals_of
from agent.cycle.recorder import Recorder
from agent.cycle.stage import Step
from agent.errors import InputError
from agent.identify.signals.preprocess import left_out_of
from agent.record.recording import Metadata, Recording
from drivers.cia402.doubts import MOST, Doubts
from drivers.ports import Command, DriveState, Goal, Sample, SyncAccount, WatchdogProof

GOOD = Acquisition(
    expected=1000, received=990, lost=10, late=3, jitter_s=1e-4, dropped_by_kernel=4, not_asked=7
)


def test_the_drivers_account_survives_the_metadata() -> None:
    account = SyncAccount(expected=5, received=4, lost=1, dropped_by_kernel=2, reader="process")
    written = json.loads(json.dumps({KEY: Acquisition(**dataclasses.asdict(account)).to_json()}))
    found = Acquisition.from_metadata(written, "it")
    assert found is not None
    assert dataclasses.asdict(found) == dataclasses.asdict(account)


@pytest.mark.parametrize(
    "document", [{}, {KEY: "1 kHz"}, {KEY: {"expected": 3}}, {KEY: {"schema": "other/1"}}]
)
def test_what_is_not_ours_is_left_alone(document: dict[str, Any]) -> None:
    assert Acquisition.from_metadata(document, "it") is None


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"lost": -1}, "lost must not be below zero"),
        ({"received": 1001}, "more than the 1000"),
        ({"jitter_s": float("nan")}, "jitter_s must not"),
        ({"expected": "many"}, "cannot be right"),
        ({"doubtful_s": [[2.0, 1.0]]}, "from 0 on"),
        ({"doubtful_s": [3.0]}, "cannot be right"),
    ],
)
def test_an_account_that_cannot_be_right_is_refused(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Acquisition.from_metadata({KEY: {**GOOD.to_json(), **changes}}, "it")


def test_what_the_kernel_dropped_explains_as_many_samples_and_no_more() -> None:
    assert GOOD.lost_unexplained == 6
    assert dataclasses.replace(GOOD, dropped_by_kernel=500).lost_unexplained == 0
    assert dataclasses.replace(GOOD, dropped_by_kernel=None).lost_unexplained == 10


def test_the_sum_knows_no_more_than_its_parts() -> None:
    both = total([GOOD, dataclasses.replace(GOOD, jitter_s=2e-4)])
    assert both is not None
    assert (both.expected, both.received, both.lost, both.dropped_by_kernel) == (2000, 1980, 20, 8)
    assert both.jitter_s == 2e-4
    unknown = total([GOOD, dataclasses.replace(GOOD, dropped_by_kernel=None)])
    assert unknown is not None
    assert unknown.dropped_by_kernel is None
    assert total([]) is None


@given(
    seed=st.integers(0, 1000),
    count=st.sampled_from((1, 30, MOST, 3 * MOST)),
    lasts=st.integers(0, 5),
)
@settings(max_examples=10)
def test_doubtful_rows_stay_located_however_many_they_are(
    seed: int, count: int, lasts: int
) -> None:
    """In a recording whose first row is the thousandth that the drive was asked for."""
    begun = random.Random(seed).sample(range(20_000), count)
    doubts = Doubts()
    for first in begun:
        doubts.add(float(first), float(first + lasts))
    rows: list[Sequence[float | str]] = []
    recorder = Recorder(_Rows(rows), with_temperature=False, with_probe=False)
    recorder.sent(1000.0, Step(Command(Goal.ON, 0.0), "stair", 0.0))
    recorder.keep([Sample(1000.0, 1000.0, 0.0, 0.0, 0.0, 0.0, DriveState.ON, False)])
    assert rows[0][0] == 0.0
    account = recorder.located(SyncAccount(doubtful_s=doubts.spans()))
    written = json.loads(json.dumps({KEY: Acquisition(**dataclasses.asdict(account)).to_json()}))
    found = Acquisition.from_metadata(written, "it")
    assert found is not None
    assert found.doubtful_s is not None
    assert len(found.doubtful_s) <= MOST
    held = set(np.flatnonzero(found.doubts(np.arange(0.0, 20_000.0))).tolist())
    wanted = {first + k - 1000 for first in begun for k in range(lasts + 1)} & set(range(20_000))
    assert held >= wanted
    if len(begun) <= MOST:
        assert held == wanted


@pytest.mark.parametrize("located", [True, False])
def test_every_reader_leaves_out_what_a_recording_calls_doubtful(located: bool) -> None:
    """One of an earlier version says only how many they are: then they stay."""
    time_s = np.arange(0.0, 1.0, 0.002)
    spans = ((0.1, 0.15), (0.9, 2.0)) if located else None
    account = Acquisition(500, 500, 0, doubtful=76, doubtful_s=spans)
    names = ("position_rad", "velocity_rad_s", "torque_nm")
    recording = Recording(
        {"time_s": time_s, **dict.fromkeys(names, np.sin(time_s))},
        Metadata("it", 1, 100.0, extra={KEY: account.to_json()}),
    )
    left_out = account.doubts(time_s)
    assert left_out.sum() == (76 if located else 0)
    (run,) = runs_of([recording])
    for signals in (signals_of(recording), run.signals):
        np.testing.assert_array_equal(signals.valid, ~left_out)
        np.testing.assert_array_equal(np.isnan(signals.torque_nm), left_out)
        assert bool(left_out_of(signals)) is located
    assert recording.masked == 0  # and the recording keeps them


class _Rows:
    """Keeps rows, and is no file."""

    def __init__(self, rows: list[Sequence[float | str]]) -> None:
        self.append = rows.append

    def wait_for_disk(self) -> None:
        pass

    def note(self, proof: WatchdogProof) -> None:
        raise NotImplementedError

    def finish(self, *, account: SyncAccount | None, stopped_because: str) -> Path | None:
        raise NotImplementedError
