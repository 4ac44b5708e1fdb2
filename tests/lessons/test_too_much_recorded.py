"""A recorded simulation that has too much of an effect: asked the other way round, and told so."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.names import OWN_EFFECT
from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.identify.signals.simulated import simulated_torque_nm
from agent.physics.twin import Effect, Twin
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints

FALL_NM, FALL_RAD_S = 0.15, 6.0
RIPPLE_NM = 0.1
SPEEDS_RAD_S = (2.0, 4.0, 8.0, 16.0, 30.0, 50.0)


@functools.cache
def measured(ripple_nm: float = 0.0) -> tuple[Run, ...]:
    """Return a joint without a fall of friction, and with a ripple or none."""

    def missing(now: SetPoints, at: Conditions) -> Floats:
        del at
        return np.asarray(ripple_nm * np.cos(6.0 * now.position_rad))

    speeds = ([(1.0 + 0.1 * k) * v for v in SPEEDS_RAD_S] for k in range(2))
    return tuple(record(stair(v), missing, Conditions(), k) for k, v in enumerate(speeds))


@functools.cache
def falling() -> tuple[Run, ...]:
    """Return a joint whose friction falls with speed."""

    def missing(now: SetPoints, at: Conditions) -> Floats:
        del at
        speed = np.abs(now.velocity_rad_s)
        return np.asarray(FALL_NM * np.sign(now.velocity_rad_s) * np.exp(-speed / FALL_RAD_S))

    return tuple(record(stair(SPEEDS_RAD_S), missing, Conditions(), k) for k in range(2))


def beside_a_falling_simulation(runs: tuple[Run, ...]) -> list[Run]:
    """Return recordings beside what a simulation says whose friction falls with speed."""
    numbers = {
        "static_extra_nm": FALL_NM,
        "stribeck_velocity_rad_s": FALL_RAD_S,
        "exponent": 1.0,
    }
    falling = replace(TWIN, effects=(Effect("stribeck", numbers),))
    return [_beside(falling, run) for run in runs]


def _beside(simulation: Twin, run: Run) -> Run:
    torque_nm = simulated_torque_nm(simulation, run.signals, run.columns)
    return replace(run, columns={**run.columns, "torque_simulated_nm": torque_nm})


def test_what_a_recorded_simulation_has_too_much_of_is_no_missing_physics() -> None:
    answer = explain(TWIN, beside_a_falling_simulation(measured()))
    assert answer.verdict in ("explained", "tied")
    (found,) = answer.findings
    assert (found.effect, found.form) == ("stribeck", OWN_EFFECT)
    assert answer.sentence.startswith("What the simulation has too much of is friction that falls")
    extra = found.parameters["static_extra_nm"]
    assert extra.ci95 is not None
    assert extra.ci95[0] <= FALL_NM <= extra.ci95[1]
    assert found.curve is not None
    assert found.curve.line_nm[0] > 0.0 > found.curve.line_nm[-1]  # to be taken off as it brakes
    # Errors are those of the simulation as it was recorded; none of it is left without.
    assert answer.baseline.rmse_nm > 1.5 * answer.floor.value_nm
    assert answer.extended.rmse_nm == pytest.approx(answer.floor.value_nm, rel=0.1)
    # A law has a sign: the twin cannot hold it, and says so.
    assert answer.twin is not None
    assert not answer.twin.effects
    assert any("take it out of the simulation" in reason for reason in answer.reasons)


def test_what_the_joint_has_more_is_told_beside_it() -> None:
    answer = explain(TWIN, beside_a_falling_simulation(measured(RIPPLE_NM)))
    told = {f.effect: f.form == OWN_EFFECT for f in answer.findings}
    assert told == {"stribeck": True, "torque-ripple": False}
    assert answer.twin is not None
    assert [e.id for e in answer.twin.effects] == ["torque-ripple"]


@functools.cache
def pulled() -> tuple[Run, ...]:
    """Return a joint without a fall of friction, and with a cable that stiffens."""

    def missing(now: SetPoints, at: Conditions) -> Floats:
        del at
        turned = now.position_rad / TWIN.gear_ratio - 0.1
        return np.asarray(0.1 * turned + 0.06 * turned**3)

    speeds = ([(1.0 + 0.1 * k) * v for v in SPEEDS_RAD_S] for k in range(2))
    cycles = (stair(v, 300.0, 40.0) for v in speeds)
    return tuple(record(cycle, missing, Conditions(), k) for k, cycle in enumerate(cycles))


def test_what_it_has_too_much_of_shows_beside_a_cable_that_has_no_other_sign() -> None:
    """It had been friction that bends, with next to no Coulomb friction beside it."""
    answer = explain(TWIN, beside_a_falling_simulation(pulled()))
    told = {f.effect: f.form == OWN_EFFECT for f in answer.findings}
    assert told == {"stribeck": True, "cable-force": False}
    extra = next(f for f in answer.findings if f.effect == "stribeck").parameters["static_extra_nm"]
    assert extra.value == pytest.approx(FALL_NM, rel=0.15)


def test_the_twin_given_need_not_be_the_recorded_simulation() -> None:
    """What is found is fitted to what the recorded one leaves, whatever the twin's own numbers."""
    plain = [_beside(TWIN, run) for run in measured(RIPPLE_NM)]
    other = replace(TWIN, coulomb_nm=0.3 * TWIN.coulomb_nm, viscous_nm_s_per_rad=0.001)
    answer = explain(other, plain)
    assert [f.effect for f in answer.findings] == ["torque-ripple"]
    assert answer.extended.rmse_nm == pytest.approx(answer.floor.value_nm, rel=0.1)


