"""The fake's friction and gearbox temperature against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes.friction import FrictionParameters
from fakes.thermal import Gearbox, ThermalParameters


def test_at_the_reference_temperature_the_truth_is_the_parameters() -> None:
    truth = FrictionParameters().truth(25.0)
    assert truth.coulomb_nm == 0.6042
    assert truth.viscous_nm_s_per_rad == pytest.approx(0.0107)
    assert truth.stribeck_velocity_rad_s == pytest.approx(6.0)
    assert truth.breakaway_nm == pytest.approx(0.7542)


def test_torque_has_a_stribeck_minimum_and_a_viscous_slope() -> None:
    truth = FrictionParameters().truth(25.0)
    speeds = np.linspace(0.01, 200.0, 4000)
    torque = np.array([truth.torque_nm(v) for v in speeds])
    lowest = speeds[np.argmin(torque)]
    assert 4.0 < lowest < 12.0
    assert torque[0] == pytest.approx(truth.breakaway_nm, abs=1e-3)
    assert (torque[-1] - torque[-2]) / (speeds[-1] - speeds[-2]) == pytest.approx(0.0107, rel=1e-6)


@given(velocity=st.floats(-500.0, 500.0), temperature=st.floats(-20.0, 120.0))
def test_friction_is_odd_and_never_drives(velocity: float, temperature: float) -> None:
    truth = FrictionParameters().truth(temperature)
    assert truth.torque_nm(-velocity) == -truth.torque_nm(velocity)
    assert truth.torque_nm(velocity) * velocity >= 0.0


def test_hot_oil_is_thinner_and_needs_more_speed_to_carry() -> None:
    parameters = FrictionParameters()
    cold, hot = parameters.truth(10.0), parameters.truth(60.0)
    assert hot.viscous_nm_s_per_rad < 0.6 * cold.viscous_nm_s_per_rad
    assert hot.viscous_nm_s_per_rad > 0.3 * 0.0107
    assert hot.stribeck_velocity_rad_s > cold.stribeck_velocity_rad_s
    assert hot.coulomb_nm == cold.coulomb_nm


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("coulomb_nm", -0.1),
        ("viscous_nm_s_per_rad", math.nan),
        ("stribeck_velocity_rad_s", 0.0),
        ("viscous_floor_share", 1.5),
    ],
)
def test_parameters_that_cannot_be_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        FrictionParameters(**{name: value})


def test_cooling_is_newtons_with_the_thesis_rate() -> None:
    gearbox = Gearbox(ThermalParameters(initial_degc=60.0, ambient_degc=20.0))
    for _ in range(3600):
        gearbox.step(0.0, 1.0)
    expected = 20.0 + 40.0 * math.exp(-6.2e-5 * 3600.0)
    assert gearbox.temperature_degc == pytest.approx(expected, abs=1e-9)


def test_friction_power_warms_up_to_the_balance_of_heat_and_air() -> None:
    p = ThermalParameters(heat_capacity_j_per_k=1000.0, cooling_rate_per_s=0.01)
    gearbox = Gearbox(p)
    gearbox.step(100.0, 1.0)
    assert gearbox.temperature_degc - 25.0 == pytest.approx(100.0 / 1000.0, rel=0.01)
    for _ in range(2000):
        gearbox.step(100.0, 1.0)
    assert gearbox.temperature_degc == pytest.approx(25.0 + 100.0 / (0.01 * 1000.0), abs=1e-3)


def test_one_long_step_equals_many_short_ones() -> None:
    long, short = Gearbox(ThermalParameters()), Gearbox(ThermalParameters())
    long.step(50_000.0, 500.0)
    for _ in range(5000):
        short.step(10.0, 0.1)
    assert long.temperature_degc == pytest.approx(short.temperature_degc, abs=1e-9)


def test_the_sensor_lags_and_counts_in_tenths() -> None:
    gearbox = Gearbox(ThermalParameters(sensor_lag_s=20.0, heat_capacity_j_per_k=100.0))
    gearbox.step(1000.0, 0.001)
    assert gearbox.temperature_degc == pytest.approx(35.0, abs=0.01)
    assert gearbox.sensor_decidegc == 250
    for _ in range(200):
        gearbox.step(0.0, 0.1)
    reached = (gearbox.sensor_degc - 25.0) / (gearbox.temperature_degc - 25.0)
    assert reached == pytest.approx(1.0 - math.exp(-1.0), rel=0.01)
    assert gearbox.sensor_decidegc == round(gearbox.sensor_degc * 10.0)


def test_without_a_sensor_the_object_holds_the_sentinel() -> None:
    assert Gearbox(ThermalParameters(has_sensor=False)).sensor_decidegc == -32768
