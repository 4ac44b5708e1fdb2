"""Cooling curves and friction surfaces over many seeds: coverage, and error against the bound.

The Cramer-Rao bound is that of the readings as they are: for white noise of deviation s the
information of a reading is ``1/s^2``; for one that is rounded to steps it is
``sum_k (dP_k/dT)^2 / P_k`` over the steps k, P_k the chance of each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from agent.identify.friction.surface import fit_surface
from agent.identify.friction.surface_law import LAWS, SurfacePoints
from agent.identify.result import Floats, Parameter
from agent.identify.thermal.cooling import estimate_cooling
from fakes.friction import FrictionParameters
from tests.science.information import Score

RATE_PER_S, AIR_DEGC, ADDED_K, HOT_DEGC = 6.2e-5, 24.0, 1.6, 50.0
SETTLED_DEGC = AIR_DEGC + ADDED_K
LATER_S, TARGET_DEGC = 12 * 3600.0, 30.0
COOLING = ("r, 1/s", "settled, degC", "added, K", "initial, degC", "in 12 h, degC", "to 30 degC, s")
SPEEDS = np.array([1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 120.0, 200.0, 280.0])
TEMPERATURES = np.arange(24.0, 51.0, 4.0)
FRICTION_NOISE_NM = 0.005


@dataclass(frozen=True)
class Sensor:
    """How the temperature is read: noise, then steps (0: none); it lags behind the oil."""

    name: str
    noise_degc: float = 0.1
    step_degc: float = 0.0
    lag_s: float = 0.0
    hours: float = 8.0
    period_s: float = 60.0

    @property
    def initial_degc(self) -> float:
        """Return the start of the exponential that a lagging sensor follows."""
        return SETTLED_DEGC + (HOT_DEGC - SETTLED_DEGC) / (1.0 - RATE_PER_S * self.lag_s)

    def time_s(self) -> Floats:
        return np.arange(0.0, self.hours * 3600.0, self.period_s)

    def read(self, seed: int) -> Floats:
        """Return the readings of a cooling gearbox; the sensor starts at the oil's temperature."""
        time_s = self.time_s()
        seen = _law(time_s, np.array((RATE_PER_S, SETTLED_DEGC, self.initial_degc)))
        if self.lag_s:
            seen = seen + (HOT_DEGC - self.initial_degc) * np.exp(-time_s / self.lag_s)
        seen = seen + self.noise_degc * np.random.default_rng(seed).standard_normal(time_s.size)
        return np.round(seen / self.step_degc) * self.step_degc if self.step_degc else seen

    def truth(self) -> Floats:
        """Return what `COOLING` names, as the sensor sees it."""
        above = self.initial_degc - SETTLED_DEGC
        return np.array(
            (
                RATE_PER_S,
                SETTLED_DEGC,
                ADDED_K,
                self.initial_degc,
                SETTLED_DEGC + above * np.exp(-RATE_PER_S * LATER_S),
                np.log(above / (TARGET_DEGC - SETTLED_DEGC)) / RATE_PER_S,
            )
        )

    def bound(self) -> Floats:
        """Return the smallest deviation of an unbiased estimate of each."""
        point = np.array((RATE_PER_S, SETTLED_DEGC, self.initial_degc))
        slopes = _slopes(self.time_s(), point)
        information = self._information(_law(self.time_s(), point))
        covariance = np.linalg.inv((slopes * information[:, np.newaxis]).T @ slopes)
        when = float(self.truth()[-1])
        fall = RATE_PER_S * (TARGET_DEGC - SETTLED_DEGC)
        unit = np.eye(3)
        gradients = (
            unit[0],
            unit[1],
            unit[1],
            unit[2],
            _slopes(np.array([LATER_S]), point)[0],
            _slopes(np.array([when]), point)[0] / fall,
        )
        return np.array([np.sqrt(g @ covariance @ g) for g in gradients])

    def _information(self, degc: Floats) -> Floats:
        if not self.step_degc:
            return np.full_like(degc, self.noise_degc**-2)
        total = np.zeros_like(degc)
        for k in range(-6, 7):
            low = (np.round(degc / self.step_degc) + k - 0.5) * self.step_degc - degc
            low, high = low / self.noise_degc, (low + self.step_degc) / self.noise_degc
            share = ndtr(high) - ndtr(low)
            slope = (np.exp(-0.5 * low**2) - np.exp(-0.5 * high**2)) / self.noise_degc
            seen = share > 1e-12
            total[seen] += slope[seen] ** 2 / (2.0 * np.pi * share[seen])
        return total


SENSORS = (
    Sensor("8 h, white 0.1 degC"),
    Sensor("4 h, white 0.1 degC", hours=4.0),
    Sensor("steps 0.5 degC, lag 60 s", step_degc=0.5, lag_s=60.0),
    Sensor("steps 1 degC, lag 60 s", step_degc=1.0, lag_s=60.0),
    Sensor("steps 1 degC, quiet, lag 60 s", noise_degc=0.05, step_degc=1.0, lag_s=60.0),
)


def _law(time_s: Floats, point: Floats) -> Floats:
    rate, settled, initial = point
    return np.asarray(settled + (initial - settled) * np.exp(-rate * time_s))


