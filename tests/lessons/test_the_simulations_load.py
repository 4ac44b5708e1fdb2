"""Friction under load that only a recorded simulation has, where no speed is held.

No noise floor is known there: what has no name beside it is a little of all that was off, and no
reason to call wrong numbers, or friction along the path, what the simulation has too much.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.names import OWN_EFFECT
from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.identify.signals.simulated import simulated_torque_nm
from agent.physics.twin import Effect
from tests.science.textbook_joint import TWIN, Driven, nothing, recorded, waves

JOINT = replace(TWIN, gravity_sin_nm=1.8, coulomb_nm=0.25)
PER_LOAD, NOISE_NM = 0.15, 0.004
RUBS_UNDER_LOAD = Effect(
    "load-dependent-friction",
    {"load_coefficient": PER_LOAD, "arm_inertia_kg_m2": 0.0015, "arm_coulomb_nm": 0.0},
)


def swings(driven: Driven) -> Floats:
    """Return 9 Hz that comes and goes, and goes along with nothing that was recorded."""
    time = driven.time_s
    return np.asarray(0.012 * np.sin(2.0 * math.pi * 9.0 * time) * np.sin(0.7 * time))


def test_friction_under_load_that_only_the_simulation_has_is_told_beside_the_nameless() -> None:
    simulation = replace(JOINT, effects=(RUBS_UNDER_LOAD,))
    answers = []
    for extra in (nothing, swings):
        runs: list[Run] = []
        for seed in range(3):
            driven = waves(seed)
            run = recorded(driven, extra, NOISE_NM, seed, JOINT)
            position = {"position_rad": driven.position_rad}
            torque = simulated_torque_nm(simulation, run.signals, {**run.columns, **position})
            runs.append(replace(run, columns={**run.columns, "torque_simulated_nm": torque}))
        answers.append(explain(JOINT, runs[:2], runs[2:]))
    for answer in answers:
        found = answer.findings[0]
        assert answer.verdict in ("explained", "tied")
        assert not answer.floor.value_nm > 0.0
        assert (found.effect, found.form) == ("load-dependent-friction", OWN_EFFECT)
        assert found.parameters["load_coefficient"].value == pytest.approx(PER_LOAD, rel=0.05)
        assert "friction per load 0.15" in answer.sentence
