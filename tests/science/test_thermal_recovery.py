"""Cooling curves and friction surfaces of the fake joint, whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.identify.friction.oil_change import compare_oils, equivalent_degc
from agent.identify.friction.surface import fit_surface
from agent.identify.friction.surface_law import SurfacePoints
from agent.identify.result import Floats, Parameter
from agent.identify.signals.arrays import Signals
from agent.identify.thermal.cooling import Cooling, estimate_cooling
from agent.identify.thermal.cooling_fit import fit_cooling
from agent.identify.thermal.integral import integral_over_temperature
from agent.identify.thermal.trend import TEMPERATURE, TIE, temperature_or_time
from agent.physics.thermal import (
    THESIS_OILS,
    Oil,
    integral_slope,
)
from fakes.friction import FrictionParameters
from fakes.thermal import Gearbox, ThermalParameters
from tests.science.thermal_campaign import SENSORS, Sensor, cooling_campaign, surface_campaign

RATE, AIR, HOT = 6.2e-5, 24.0, 50.0
SPEEDS = np.array([1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 120.0, 200.0, 280.0])


def cooled(
    seed: int, hours: float = 8.0, watts: float = 3.0, air: float = AIR
) -> tuple[Floats, Floats]:
    """Cool the fake gearbox under a small heat source, seen in steps of 0.1 degC."""
    rng = np.random.default_rng(seed)
    gearbox = Gearbox(ThermalParameters(ambient_degc=air, initial_degc=HOT, sensor_lag_s=1.0))
    time_s, seen = np.arange(0.0, hours * 3600.0, 60.0), []
    for _ in time_s:
        seen.append(round(gearbox.sensor_degc + rng.normal(0.0, 0.1), 1))
        gearbox.step(watts * 60.0, 60.0)
    return time_s, np.array(seen)


def holds(parameter: Parameter, truth: float) -> bool:
    return parameter.ci95 is not None and parameter.ci95[0] <= truth <= parameter.ci95[1]


def settled(watts: float = 3.0) -> float:
    return AIR + watts / (RATE * 30_000.0)


@pytest.mark.parametrize("sensor", [SENSORS[0], SENSORS[3]], ids=lambda s: s.name)
def test_cooling_is_near_the_bound_and_its_intervals_hold(sensor: Sensor) -> None:
    """A slice of ``tests.benchmarks.thermal``, with room for the chance of few seeds."""
    for s in cooling_campaign(range(10), sensor):
        assert s.coverage >= 0.7, s
        assert s.ratio <= 1.6, s


def test_steps_taken_for_noise_would_give_an_interval_too_wide() -> None:
    """What the likelihood of rounded readings is for: a plain fit counts steps as wander."""
    sensor = SENSORS[3]
    plain = fit_cooling(sensor.time_s(), sensor.read(1), None).draws[:, 0]
    exact = estimate_cooling(sensor.time_s(), sensor.read(1))
    assert exact.sensor_step_degc == 1.0
    assert exact.rate_per_s.ci95 is not None
    assert np.ptp(np.quantile(plain, (0.025, 0.975))) > 1.5 * np.ptp(exact.rate_per_s.ci95)


def test_held_readings_are_not_counted_as_many() -> None:
    """A probe that is read once in ten minutes and repeated tells no more than its own readings."""
    time_s, rare = cooled(1)
    held = np.repeat(rare[::10], 10)[: rare.size]
    fine, coarse = estimate_cooling(time_s, rare), estimate_cooling(time_s, held)
    assert fine.rate_per_s.ci95 is not None
    assert coarse.rate_per_s.ci95 is not None
    wider = np.ptp(coarse.rate_per_s.ci95) / np.ptp(fine.rate_per_s.ci95)
    assert wider > 1.8


def test_a_curve_that_moves_over_few_steps_is_refused() -> None:
    time_s = np.arange(0.0, 8 * 3600.0, 60.0)
    found = estimate_cooling(time_s, np.round(25.0 + 2.0 * np.exp(-RATE * time_s)))
    assert not found.identified
    assert "sensor in steps of 1 degC" in found.reason


def test_heating_then_cooling_is_no_single_law() -> None:
    time_s = np.arange(0.0, 8 * 3600.0, 60.0)
    up, down = 24.0 + 4e-3 * time_s, 50.0 - 2e-3 * (time_s - time_s[110])
    noise = 0.1 * np.random.default_rng(2).standard_normal(time_s.size)
    found = estimate_cooling(time_s, np.minimum(up, down) + noise)
    assert not found.identified
    assert "hours of rest by themselves" in found.reason


def test_ambient_splits_the_settled_temperature() -> None:
    time_s, temperature = cooled(1)
    found = estimate_cooling(time_s, temperature, np.full(time_s.size, AIR))
    assert found.added_degc.value == pytest.approx(settled() - AIR, abs=0.2)
    assert found.ambient_degc.value == pytest.approx(AIR)
    without = estimate_cooling(time_s, temperature)
    assert not without.added_degc.identified
    assert "no ambient temperature" in without.added_degc.reason


def test_changing_ambient_is_followed() -> None:
    time_s = np.arange(0.0, 12 * 3600.0, 60.0)
    air = AIR + 4.0 * np.sin(2.0 * np.pi * time_s / (6.0 * 3600.0))
    temperature, now = [], HOT
    for degc in air:
        temperature.append(now)
        now += 60.0 * -RATE * (now - degc - 2.0)
    noise = np.random.default_rng(3).normal(0.0, 0.1, time_s.size)
    followed = estimate_cooling(time_s, np.array(temperature) + noise, air)
    assert followed.rate_per_s.value == pytest.approx(RATE, rel=0.02)
    assert followed.added_degc.value == pytest.approx(2.0, abs=0.3)


def _constant() -> Cooling:
    time_s = np.arange(0.0, 7200.0, 30.0)
    noise = np.random.default_rng(0).normal(0.0, 0.1, time_s.size)
    return estimate_cooling(time_s, 25.0 + noise)


@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (_constant(), "the temperature is constant"),
        (estimate_cooling(*cooled(1, hours=0.4)), "does not bend"),
        (estimate_cooling(np.arange(3.0), np.array([40.0, 39.0, 38.0])), "3 temperatures"),
        (estimate_cooling(np.arange(0.0), np.arange(0.0)), "0 temperatures"),
    ],
)
def test_what_is_not_carried_gives_no_number(found: Cooling, reason: str) -> None:
    assert not found.identified
    assert reason in found.reason
    for parameter in (found.rate_per_s, found.settled_degc, found.forecast(60.0)):
        assert not parameter.identified
        assert parameter.ci95 is None
        assert np.isnan(parameter.value)
    assert not found.time_to(30.0).identified


def test_temperature_beyond_the_curve_is_never_reached() -> None:
    found = estimate_cooling(*cooled(1))
    assert "not in between" in found.time_to(20.0).reason
    assert not found.time_to(60.0).identified
    with pytest.raises(ValueError, match="0 s or more"):
        found.forecast(-1.0)


def test_bad_curves_are_refused() -> None:
    time_s, temperature = cooled(1, hours=1.0)
    with pytest.raises(ValueError, match="rises strictly"):
        estimate_cooling(time_s[::-1], temperature)
    with pytest.raises(ValueError, match="two arrays"):
        estimate_cooling(time_s[:-1], temperature)
    temperature[10] = np.nan
    assert estimate_cooling(time_s, temperature).duration_s > 0.0


def surface_points(temperatures: Floats, seed: int = 0, thinning: bool = True) -> SurfacePoints:
    law = FrictionParameters(stribeck_velocity_per_degc=0.0)
    rng = np.random.default_rng(seed)
    speed, degc = (x.ravel() for x in np.meshgrid(SPEEDS, temperatures))
    felt = degc if thinning else np.full_like(degc, 25.0)
    truth = [law.truth(t).torque_nm(v) for t, v in zip(felt, speed, strict=True)]
    noise = rng.normal(0.0, 0.005, speed.size)
    return SurfacePoints(speed, degc, np.array(truth) + noise, np.full(speed.size, 0.005))


def test_surface_predicts_temperatures_that_it_has_not_seen() -> None:
    found = fit_surface(surface_points(np.arange(24.0, 51.0, 4.0)), oil="150")
    assert found.identified
    assert found.law == "stribeck, temperature-dependent"
    assert found.oil == "150"
    assert found.heldout_rmse_nm < 0.01
    assert found.heldout_by_law_nm["stribeck"] > 0.1
    law = FrictionParameters(stribeck_velocity_per_degc=0.0)
    for degc in (27.0, 41.5):
        truth = np.array([law.truth(degc).torque_nm(v) for v in SPEEDS])
        predicted = found.friction_nm(SPEEDS, np.full_like(SPEEDS, degc))
        np.testing.assert_allclose(predicted, truth, atol=0.01)
    assert holds(found.parameters["coulomb_nm"], law.coulomb_nm)
    assert holds(found.parameters["viscous_scale_degc"], law.viscous_scale_degc)


def test_friction_that_does_not_thin_gets_no_temperature_law() -> None:
    found = fit_surface(surface_points(np.arange(24.0, 51.0, 4.0), thinning=False))
    assert not found.identified
    assert found.law == "stribeck"
    assert "no temperature dependence" in found.reason


def test_a_stribeck_velocity_that_moves_is_chosen_only_where_it_does() -> None:
    still = FrictionParameters(stribeck_velocity_per_degc=0.0)
    for law, name in ((still, "stribeck, "), (FrictionParameters(), "stribeck moving, ")):
        scores, chosen = surface_campaign(range(2), law)
        assert set(chosen) == {f"{name}temperature-dependent"}
        assert all(s.ratio < 2.2 for s in scores), scores


def test_what_the_temperatures_do_not_tell_of_the_stribeck_velocity_has_no_number() -> None:
    found = fit_surface(surface_points(np.arange(24.0, 51.0, 4.0)))
    growth = found.parameters["stribeck_velocity_growth_per_k"]
    assert not growth.identified
    assert np.isnan(growth.value)
    assert "temperatures further apart" in growth.reason


def test_surface_interval_holds_where_nothing_was_measured() -> None:
    law = FrictionParameters(stribeck_velocity_per_degc=0.0)
    inside = 0
    for seed in range(4):
        found = fit_surface(surface_points(np.arange(24.0, 51.0, 4.0), seed))
        truth = np.array([law.truth(30.0).torque_nm(v) for v in SPEEDS])
        low, high = found.friction_ci95_nm(SPEEDS, np.full_like(SPEEDS, 30.0)).T
        inside += int(np.sum((low <= truth) & (truth <= high)))
    assert inside >= 0.82 * 4 * SPEEDS.size


def test_surface_interval_holds_what_the_law_misses_alike_at_all_temperatures() -> None:
    law = FrictionParameters(stribeck_velocity_per_degc=0.0)
    truth = {"coulomb_nm": law.coulomb_nm, "static_extra_nm": law.static_extra_nm}
    inside = 0
    for seed in range(5):
        points = surface_points(np.arange(24.0, 51.0, 4.0), seed)
        missed_nm = 0.004 * np.random.default_rng(seed).standard_normal(len(SPEEDS))
        bent = points.friction_nm + missed_nm[np.searchsorted(SPEEDS, points.speed_rad_s)]
        found = fit_surface(replace(points, friction_nm=bent))
        for name, value in truth.items():
            low, high = found.parameters[name].ci95 or (np.inf, np.inf)
            inside += low <= value <= high
    assert inside >= 9  # temperatures left out alone: 4


def test_the_friction_integral_falls_by_what_the_oil_thins() -> None:
    speeds, degc = np.linspace(2.0, 100.0, 12), np.array([24.0, 29.0, 35.0, 40.0, 47.0])
    speed, warmth = (grid.ravel() for grid in np.meshgrid(speeds, degc, indexing="ij"))
    number = np.tile(np.arange(degc.size), speeds.size)
    noise = 2e-3 * np.random.default_rng(3).standard_normal(speed.size)
    friction = 0.5 + (0.01 - 1e-4 * (warmth - 24.0)) * speed + noise
    points = SurfacePoints(speed, warmth, friction, np.full(speed.size, 2e-3), number)
    found = integral_over_temperature(points)
    assert found is not None
    low, high = found.slope_w_per_k.ci95 or (0.0, 0.0)
    assert low <= -1e-4 * (100.0**2 - 2.0**2) / 2.0 <= high
    assert high - low < 0.1
    cold = integral_over_temperature(points.take(number < 2))
    assert cold is not None
    assert not cold.slope_w_per_k.identified
    assert "three temperatures" in cold.slope_w_per_k.reason


def test_equal_viscosity_is_equal_friction() -> None:
    one, three = THESIS_OILS["oil 1"], THESIS_OILS["oil 3"]
    warmer = equivalent_degc(three, one, 40.0)
    assert float(three.viscosity_mm2_s(np.array(warmer))) == pytest.approx(150.0, rel=1e-3)
    assert equivalent_degc(one, three, warmer) == pytest.approx(40.0, abs=0.05)
    assert equivalent_degc(one, Oil(2000.0, 100.0), -15.0) == -np.inf


def test_thesis_oils_bound_what_viscosity_alone_predicts() -> None:
    """Slopes of the friction integral, thesis appendix A, beside those of the viscosities."""
    degc = np.linspace(24.0, 50.0, 27)
    slopes = {n: integral_slope(degc, oil.viscosity_mm2_s(degc)) for n, oil in THESIS_OILS.items()}
    measured = {"oil 1": -15.09, "oil 2": -20.53, "oil 3": -22.89}
    for name in ("oil 2", "oil 3"):
        said = slopes[name] / slopes["oil 1"]
        assert said == pytest.approx(measured[name] / measured["oil 1"], rel=0.2)


def test_an_oil_thicker_than_anything_measured_gets_no_curve() -> None:
    surface = fit_surface(surface_points(np.arange(24.0, 51.0, 4.0)))
    oils = {"oil 1": THESIS_OILS["oil 1"], "tar": Oil(5000.0, 300.0)}
    shown = compare_oils(surface, "oil 1", oils, SPEEDS, np.array([28.0, 40.0])).curves
    assert shown[0].friction_nm.size == SPEEDS.size
    assert not shown[1].friction_nm.size
    assert shown[1].reason.startswith("not identified: it is thicker")
    with pytest.raises(ValueError, match="expected one of"):
        compare_oils(surface, "oil 2", oils, SPEEDS, np.array([40.0]))


@pytest.mark.parametrize("temperatures", [np.array([25.0]), 25.0 + 0.3 * np.arange(6)])
def test_constant_temperature_carries_no_law(temperatures: Floats) -> None:
    found = fit_surface(surface_points(temperatures))
    assert not found.identified
    assert found.reason.startswith("not identified")
    assert not found.parameters
    with pytest.raises(ValueError, match="there is no surface"):
        found.friction_nm(SPEEDS, SPEEDS)


def repeated(temperature_of_pass: Floats, follows_temperature: bool) -> tuple[Signals, Floats]:
    rng = np.random.default_rng(5)
    velocity = np.concatenate([np.full(200, 5.0 * (-1) ** i) for i in range(40)])
    degc = np.repeat(temperature_of_pass, 200)
    time_s = np.arange(velocity.size) * 0.1
    cause = degc if follows_temperature else 30.0 + 20.0 * time_s / time_s[-1]
    torque = np.sign(velocity) * (1.0 - 0.01 * (cause - 30.0)) + rng.normal(0.0, 0.05, time_s.size)
    columns = {"time_s": time_s, "velocity_rad_s": velocity, "torque_nm": torque}
    return Signals.from_columns(columns, 1.0), degc


def test_warming_alone_is_a_tie_and_cooling_breaks_it() -> None:
    up: Floats = 30.0 + 0.5 * np.arange(40, dtype=np.float64)
    signals, degc = repeated(up, follows_temperature=True)
    assert temperature_or_time([signals], [degc]).verdict == TIE
    up_and_down = 30.0 + np.minimum(np.arange(40), 39 - np.arange(40)).astype(np.float64)
    signals, degc = repeated(up_and_down, follows_temperature=True)
    assert temperature_or_time([signals], [degc]).verdict == TEMPERATURE
