"""What enters a joint's history, and the sentence of each cycle that does not."""

from __future__ import annotations

import dataclasses
import math
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.monitor.detection.detectors import detector
from agent.monitor.history.cycle import Cycle, CycleCurve, Joint
from agent.monitor.history.events import Event, parse_events
from agent.monitor.history.history import JointHistory, histories
from agent.monitor.verdict.verdict import NOT_DECIDABLE, judge
from tests.unit.monitor.joint import DAY_S, JOINT, SPEEDS, START_S, months


def changed(cycles: list[Cycle], which: int, **changes: Any) -> list[Cycle]:
    return [dataclasses.replace(c, **changes) if i == which else c for i, c in enumerate(cycles)]


def only(cycles: list[Cycle], *events: Event) -> JointHistory:
    (history,) = histories(cycles, events)
    return history


def other_joint(cycles: list[Cycle]) -> list[Cycle]:
    """Return the same nights of another axis, with half of the friction."""
    joint = Joint(JOINT.robot, JOINT.axis + 1, JOINT.gear_ratio)
    return [
        dataclasses.replace(
            c,
            joint=joint,
            fingerprint=f"x{c.fingerprint}",
            curve=CycleCurve(SPEEDS, 0.5 * c.curve.friction_nm, c.curve.deviation_nm),
        )
        for c in cycles
        if c.curve is not None
    ]


@settings(max_examples=15, deadline=None)
@given(order=st.permutations(range(14)), wrong=st.sets(st.integers(0, 13), max_size=5))
def test_neither_order_nor_another_axis_changes_a_joint_s_history(
    order: list[int], wrong: set[int]
) -> None:
    cycles = months(3, 14)
    strangers = [c for i, c in enumerate(other_joint(cycles)) if i in wrong]
    alone = only(cycles)
    mixed = [cycles[i] for i in order]
    for place, stranger in enumerate(strangers):
        mixed.insert(3 * place, stranger)
    found = {h.joint: h for h in histories(mixed)}
    assert len(found) == 1 + bool(strangers)
    mine = found[JOINT]
    assert [c.name for c in mine.cycles] == [c.name for c in alone.cycles]
    assert all(
        np.array_equal(a.friction_nm, b.friction_nm)
        for a, b in zip(mine.features, alone.features, strict=True)
    )
    assert mine.segments == alone.segments


def test_another_gear_is_another_joint_and_the_few_are_told_of_the_many() -> None:
    cycles = changed(months(1, 10), 4, joint=Joint(JOINT.robot, JOINT.axis, 100.0))
    few, many = histories([*cycles, *other_joint(months(1, 10))])[:2]
    assert (len(few.cycles), len(many.cycles)) == (1, 9)
    assert f"have a gear ratio of {JOINT.gear_ratio:g}, 1 have this one: if it" in few.notes[-1]
    assert not any("gear ratio" in note for note in many.notes)


NOON_2026 = datetime(2026, 1, 1, 12, tzinfo=UTC).timestamp()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"started_s": math.nan}, "does not say when it started"),
        ({"started_s": 3600.0}, "clock was not set: started_at is 1970-01-01"),
        ({"started_s": START_S + 3 * DAY_S + 5.0}, "before cycle-0003.parquet had ended"),
        ({"started_s": START_S + 3 * DAY_S}, "at the same time as cycle-0003.parquet"),
        ({"temperature_degc": math.nan}, "no gearbox temperature, which 11 of 12 cycles have"),
        ({"curve": None, "reasons": ("one direction only",)}, "not decidable: one direction only"),
        (
            {"curve": CycleCurve(SPEEDS[2:6], np.full(4, 0.7), np.full(4, 0.01))},
            "does not cover the 2 to 140 rad/s",
        ),
        ({"parts": {"gearbox": "G9"}}, "another joint's cycle under this one's name"),
    ],
)
def test_a_cycle_that_does_not_count_has_its_sentence(
    changes: dict[str, Any], sentence: str
) -> None:
    history = only(changed(months(2, 12), 6, **changes))
    assert len(history.cycles) == 11
    (aside,) = history.set_aside
    assert aside.name == "cycle-0006.parquet"
    assert sentence in aside.reason
    assert len(history.segments) == 1


def test_a_copy_counts_once_whatever_its_clock_says() -> None:
    cycles = months(2, 12)
    copy = dataclasses.replace(cycles[4], name="copy.parquet", started_s=NOON_2026)
    history = only([copy, *cycles])
    assert [c.name for c in history.cycles] == [c.name for c in cycles]
    assert "same samples as cycle-0004.parquet" in history.set_aside[0].reason
    assert not any(
        "clock ran back" in note for note in history.notes
    )  # a copy's name tells nothing