def _slopes(time_s: Floats, point: Floats) -> Floats:
    rate, settled, initial = point
    left = np.exp(-rate * time_s)
    return np.stack((-(initial - settled) * time_s * left, 1.0 - left, left), axis=-1)


def cooling_campaign(seeds: Iterable[int], sensor: Sensor) -> list[Score]:
    """Estimate once for every seed; every parameter must be identified."""
    found = []
    air = np.full(sensor.time_s().size, AIR_DEGC)
    for seed in seeds:
        cooling = estimate_cooling(sensor.time_s(), sensor.read(seed), air)
        found.append(
            (
                cooling.rate_per_s,
                cooling.settled_degc,
                cooling.added_degc,
                cooling.initial_degc,
                cooling.forecast(LATER_S),
                cooling.time_to(TARGET_DEGC),
            )
        )
    truth, bound = sensor.truth(), sensor.bound()
    return [
        score(sensor.name, name, float(truth[i]), [row[i] for row in found], float(bound[i]))
        for i, name in enumerate(COOLING)
    ]


def score(
    fit: str, name: str, truth: float, parameters: Sequence[Parameter], bound: float
) -> Score:
    """Return coverage and error of one parameter over the seeds."""
    assert all(p.identified and p.ci95 is not None for p in parameters), name
    values = np.array([p.value for p in parameters])
    ends = np.array([p.ci95 for p in parameters])
    covered = (ends[:, 0] <= truth) & (truth <= ends[:, 1])
    rmse = float(np.sqrt(np.mean((values - truth) ** 2)))
    return Score(fit, name, truth, float(np.mean(covered)), rmse, bound)


def surface_campaign(
    seeds: Iterable[int], law: FrictionParameters
) -> tuple[list[Score], Counter[str]]:
    """Fit a surface for every seed; score the parameters where the true law was chosen.

    Returns
    -------
    scores : list of Score
        Over the seeds whose law has the truth's parameters.
    chosen : Counter
        How often each law won.
    """
    speed, degc = (x.ravel() for x in np.meshgrid(SPEEDS, TEMPERATURES))
    truth_nm = np.array([law.truth(t).torque_nm(v) for t, v in zip(degc, speed, strict=True)])
    reference = float(degc.mean())
    truth = surface_truth(law, reference)
    found, chosen = [], Counter[str]()
    for seed in seeds:
        noise = FRICTION_NOISE_NM * np.random.default_rng(seed).standard_normal(speed.size)
        error = np.full(speed.size, FRICTION_NOISE_NM)
        surface = fit_surface(SurfacePoints(speed, degc, truth_nm + noise, error))
        chosen[surface.law] += 1
        if LAWS[surface.law].moves == bool(law.stribeck_velocity_per_degc):
            found.append(surface.parameters)
    bound = surface_bound(truth, reference, speed, degc)
    name = "moving" if law.stribeck_velocity_per_degc else "still"
    return [
        score(name, key, truth[key], [p[key] for p in found if p[key].identified], bound[key])
        for key in truth
    ], chosen


def surface_truth(law: FrictionParameters, reference_degc: float) -> dict[str, float]:
    """Return the fake's law in the surface's words, at the surface's own reference."""
    rise = reference_degc - law.reference_temperature_degc
    viscous, floor = law.viscous_nm_s_per_rad, law.viscous_floor_share
    moved = 1.0 + law.stribeck_velocity_per_degc * rise
    return {
        "coulomb_nm": law.coulomb_nm,
        "viscous_nm_s_per_rad": viscous * floor,
        "viscous_thinning_nm_s_per_rad": viscous
        * (1.0 - floor)
        * float(np.exp(-rise / law.viscous_scale_degc)),
        "static_extra_nm": law.static_extra_nm,
        "stribeck_velocity_rad_s": law.stribeck_velocity_rad_s * moved,
        "exponent": law.exponent,
        **(
            {"stribeck_velocity_growth_per_k": law.stribeck_velocity_per_degc / moved}
            if law.stribeck_velocity_per_degc
            else {}
        ),
        "viscous_scale_degc": law.viscous_scale_degc,
    }


def surface_bound(
    truth: dict[str, float], reference: float, speed: Floats, degc: Floats
) -> dict[str, float]:
    """Return the smallest deviation of each, by central differences of the law written out."""

    def friction(p: dict[str, float]) -> Floats:
        rise = degc - reference
        fall = p["stribeck_velocity_rad_s"] * (
            1.0 + p.get("stribeck_velocity_growth_per_k", 0.0) * rise
        )
        thin = p["viscous_thinning_nm_s_per_rad"] * np.exp(-rise / p["viscous_scale_degc"])
        boundary = p["static_extra_nm"] * np.exp(-((speed / fall) ** p["exponent"]))
        return np.asarray(p["coulomb_nm"] + boundary + (p["viscous_nm_s_per_rad"] + thin) * speed)

    columns = []
    for name, value in truth.items():
        step = 1e-5 * value
        above, below = (friction({**truth, name: value + sign * step}) for sign in (1.0, -1.0))
        columns.append((above - below) / (2.0 * step))
    matrix = np.stack(columns, axis=-1) / FRICTION_NOISE_NM
    deviations = np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)))
    return dict(zip(truth, deviations.tolist(), strict=True))