@pytest.mark.parametrize(
    "simulation",
    [replace(TWIN, coulomb_nm=1.0), replace(TWIN, viscous_nm_s_per_rad=0.03)],
    ids=["Coulomb friction", "viscous friction"],
)
def test_a_fall_that_the_joint_has_beside_a_wrong_number_is_no_bend_of_the_simulation(
    simulation: Twin,
) -> None:
    """Asked the other way round, one bend stands for both: but it needs a wrong number as well."""
    answer = explain(simulation, [_beside(simulation, run) for run in falling()])
    told = {f.effect: f.form == OWN_EFFECT for f in answer.findings}
    assert told == {"wrong-number": False, "stribeck": False}
    assert any("too much in the simulation explains" in reason for reason in answer.reasons)


def with_a_ripple(run: Run) -> Run:
    """Return a recording beside a simulation that has a ripple."""
    plain, position = _beside(TWIN, run), run.signals.position_rad
    assert position is not None
    rippling = plain.columns["torque_simulated_nm"] + RIPPLE_NM * np.cos(6.0 * position)
    return replace(plain, columns={**plain.columns, "torque_simulated_nm": rippling})


def test_a_ripple_that_the_measured_torque_has_not_is_the_simulations() -> None:
    # It was missing physics, and put into twin.toml, though the joint has none of it.
    answer = explain(TWIN, [with_a_ripple(run) for run in measured()])
    (found,) = answer.findings
    assert (answer.verdict, found.effect, found.form) == ("explained", "torque-ripple", OWN_EFFECT)
    assert answer.twin is not None
    assert not answer.twin.effects
    answer = explain(TWIN, [_beside(TWIN, run) for run in measured(RIPPLE_NM)])
    (found,) = answer.findings
    assert (answer.verdict, found.effect) == ("explained", "torque-ripple")
    assert found.form != OWN_EFFECT


def with_a_hose(run: Run) -> Run:
    """Return a recording beside a simulation that has a hose's pull."""
    plain, position = _beside(TWIN, run), run.signals.position_rad
    assert position is not None
    pull = plain.columns["torque_simulated_nm"] + 0.5 * position / run.signals.gear_ratio
    return replace(plain, columns={**plain.columns, "torque_simulated_nm": pull})


def test_a_hose_that_a_simulation_has_too_much_is_no_payload_that_lifts() -> None:
    # A weight has no sign: that it pulled upwards stood for certain, at twice what a line leaves.
    answer = explain(TWIN, [with_a_hose(run) for run in measured()])
    found = answer.findings[0]
    assert (found.effect, found.form) == ("cable-force", OWN_EFFECT)
    stiffness = found.parameters["stiffness_nm_per_arm_rad"]
    assert stiffness.value == pytest.approx(0.5, rel=0.1)
