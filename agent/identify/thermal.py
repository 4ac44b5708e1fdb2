"""How fast a gearbox cools, where it settles, and when it will be at a given temperature.

Newton's law with a heat source is `agent.physics.thermal.GearboxTemperature`; the settled
temperature is the ambient one and what the heat source adds; an ambient temperature that was
measured may change, and is followed. The law is linear in everything but its rate r: r is scanned
on a grid, each point weighted by its likelihood with coloured residuals, and intervals are
quantiles of draws from it. A curve too short to bend says so: r and the settled temperature then
trade against each other, and neither is given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import correlation_time, student_975
from agent.physics.thermal import followed_k, relaxation_columns, relaxation_time_s, relaxed_degc

SCHEMA = "stribeck.cooling/1"
_POINTS = 400
_GRID = 240
_DRAWS = 4000
_LEAST_POINTS = 12
_SLOWEST, _FASTEST = 2e-3, 60.0  # r times the curve's duration
_LOOSE = 5.0  # ratio of the ends of r's interval that leaves its order of magnitude only
_EDGE_WEIGHT = 0.02
_NOISES = 6.0  # change of temperature, in deviations of the noise, below which it is constant
_LEAST_CHANGE_DEGC = 0.3


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

    def forecast(self, at_s: float) -> Parameter:
        """Return the temperature `at_s` seconds after the first sample, with its interval.

        The environment and the heat source are taken to stay as they were; the scatter of the
        curve itself is counted.
        """
        if not (math.isfinite(at_s) and at_s >= 0.0):
            raise ValueError(f"expected a time of 0 s or more, got {at_s}")
        if not self.identified:
            return Parameter.not_identified(self.reason)
        rate, settled, initial = self.draws.T
        values = relaxed_degc(rate, settled, initial, at_s)
        noise = np.random.default_rng(1).normal(0.0, self.rmse_degc, values.size)
        low, high = np.quantile(values + noise, (0.025, 0.975))
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
    start_s = float(time[0])
    time, temperature, ambient = _thinned(time - start_s, temperature, ambient)
    noise = float(np.std(np.diff(temperature))) / math.sqrt(2.0)
    change = abs(float(np.mean(temperature[-3:]) - np.mean(temperature[:3])))
    if change < max(_NOISES * noise, _LEAST_CHANGE_DEGC):
        return _nothing(
            f"not identified: the temperature is constant ({temperature.min():.1f} to "
            f"{temperature.max():.1f} degC); warm the gearbox up and record while it cools",
            time,
            ambient,
        )
    return _fitted(time, temperature, ambient)


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
    """Return means over neighbouring samples, at most some hundred; nothing is averaged a gap."""
    block = -(-time_s.size // _POINTS)
    if block < 2:
        return time_s, temperature, ambient
    starts = np.arange(0, time_s.size, block)
    count = np.diff(np.append(starts, time_s.size))
    means = [
        None if x is None else np.add.reduceat(x, starts) / count
        for x in (time_s, temperature, ambient)
    ]
    assert means[0] is not None
    assert means[1] is not None
    return means[0], means[1], means[2]


def _nothing(reason: str, time_s: Floats, ambient: Floats | None) -> Cooling:
    none = Parameter.not_identified(reason)
    duration = float(np.ptp(time_s)) if time_s.size else 0.0
    air = _ambient(ambient)
    return Cooling(False, reason, none, none, none, air, none, math.nan, duration, np.empty((0, 3)))


def _ambient(ambient: Floats | None) -> Parameter:
    if ambient is None or not ambient.size:
        return Parameter.not_identified("no ambient temperature was measured")
    mean = float(ambient.mean())
    half = 1.96 * float(ambient.std()) / math.sqrt(ambient.size)
    return Parameter(mean, (mean - half, mean + half))


def _followed(rate: float, time_s: Floats, ambient: Floats | None) -> Floats:
    """Return the gearbox's answer to the ambient temperature's changes about its mean."""
    if ambient is None:
        return np.zeros_like(time_s)
    return followed_k(rate, time_s, ambient - ambient.mean())


def _solve(
    rate: float, time_s: Floats, temperature: Floats, ambient: Floats | None
) -> tuple[Floats, Floats]:
    """Return (settled, initial) and the residuals for one r."""
    columns = relaxation_columns(rate, time_s)
    target = temperature - _followed(rate, time_s, ambient)
    theta = np.linalg.lstsq(columns, target, rcond=None)[0]
    return np.asarray(theta, dtype=np.float64), np.asarray(target - columns @ theta)


def _fitted(time_s: Floats, temperature: Floats, ambient: Floats | None) -> Cooling:
    """Scan r, weigh, draw."""
    duration = float(time_s[-1])
    log_rate = np.linspace(math.log(_SLOWEST / duration), math.log(_FASTEST / duration), _GRID)
    for _ in range(3):
        solutions = [_solve(math.exp(x), time_s, temperature, ambient) for x in log_rate]
        squares = np.array([float(e @ e) for _, e in solutions])
        best = int(np.argmin(squares))
        tau = correlation_time([solutions[best][1]])
        dof = max(time_s.size / tau - 3.0, 1.0)
        variance = max(squares[best] / max(time_s.size - 3.0, 1.0), 1e-12) * tau
        variance *= max((time_s.size / tau) / dof, 1.0)
        weight = (1.0 + (squares - squares[best]) / (variance * dof)) ** (-0.5 * (dof + 1.0))
        kept = np.flatnonzero(weight > 1e-6)
        low, high = max(kept[0] - 1, 0), min(kept[-1] + 1, log_rate.size - 1)
        if high - low > _GRID // 3:
            break
        log_rate = np.linspace(log_rate[low], log_rate[high], _GRID)
    lowest = math.log(1.01 * _SLOWEST / duration)
    if (weight[0] > _EDGE_WEIGHT and log_rate[0] <= lowest) or best == 0:
        return _nothing(
            f"not identified: in {duration / 3600.0:.2g} h the curve does not bend enough to tell "
            "how fast it cools from where it settles; record some hours more",
            time_s,
            ambient,
        )
    draws = _draw(log_rate, weight, solutions, time_s, variance, dof)
    rmse = math.sqrt(squares[best] / time_s.size)
    rate = _quantiles(draws[:, 0], math.exp(float(log_rate[best])))
    assert rate.ci95 is not None
    if rate.ci95[1] > _LOOSE * rate.ci95[0]:
        return _nothing(
            f"not identified: over {duration / 3600.0:.2g} h the temperature does not follow one "
            "cooling or warming law closely enough; record it at rest, or under one constant cycle",
            time_s,
            ambient,
        )
    settled = _quantiles(draws[:, 1], float(solutions[best][0][0]))
    initial = _quantiles(draws[:, 2], float(solutions[best][0][1]))
    air = _ambient(ambient)
    if air.identified:
        added = _quantiles(draws[:, 1] - air.value, settled.value - air.value)
    else:
        added = Parameter.not_identified(
            "no ambient temperature was measured: what is known is where the gearbox settles"
        )
    return Cooling(True, "", rate, settled, initial, air, added, rmse, duration, draws)


def _draw(
    log_rate: Floats,
    weight: Floats,
    solutions: list[tuple[Floats, Floats]],
    time_s: Floats,
    variance: float,
    dof: float,
) -> Floats:
    """Return draws of (r, settled, initial); a fixed seed: same data, same answer."""
    generator = np.random.default_rng(0)
    picked = np.sort(generator.choice(weight.size, size=_DRAWS, p=weight / weight.sum()))
    out = np.empty((_DRAWS, 3))
    inflation = student_975(dof) / student_975(math.inf)
    for i in np.unique(picked):
        rows = np.flatnonzero(picked == i)
        rate = math.exp(float(log_rate[i]))
        columns = relaxation_columns(rate, time_s)
        covariance = np.linalg.pinv(columns.T @ columns, hermitian=True) * variance * inflation**2
        out[rows, 0] = rate
        out[rows, 1:] = generator.multivariate_normal(solutions[i][0], covariance, rows.size)
    # The grid is a staircase; a draw lies anywhere on its step.
    step = float(log_rate[1] - log_rate[0])
    out[:, 0] *= np.exp(step * (generator.random(_DRAWS) - 0.5))
    return out


def _quantiles(draws: Floats, value: float) -> Parameter:
    low, high = np.quantile(draws, (0.025, 0.975))
    return Parameter(value, (min(float(low), value), max(float(high), value)))
