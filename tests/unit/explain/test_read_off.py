"""Plain numbers of a recorded simulation: read off it where twin.toml's do not predict it."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.explain.read_off import read_off
from agent.explain.rows.run import Run
from agent.identify.signals.simulated import simulated_torque_nm
from agent.physics.twin import Effect, Twin
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, nothing, record, stair

FALL = Effect(
    "stribeck", {"static_extra_nm": 0.15, "stribeck_velocity_rad_s": 6.0, "exponent": 1.0}
)
LEAST = {"inertia_kg_m2": 2e-4, "viscous_nm_s_per_rad": 2e-4, "coulomb_nm": 5e-3}
"""Numbers that make next to no torque of this motion."""


@functools.cache
def joint() -> Run:
    """Return a recording of a plain joint."""
    return record(stair((2.0, 8.0, 30.0, 50.0)), nothing, Conditions(), 0)


def beside(simulation: Twin) -> list[Run]:
    """Return it beside what a simulation predicts."""
    run = joint()
    torque_nm = simulated_torque_nm(simulation, run.signals, run.columns)
    return [replace(run, columns={**run.columns, "torque_simulated_nm": torque_nm})]


@settings(max_examples=15, deadline=None)
@given(
    inertia=st.floats(0.004, 0.04),
    coulomb=st.floats(0.0, 2.0),
    viscous=st.floats(0.0, 0.05),
    times=st.sampled_from([0.01, 0.5, 2.0, 10.0]),
)
def test_numbers_of_another_twin_are_replaced_by_the_simulations(
    inertia: float, coulomb: float, viscous: float, times: float
) -> None:
    simulation = replace(
        TWIN, inertia_kg_m2=inertia, coulomb_nm=coulomb, viscous_nm_s_per_rad=viscous
    )
    other = replace(TWIN, **{name: times * getattr(simulation, name) for name in LEAST})
    found, said = read_off(other, beside(simulation), ())
    assert len(said) == 1
    for name, least in LEAST.items():
        assert getattr(found, name) == pytest.approx(getattr(simulation, name), rel=0.02, abs=least)


def test_a_number_that_differs_by_little_is_the_simulations() -> None:
    """The twin that came out predicted the joint worse than the one that was given."""
    found, (said,) = read_off(TWIN, beside(replace(TWIN, coulomb_nm=1.15 * TWIN.coulomb_nm)), ())
    assert found.coulomb_nm == pytest.approx(1.15 * TWIN.coulomb_nm, rel=0.01)
    assert "Coulomb friction is" in said


@pytest.mark.parametrize("effects", [(), (FALL,)])
def test_a_twin_that_predicts_the_simulation_but_for_an_effect_stays(
    effects: tuple[Effect, ...],
) -> None:
    assert read_off(TWIN, beside(replace(TWIN, effects=effects)), ()) == (TWIN, ())


def test_a_simulation_that_smooths_frictions_sign_has_its_friction_where_that_is_whole() -> None:
    """Near standstill it has less: Coulomb friction was read 5 % too small, and viscous larger."""
    run = joint()
    wrong = replace(TWIN, coulomb_nm=1.3 * TWIN.coulomb_nm)
    torque_nm = simulated_torque_nm(wrong, run.signals, run.columns)
    velocity = run.signals.velocity_rad_s
    assert velocity is not None
    torque_nm += wrong.coulomb_nm * (np.tanh(velocity / 1.5) - np.sign(velocity))
    columns = {**run.columns, "torque_simulated_nm": torque_nm}
    found, _ = read_off(TWIN, [replace(run, columns=columns)], ())
    assert found.coulomb_nm == pytest.approx(wrong.coulomb_nm, rel=0.02)
    assert found.viscous_nm_s_per_rad == pytest.approx(wrong.viscous_nm_s_per_rad, rel=0.03)


def test_noise_in_the_simulations_place_leaves_no_number() -> None:
    run = joint()
    noise = NOISE_NM * np.random.default_rng(0).standard_normal(run.signals.time_s.size)
    columns = {**run.columns, "torque_simulated_nm": noise}
    found, (said,) = read_off(TWIN, [replace(run, columns=columns)], ())
    assert (found.coulomb_nm, found.viscous_nm_s_per_rad) == (0.0, 0.0)
    assert "Coulomb friction is 0, not 0.500 N m" in said


def test_effects_that_need_what_was_not_recorded_are_left_out() -> None:
    """The recorded simulation stands for them: no motor temperature need be there."""
    warm = Effect("torque-constant-error", {"factor_per_k": 0.01, "reference_degc": 20.0})
    found, (said,) = read_off(replace(TWIN, effects=(warm,)), beside(TWIN), ())
    assert found == TWIN
    assert "left out beside the recorded simulation" in said
    assert "motor_temperature_degc" in said
