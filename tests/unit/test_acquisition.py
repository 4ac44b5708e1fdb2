"""The account of a recording's frames: into the metadata and back, summed, and never wrong."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import pytest

from agent.acquisition import KEY, Acquisition, total
from agent.errors import InputError
from drivers.ports import SyncAccount

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