def test_gaps_a_clock_that_ran_back_and_missing_temperatures_are_said() -> None:
    cycles = months(2, 30)
    late = [
        dataclasses.replace(
            c, started_s=c.started_s + 60 * DAY_S * (i > 20), temperature_degc=np.nan
        )
        for i, c in enumerate(cycles)
    ]
    late[25] = dataclasses.replace(late[25], started_s=START_S - 5 * DAY_S, payload_kg=np.nan)
    notes = " | ".join(only(late).notes)
    assert "the longest, 61 days" in notes
    assert "the clock ran back: by name cycle-0025.parquet follows cycle-0024.parquet" in notes
    assert "no cycle has a gearbox temperature" in notes
    assert "1 of 30 cycles do not say their payload" in notes


def test_a_longer_trajectory_is_compared_on_the_common_speeds() -> None:
    cycles = months(2, 12)
    speed = np.append(SPEEDS * 1.1, 200.0)
    wide = CycleCurve(np.append(1.9, speed), np.full(12, 0.7), np.full(12, 0.01))
    history = only(changed(cycles, 5, curve=wide, trajectory="longer"))
    assert len(history.cycles) == 12
    assert "1 of 12 cycles ran another trajectory" in history.notes[0]


def test_ordinary_work_without_a_low_speed_part_is_set_aside_and_refuses_no_other_joint() -> None:
    """Once it was an error of the whole call, about a bound that nobody had given."""
    cycles, fast = months(4, 12), slice(6, None)  # from 48 rad/s on, to 140
    work = [
        dataclasses.replace(
            c,
            joint=Joint("cell8", 2, 224.0),
            curve=CycleCurve(SPEEDS[fast], c.curve.friction_nm[fast], c.curve.deviation_nm[fast]),
        )
        for c in cycles
        if c.curve is not None
    ]
    stairs, ordinary = histories([*cycles, *work])
    assert len(stairs.cycles) == 12
    assert not ordinary.cycles
    assert all("it has no low-speed part" in s.reason for s in ordinary.set_aside)
    assert judge(ordinary, detector()).status == NOT_DECIDABLE


def test_events_start_a_new_baseline_wherever_they_are_written() -> None:
    cycles = months(5, 40)
    swapped = [
        dataclasses.replace(c, parts={"gearbox": "G2"} if i >= 10 else c.parts)
        for i, c in enumerate(cycles)
    ]
    oiled = [
        dataclasses.replace(c, oil="VG220" if i >= 20 else c.oil) for i, c in enumerate(swapped)
    ]
    greased = changed(oiled, 30, event="relubrication")
    written = parse_events(
        {
            "schema": "stribeck.events/1",
            "events": [
                {"at": datetime.fromtimestamp(START_S + 34.5 * DAY_S, UTC), "kind": "other"},
                {"at": "2023-01-01", "kind": "swap", "axis": JOINT.axis + 1},
            ],
        }
    )
    history = only(greased, *written)
    assert [(s.start, s.stop) for s in history.segments] == [
        (0, 10),
        (10, 20),
        (20, 30),
        (30, 35),
        (35, 40),
    ]
    labels = [s.events[0].label for s in history.segments[1:]]
    assert labels[0] == "swap (gearbox G1 to G2)"
    assert labels[1] == "oil change (VG150 to VG220)"
    assert labels[2:] == ["relubrication (as its recording says)", "work on the joint"]
    finding = judge(history, detector())
    assert finding.status == NOT_DECIDABLE
    assert "5 of 8 healthy cycles since the work on the joint" in finding.sentence


def test_a_history_without_a_usable_cycle_says_what_to_correct() -> None:
    history = only([dataclasses.replace(c, started_s=0.0) for c in months(1, 3)])
    finding = judge(history, detector())
    assert (finding.status, finding.comparison) == (NOT_DECIDABLE, None)
    assert finding.sentence == "Not decidable yet: no cycle is usable."
    assert "its clock" in finding.next_steps[0]


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        ({}, "expected schema"),
        ({"schema": "stribeck.events/1", "events": 3}, "expected \\[\\[events\\]\\] tables"),
        ({"schema": "stribeck.events/1", "events": [{"at": 3, "kind": "swap"}]}, "event 1: at"),
        ({"schema": "stribeck.events/1", "events": [{"at": "x", "kind": "swap"}]}, "event 1: at"),
        (
            {"schema": "stribeck.events/1", "events": [{"at": "2026-01-01", "kind": "party"}]},
            "kind must be one of swap, oil-change",
        ),
        (
            {"schema": "stribeck.events/1", "events": [{"at": "2026-01-01", "when": 1}]},
            "when is no key",
        ),
        (
            {
                "schema": "stribeck.events/1",
                "events": [{"at": "2026-01-01", "kind": "swap", "axis": "2"}],
            },
            "axis must be a whole number",
        ),
    ],
)
def test_an_events_file_that_is_wrong_says_where(document: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        parse_events(document)
