"""A torque that is late beside a velocity that is late itself: told against the position."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from agent.explain.explain import explain
from agent.explain.left import Left
from agent.explain.numbers.late_velocity import (
    ToldAgainstItError,
    is_much,
    later_than_usual,
)
from agent.explain.rows.table import Table, tabulate
from agent.explain.study import study
from tests.unit.explain.test_alignment import LATE_S, TWIN, run


def test_a_torques_delay_is_told_against_the_position() -> None:
    """It was 0.5 ms less, as much as the velocity is late, with an interval beside the truth."""
    late_s = 5e-3
    runs = [run(0.01, with_position=True, seed=seed, late_s=late_s) for seed in range(5)]
    answer = explain(TWIN, runs[:4], runs[4:])
    assert [f.effect for f in answer.findings] == ["measurement-delay"]
    delay = answer.findings[0].parameters["torque_delay_s"]
    assert delay.value == pytest.approx(late_s, abs=0.2 * LATE_S)
    assert delay.ci95 is not None
    assert delay.ci95[0] - 0.05 * LATE_S < late_s < delay.ci95[1] + 0.05 * LATE_S
    assert any(
        "0.5 ms later than the position: it was brought in step" in r for r in answer.reasons
    )


def test_what_is_asked_again_in_step_is_not_asked_to_the_end_before() -> None:
    """It took such an explanation twice as long as any other."""
    runs = [run(0.01, with_position=True, seed=seed, late_s=4e-3) for seed in range(4)]
    table = tabulate(TWIN, runs, 40.0, align_velocity=False)
    assert table.velocity_late_s == pytest.approx(LATE_S, rel=0.05)
    with pytest.raises(ToldAgainstItError):
        study(TWIN, replace(table, in_step_for_a_delay=True))


@pytest.mark.parametrize(
    ("late_s", "over_floor", "hides"), [(3e-3, 3.0, True), (3e-3, 1.0, False), (1e-3, 3.0, False)]
)
def test_a_velocity_far_too_late_is_brought_in_step_where_more_than_noise_is_left(
    late_s: float, over_floor: float, hides: bool
) -> None:
    """It had no name beside a swing forty times as great, whose spring was a tenth too soft."""
    left = cast("Left", SimpleNamespace(over_floor=over_floor, without_measure=False))
    pieces = (SimpleNamespace(period_s=2e-3),)
    table = SimpleNamespace(velocity_late_s=late_s, aligned=False, pieces=pieces)
    assert (is_much(left) and later_than_usual(cast("Table", table))) is hides
