"""How fast a gearbox cools, where it settles, and when it will be at a given temperature.

Newton's law with a heat source is `agent.physics.thermal.GearboxTemperature`; the settled
temperature is the ambient one and what the heat source adds; an ambient temperature that was
measured may change, and is followed. Intervals are quantiles of draws from the likelihood, which
is that of noisy readings (`cooling_fit`) or, where the sensor's steps are coarser than its noise,
of rounded ones (`cooling_steps`). A curve too short to bend says so: r and the settled temperature
then trade against each other, and neither is given. All temperatures are the sensor's: the oil
runs ahead of it by the sensor's own lag.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.thermal.cooling_fit import CoolingDraws, fit_cooling, neighbours
from agent.identify.thermal.cooling_steps import fit_steps, is_coarse, step_of
from agent.physics.thermal import relaxation_time_s, relaxed_degc

SCHEMA = "stribeck.cooling/1"
_POINTS = 400
_LEAST_POINTS = 12
_LOOSE = 5.0  # ratio of the ends of r's interval that leaves its order of magnitude only
_NOISES = 6.0  # change of temperature, in deviations of the noise, below which it is constant
_LEAST_CHANGE_DEGC = 0.3
_SCATTER = 8.0  # deviations of the noise between the extremes of some hundred readings
_STRAYS = 0.08  # of its whole change: what a curve may wander slowly about one law
_LEAST_STEPS = 4.0  # of a coarse sensor, that its readings must fall or rise by


@dataclass(frozen=True)
class Cooling:
    """A cooling (or warming) curve's law, its intervals and its draws.

    Parameters
    ----------
    identified : bool
        Whether the curve carries the law.
    reason : str
        Why not; empty otherwise.
    rate_per_s, settled_degc, initial_degc : Parameter
        r, the temperature it goes to, and the one at the first sample.
    ambient_degc, added_degc : Parameter
        Mean of the measured ambient temperature, and how far above it the gearbox settles; not
        identified where no ambient temperature was measured.
    rmse_degc, duration_s : float
        What is left of the curve, and how long it is.
    wander_degc : float
        The slow part of what is left: no noise of the reading, so that forecasts count it.
    sensor_step_degc : float
        The sensor's step, where it is coarser than the noise; else 0.
    draws : ndarray, shape (m, 3)
        (r, settled, initial) drawn in proportion to their likelihood.
    """

    identified: bool
    reason: str
    rate_per_s: Parameter
    settled_degc: Parameter
    initial_degc: Parameter
    ambient_degc: Parameter
    added_degc: Parameter
    rmse_degc: float
    duration_s: float
    draws: Floats = field(repr=False)
    wander_degc: float = 0.0
    sensor_step_degc: float = 0.0

    @classmethod
    def not_identified(
        cls, reason: str, duration_s: float = 0.0, ambient_degc: Parameter | None = None
    ) -> Cooling:
        """Return a curve that carries no law, with the reason."""
        none = Parameter.not_identified(reason)
        air = _ambient(None) if ambient_degc is None else ambient_degc
        return cls(
            False, reason, none, none, none, air, none, math.nan, duration_s, np.empty((0, 3))
        )

    def forecast(self, at_s: float) -> Parameter:
        """Return the temperature `at_s` seconds after the first sample, with its interval.

        It is the gearbox's temperature, without the noise of a reading. The environment and the
        heat source are taken to stay as they were, but for what the curve itself wandered.
        """
        if not (math.isfinite(at_s) and at_s >= 0.0):
            raise ValueError(f"expected a time of 0 s or more, got {at_s}")
        if not self.identified:
            return Parameter.not_identified(self.reason)
        rate, settled, initial = self.draws.T
        values = relaxed_degc(rate, settled, initial, at_s)
        wander = self.wander_degc * np.random.default_rng(1).standard_normal(values.size)
        low, high = np.quantile(values + wander, (0.025, 0.975))
        return Parameter(float(np.median(values)), (float(low), float(high)))

    def time_to(self, temperature_degc: float) -> Parameter:
        """Return when, in seconds after the first sample, it will be at a temperature.

        Not identified where the temperature lies beyond what the curve goes to, or so close to it
        that its interval has no end.
        """
        if not math.isfinite(temperature_degc):
            raise ValueError(f"expected a finite temperature, got {temperature_degc}")
        if not self.identified:
            return Parameter.not_identified(self.reason)
        rate, settled, initial = self.draws.T
        times = relaxation_time_s(rate, settled, initial, temperature_degc)
        share = float(np.mean(np.isfinite(times)))
        if share < 0.976:
            settles = f"{self.settled_degc.value:.1f}"
            if share < 0.5:
                why = (
                    f"the gearbox is at {self.initial_degc.value:.1f} degC at the start and "
                    f"settles at {settles} degC; {temperature_degc:g} degC is not in between"
                )
            else:
                why = (
                    f"{temperature_degc:g} degC is too close to where the curve starts or settles "
                    f"({settles} degC) to say when"
                )
            return Parameter.not_identified(f"not identified: {why}")
        low, middle, high = np.quantile(times, (0.025, 0.5, 0.975), method="higher")
        return Parameter(float(middle), (float(low), float(high)))

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        names = ("rate_per_s", "settled_degc", "initial_degc", "ambient_degc", "added_degc")
        return {
            "schema": SCHEMA,
            "identified": self.identified,
            "reason": self.reason,
            "parameters": {name: getattr(self, name).to_json() for name in names},
            "rmse_degc": self.rmse_degc if math.isfinite(self.rmse_degc) else None,
            "duration_s": self.duration_s,
            "sensor_step_degc": self.sensor_step_degc,
        }


def estimate_cooling(
    time_s: Floats, temperature_degc: Floats, ambient_degc: Floats | None = None
) -> Cooling:
    """Identify the law of a cooling or warming curve.

    Parameters
    ----------
    time_s, temperature_degc : ndarray, shape (n,)
        Rising time and temperature; NaN samples are left out. Gaps are welcome.
    ambient_degc : ndarray, shape (n,), optional
        Measured temperature of the environment.

    Raises
    ------
    ValueError
        The arrays have different lengths, or time does not rise.
    """
    time, temperature, ambient = _checked(time_s, temperature_degc, ambient_degc)
    if time.size < _LEAST_POINTS:
        return _nothing(
            f"not identified: {time.size} temperatures; record at least {_LEAST_POINTS} over some "
            "hours without motion",
            time,
            ambient,
        )
    time = time - time[0]
    thin = _thinned(time, temperature, ambient)
    noise = float(np.std(np.diff(thin[1]))) / math.sqrt(2.0)
    change = abs(float(np.mean(thin[1][-3:]) - np.mean(thin[1][:3])))
    change = max(change, float(np.ptp(thin[1])) - _SCATTER * noise)
    if change < max(_NOISES * noise, _LEAST_CHANGE_DEGC):
        return _nothing(
            f"not identified: the temperature is constant ({temperature.min():.1f} to "
            f"{temperature.max():.1f} degC); warm the gearbox up and record while it cools",
            time,
            ambient,
        )
    fit, step = fit_cooling(*thin), step_of(temperature)
    if fit.wander_degc > max(_STRAYS * float(np.ptp(temperature)), 0.5 * step):
        return _nothing(_strays(fit, time), time, ambient)
    if not is_coarse(step, fit.rmse_degc):
        return _described(fit, time, ambient)
    if change < _LEAST_STEPS * step:
        return _nothing(
            f"not identified: the temperature changes by {change:.1f} degC, too little for a "
            f"sensor in steps of {step:.2g} degC; record longer, or with a finer sensor",
            time,
            ambient,
        )
    return _described(fit_steps(time, temperature, ambient, step, fit), time, ambient, step)


def _strays(fit: CoolingDraws, time_s: Floats) -> str:
    return (
        f"not identified: over {float(time_s[-1]) / 3600.0:.2g} h the temperature strays by "
        f"{fit.wander_degc:.1f} degC from one cooling or warming law; take the hours of rest by "
        "themselves, or those under one constant cycle"
    )


def _described(
    fit: CoolingDraws, time_s: Floats, ambient: Floats | None, step_degc: float = 0.0
) -> Cooling:
    """Turn draws into numbers with intervals, or say why the curve carries none."""
    hours = float(time_s[-1]) / 3600.0
    if not fit.bends:
        return _nothing(
            f"not identified: in {hours:.2g} h the curve does not bend enough to tell "
            "how fast it cools from where it settles; record some hours more",
            time_s,
            ambient,
        )
    rate = _quantiles(fit.draws[:, 0], fit.rate_per_s)
    assert rate.ci95 is not None
    if rate.ci95[1] > _LOOSE * rate.ci95[0]:
        return _nothing(
            f"not identified: over {hours:.2g} h the temperature does not follow one "
            "cooling or warming law closely enough; record it at rest, or under one constant cycle",
            time_s,
            ambient,
        )
    settled = _quantiles(fit.draws[:, 1], fit.settled_degc)
    air = _ambient(ambient)
    if air.identified:
        added = _quantiles(fit.draws[:, 1] - air.value, settled.value - air.value)
    else:
        added = Parameter.not_identified(
            "no ambient temperature was measured: what is known is where the gearbox settles"
        )
    return Cooling(
        True,
        "",
        rate,
        settled,
        _quantiles(fit.draws[:, 2], fit.initial_degc),
        air,
        added,
        fit.rmse_degc,
        float(time_s[-1]),
        fit.draws,
        fit.wander_degc,
        step_degc,
    )


def _checked(
    time_s: Floats, temperature_degc: Floats, ambient_degc: Floats | None
) -> tuple[Floats, Floats, Floats | None]:
    """Return finite samples; refuse what is no curve."""
    time = np.asarray(time_s, dtype=np.float64)
    temperature = np.asarray(temperature_degc, dtype=np.float64)
    ambient = None if ambient_degc is None else np.asarray(ambient_degc, dtype=np.float64)
    if time.ndim != 1 or temperature.shape != time.shape:
        raise ValueError(f"expected two arrays (n,), got {time.shape} and {temperature.shape}")
    if ambient is not None and ambient.shape != time.shape:
        raise ValueError(f"expected ambient temperature (n,), got {ambient.shape}")
    kept = np.isfinite(time) & np.isfinite(temperature)
    if ambient is not None:
        kept &= np.isfinite(ambient)
    if np.any(np.diff(time[kept]) <= 0.0):
        raise ValueError("expected time that rises strictly")
    return time[kept], temperature[kept], None if ambient is None else ambient[kept]


def _thinned(
    time_s: Floats, temperature: Floats, ambient: Floats | None
) -> tuple[Floats, Floats, Floats | None]:
    """Return means over neighbouring samples, at most some hundred; none reaches over a gap."""
    block = neighbours(time_s, _POINTS)
    count = np.bincount(block)

    def averaged(values: Floats) -> Floats:
        return np.asarray(np.bincount(block, weights=values) / count, dtype=np.float64)

    air = None if ambient is None else averaged(ambient)
    return averaged(time_s), averaged(temperature), air


def _nothing(reason: str, time_s: Floats, ambient: Floats | None) -> Cooling:
    duration = float(np.ptp(time_s)) if time_s.size else 0.0
    return Cooling.not_identified(reason, duration, _ambient(ambient))


def _ambient(ambient: Floats | None) -> Parameter:
    if ambient is None or not ambient.size:
        return Parameter.not_identified("no ambient temperature was measured")
    mean = float(ambient.mean())
    half = 1.96 * float(ambient.std()) / math.sqrt(ambient.size)
    return Parameter(mean, (mean - half, mean + half))


def _quantiles(draws: Floats, value: float) -> Parameter:
    low, high = np.quantile(draws, (0.025, 0.975))
    return Parameter(value, (min(float(low), value), max(float(high), value)))
