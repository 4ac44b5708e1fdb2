"""A simulation that is wildly off, or knows what nobody knows, is told as that."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from agent.conclude.explanation import explained
from agent.errors import InputError
from agent.explain.asked import tabulated
from agent.explain.rows.table import tabulate
from agent.physics.twin import Effect
from agent.report.advice import next_steps
from tests.science.explain_joint import TWIN, Conditions, nothing, record, stair


def test_an_inertia_in_another_unit_leaves_the_band_as_it_is() -> None:
    run = record(stair((2.0, 6.0, 20.0)), nothing, Conditions(), 0)
    far = replace(TWIN, inertia_kg_m2=1e3 * TWIN.inertia_kg_m2)
    right_hz, far_hz = (tabulated(twin, [run], [])[1].cutoff_hz for twin in (TWIN, far))
    assert far_hz == pytest.approx(right_hz, rel=0.02)
    assert tabulate(far, [run]).cutoff_hz < 0.2 * right_hz  # in which next to nothing is seen


@pytest.mark.parametrize(
    ("effect", "why"),
    [
        (Effect("magic", {}), "no torque law predicts magic"),
        (Effect("stribeck", {"static_extra_nm": 0.1}), "stribeck_velocity_rad_s"),
    ],
)
def test_a_twin_whose_effects_nobody_can_predict_is_refused(effect: Effect, why: str) -> None:
    with pytest.raises(InputError, match=f"x.toml: effects: .*{why}"):
        explained(replace(TWIN, effects=(effect,)), Path("x.toml"), [], [])


def test_advice_begins_with_what_there_is_to_do() -> None:
    check, again = next_steps(["torque and velocity have opposite signs"])
    assert "signs" in check
    assert again.startswith("Then record")
    assert next_steps([]) == ("Record" + again.removeprefix("Then record"),)
