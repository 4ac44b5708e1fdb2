"""A torque that is late beside a velocity that is late itself: told against the position."""

from __future__ import annotations

from dataclasses import replace

import pytest

from agent.explain.explain import explain
from agent.explain.numbers.late_velocity import ToldAgainstItError
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from tests.unit.explain.test_alignment import LATE_S, TWIN, run


@pytest.mark.parametrize("late_s", [5e-3, 3e-3])
def test_a_torques_delay_is_told_against_the_position(late_s: float) -> None:
    """It was 0.5 ms less, as much as the velocity is late, with an interval beside the truth."""
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
