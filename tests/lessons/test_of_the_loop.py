"""What a recorded simulation does that moved otherwise than the joint is none of the joint's."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import bilinear, lfilter

from agent.explain.carrying import studied
from agent.explain.findings import findings_of
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.explain.surroundings import of_the_simulation, simulations_sentence
from agent.explain.told import Told
from agent.explain.written_down import nothing_decided
from agent.identify.result import Floats
from agent.identify.signals.simulated import simulated_torque_nm
from agent.physics.effects.library import CARRIED
from tests.science.explain_joint import RATE_HZ, TWIN, Conditions, Missing, record, stair, yields
from trajectories import SetPoints

CYCLE = stair((4.0, 12.0, 25.0, 45.0, 70.0))
LOOP_RAD_S, DAMPING = 2.0 * math.pi * 18.0, 0.35
HELD_BACK_RAD_S2, CATCHES_UP_S = 60.0, 0.02


def through_the_loop(values: Floats) -> Floats:
    """Return what a position loop of 18 Hz makes of a command, shape (n,)."""
    square = LOOP_RAD_S**2
    b, a = bilinear([square], [1.0, 2.0 * DAMPING * LOOP_RAD_S, square], RATE_HZ)
    return np.asarray(lfilter(b, a, values - values[0]) + values[0])


def simulated(seed: int, *, in_a_loop: bool) -> Run:
    """Return a joint with an arm on a spring, and its simulation's torque, without that arm."""

    def swings(points: SetPoints, at: Conditions) -> Floats:
        del at
        rest = 0.5 * TWIN.inertia_kg_m2 * points.acceleration_rad_s2
        return np.zeros_like(rest) if in_a_loop else through_the_loop(rest) - rest

    run = record(CYCLE, swings, Conditions(started_s=100.0 * seed), seed)
    asked = CYCLE.sample(run.signals.time_s)
    position, velocity, acceleration = (
        through_the_loop(values) if in_a_loop else values
        for values in (asked.position_rad, asked.velocity_rad_s, asked.acceleration_rad_s2)
    )
    torque = TWIN.predict_torque(position, velocity, acceleration, np.sign(velocity))
    return replace(run, columns={**run.columns, "torque_simulated_nm": torque})


@pytest.mark.parametrize("in_a_loop", [False, True])
def test_a_simulations_own_swing_is_told_from_the_joints(in_a_loop: bool) -> None:
    runs = [simulated(seed, in_a_loop=in_a_loop) for seed in range(3)]
    found = study(TWIN, tabulate(TWIN, runs))
    findings = findings_of(found)
    arms = [finding for finding in findings if finding.effect in CARRIED]
    assert arms
    own = of_the_simulation(found.library, found.choice, findings)
    assert own == (tuple(arms) if in_a_loop else ())
    for arm in own:
        assert "is the simulation's own: its torque, and not the recorded" in simulations_sentence(
            arm, ()
        )


def catches_up(points: SetPoints, at: Conditions) -> Floats:
    """Return what the inertia asks for where a joint starts late, and catches up with its command.

    It sums to nothing: before and after it the joint is as fast as it is told to be.
    """
    del at
    way = np.sign(points.velocity_rad_s)
    time, out = np.arange(way.shape[0]) / RATE_HZ, np.zeros_like(way)
    for start in np.flatnonzero((way[1:] != way[:-1]) & (way[1:] != 0.0)) + 1:
        since = (time[start:] - time[start]) / CATCHES_UP_S
        out[start:] -= way[start] * (1.0 - since) * np.exp(-since)
    return np.asarray(-TWIN.inertia_kg_m2 * HELD_BACK_RAD_S2 * out)


@pytest.mark.parametrize(("missing", "is_its_own"), [(catches_up, True), (yields, False)])
def test_what_sums_to_nothing_after_a_start_is_no_friction(
    missing: Missing, is_its_own: bool
) -> None:
    runs = []
    for seed in range(2):
        run = record(CYCLE, missing, Conditions(), seed)
        torque = simulated_torque_nm(TWIN, run.signals, run.columns)
        runs.append(replace(run, columns={**run.columns, "torque_simulated_nm": torque}))
    found, given = studied(TWIN, tabulate(TWIN, runs), {"presliding-hysteresis"})
    findings = findings_of(found)
    assert [finding.effect for finding in findings] == ["presliding-hysteresis"]
    own = of_the_simulation(found.library, found.choice, findings)
    assert bool(own) is is_its_own
    if own:
        assert "sums to nothing within 0.15 s" in simulations_sentence(own[0], ())
    told = Told.of(found, given)
    assert told.verdict == ("unexplained" if is_its_own else "explained")
    assert bool(told.findings) is not is_its_own
    if own:
        blank = nothing_decided("nothing was asked", (), ())
        (its,) = told.simulations
        assert 0.5 < its.energy_share <= 1.0
        most, nearly = (
            replace(told, simulations=(replace(its, energy_share=share),)).all_the_simulations(
                blank
            )
            for share in (0.95, 0.7)
        )
        assert most.sentence.startswith("No physics of the joint is missing")
        said = nearly.sentence
        assert said.startswith("70 % of the mismatch is the simulation's own. It is like friction")
        assert said.endswith("The rest has no name in the library.")
