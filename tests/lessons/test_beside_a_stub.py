"""A recorded simulation beside a twin.toml that only says which gear there is.

Whoever questions another program's simulation need not have its numbers in a file. A joint without
friction was no joint then: what yields had no name, or the explanation ended in an error.
"""

from __future__ import annotations

from dataclasses import replace

from agent.explain.explain import explain
from agent.identify.signals.simulated import simulated_torque_nm
from tests.science.explain_joint import TWIN, Conditions, record, stair, yields

STUB = replace(TWIN, inertia_kg_m2=1e-4, coulomb_nm=0.0, viscous_nm_s_per_rad=0.0)
SPEEDS_RAD_S = (2.0, 4.0, 8.0, 16.0, 30.0, 50.0)


def test_a_simulation_is_questioned_whatever_twin_stands_beside_it() -> None:
    runs = [record(stair(SPEEDS_RAD_S), yields, Conditions(), seed) for seed in range(2)]
    beside = []
    for run in runs:
        torque_nm = simulated_torque_nm(TWIN, run.signals, run.columns)
        columns = {**run.columns, "torque_simulated_nm": torque_nm}
        beside.append(replace(run, columns=columns))
    answer = explain(STUB, beside)
    assert [f.effect for f in answer.findings] == ["presliding-hysteresis"]
    assert any("read off it" in reason for reason in answer.reasons)
    # What comes out is a twin of the joint: given back, it agrees with what was measured.
    assert answer.twin is not None
    assert explain(answer.twin, runs).verdict == "no-mismatch"
