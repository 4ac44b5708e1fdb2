"""Cooling curves and friction surfaces of the fake joint, whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.friction_surface import fit_surface
from agent.identify.result import Floats, Parameter
from agent.identify.signals import Signals
from agent.identify.surface_law import SurfacePoints
from agent.identify.thermal import Cooling, estimate_cooling
from agent.identify.thermal_trend import TEMPERATURE, TIE, temperature_or_time
from fakes.friction import FrictionParameters
from fakes.thermal import Gearbox, ThermalParameters

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


def test_intervals_cover_rate_settled_forecast_and_time() -> None:
    truth = settled()
    at_s = 12.0 * 3600.0
    later = truth + (HOT - truth) * np.exp(-RATE * at_s)
    when_s = np.log((HOT - truth) / (30.0 - truth)) / RATE
    hits = np.zeros(4)
    runs = 40
    for seed in range(runs):
        found = estimate_cooling(*cooled(seed))
        asked = (found.rate_per_s, found.settled_degc, found.forecast(at_s), found.time_to(30.0))
        for i, (p, true) in enumerate(zip(asked, (RATE, truth, later, when_s), strict=True)):
            hits[i] += holds(p, true)
    assert (hits >= 0.87 * runs).all(), hits


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
