"""Warming within a cycle bends the friction curve: an interval holds what the sensor hides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.identify.estimate import estimate
from agent.identify.result import Parameter
from agent.identify.signals.arrays import Signals
from tests.science.design_cycles import Truth, cycle, thesis_paired, thesis_stair
from trajectories import Trajectory

RISE_K, STEP_K, THINNING_PER_K = 0.4, 0.5, 0.035


def warmed(trajectory: Trajectory, seed: int) -> Signals:
    """Return a cycle whose oil thins as friction's work warms it, less than its sensor shows."""
    signals = cycle(trajectory, Truth(), seed)
    velocity = signals.velocity_rad_s
    assert velocity is not None
    truth = Truth()
    work = np.cumsum(np.abs(truth.friction_nm(velocity) * velocity))
    rise_k = RISE_K * work / work[-1]
    lost_nm = THINNING_PER_K * (rise_k - rise_k.mean()) * truth.viscous_nm_s_per_rad * velocity
    sensed = 25.0 + STEP_K * np.round((rise_k + 0.1) / STEP_K)
    return replace(signals, torque_nm=signals.torque_nm - lost_nm, gearbox_temperature_degc=sensed)


def coulomb(signals: Signals) -> Parameter:
    """Return the selected law's Coulomb friction."""
    law = next(m for m in estimate([signals]).friction_models if m.selected)
    return law.parameters["coulomb_nm"]


def ends(parameter: Parameter) -> tuple[float, float]:
    assert parameter.ci95 is not None
    return parameter.ci95


def test_an_interval_holds_the_warming_that_a_step_of_the_sensor_hides() -> None:
    signals = warmed(thesis_paired(), 463060)  # rising speeds: the fast ones on the warmest oil
    low, high = ends(coulomb(signals))
    assert low < Truth().coulomb_nm < high
    blind = ends(coulomb(replace(signals, gearbox_temperature_degc=None)))
    assert not blind[0] < Truth().coulomb_nm < blind[1]


def test_a_stair_that_comes_back_as_it_went_needs_no_wider_interval() -> None:
    signals = warmed(thesis_stair(), 463061)
    steady = replace(signals, gearbox_temperature_degc=np.full_like(signals.time_s, 25.0))
    blind = replace(signals, gearbox_temperature_degc=None)
    assert np.ptp(ends(coulomb(steady))) < 1.1 * np.ptp(ends(coulomb(blind)))
