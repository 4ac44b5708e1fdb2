"""A reading that ends at its range, with no command recorded: the motion goes on, and shows it."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.run import Run
from tests.science.textbook_joint import TWIN, nothing, recorded, stair

SPEEDS_RAD_S = (4.0, 8.0, 15.0, 28.0, 50.0)


def runs(limit_nm: float) -> list[Run]:
    """Return runs whose torque, before its noise, is reported no greater than this."""
    noise = np.random.default_rng(0)
    out = []
    for seed, k in enumerate((1.0, 1.07, 1.15, 0.93)):
        run = recorded(stair([k * v for v in SPEEDS_RAD_S]), nothing, 0.0, seed)
        torque = np.clip(run.signals.torque_nm, -limit_nm, limit_nm)
        columns = {
            "time_s": run.signals.time_s,
            "position_rad": np.asarray(run.signals.position_rad),
            "velocity_rad_s": np.asarray(run.signals.velocity_rad_s),
            "torque_nm": torque + 0.004 * noise.standard_normal(torque.shape[0]),
        }
        out.append(Run.from_columns(columns, TWIN.gear_ratio, name=run.name))
    return out


def test_the_limit_is_named_and_measured() -> None:
    *fit, held_out = runs(1.1)
    answer = explain(TWIN, fit, [held_out])
    (finding,) = answer.findings
    assert finding.effect == "torque-saturation"
    assert finding.parameters["limit_nm"].value == pytest.approx(1.1, rel=0.01)
    assert "the reading is clipped" in answer.sentence
    assert "no effect of the library" not in answer.sentence


def test_a_torque_that_is_greatest_where_it_is_steady_is_no_limit() -> None:
    *fit, held_out = runs(2.0)
    assert explain(TWIN, fit, [held_out]).verdict == "no-mismatch"
