"""The friction curve now against the healthy one at equal temperature, payload and load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import mean_rows
from agent.monitor.compensation.compensation import ONE_SPEED, PRIORS, Conditions, Law, Prior
from agent.monitor.compensation.fit import learn
from agent.monitor.history.cycle import Cycle
from agent.monitor.history.features import CycleFeatures, SpeedGrid
from agent.monitor.history.table import conditions_of

_NORMAL_975 = 1.959963984540054
_SHRINK = 0.5
_PRIOR_OF_MEAN: Mapping[str, Prior] = {
    "low": PRIORS["low_integral_w"],
    "high": PRIORS["integral_w"],
    "whole": PRIORS["integral_w"],
}


@dataclass(frozen=True)
class Effect:
    """A change of the mean friction torque over a range of speeds, at equal conditions.

    `change_nm` and `percent` (of the healthy value) have 95 % intervals.
    """

    from_rad_s: float
    to_rad_s: float
    healthy_nm: float
    change_nm: float
    ci95_nm: tuple[float, float]

    @property
    def percent(self) -> float:
        """Return the change as a percentage."""
        return 100.0 * self.change_nm / self.healthy_nm

    @property
    def ci95_percent(self) -> tuple[float, float]:
        """Return both ends of the interval in per cent."""
        low, high = (100.0 * end / self.healthy_nm for end in self.ci95_nm)
        return min(low, high), max(low, high)

    @property
    def clear(self) -> bool:
        """Return whether the interval excludes no change."""
        return not self.ci95_nm[0] <= 0.0 <= self.ci95_nm[1]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "from_rad_s": self.from_rad_s,
            "to_rad_s": self.to_rad_s,
            "healthy_nm": self.healthy_nm,
            "change_nm": self.change_nm,
            "ci95_nm": list(self.ci95_nm),
            "change_percent": self.percent,
            "ci95_percent": list(self.ci95_percent),
        }


@dataclass(frozen=True)
class Comparison:
    """What changed, speed by speed; arrays of shape (m,), covariance (m, m).

    Parameters
    ----------
    speed_rad_s : ndarray
    healthy_nm, healthy_deviation_nm : ndarray
        The healthy curve under the conditions of now.
    now_nm, now_deviation_nm : ndarray
        Mean of the last cycles.
    covariance_nm2 : ndarray
        Of the difference.
    slope_nm_per_k : ndarray
        What one degree does to the healthy curve; zero where no temperature is known.
    effects : mapping of str to Effect
        ``low``, ``high`` and ``whole``.
    cycles : tuple of str
        Names of the cycles of now.
    temperature_degc : float
        Mean of those; NaN for unknown.
    extrapolated : bool
        Whether now's conditions are outside of the healthy ones.
    """

    speed_rad_s: Floats
    healthy_nm: Floats
    healthy_deviation_nm: Floats
    now_nm: Floats
    now_deviation_nm: Floats
    covariance_nm2: Floats
    slope_nm_per_k: Floats
    effects: Mapping[str, Effect]
    cycles: tuple[str, ...]
    temperature_degc: float
    healthy_degc: tuple[float, float]
    extrapolated: bool

    @property
    def change_nm(self) -> Floats:
        """Return now less healthy, shape (m,)."""
        return self.now_nm - self.healthy_nm

    @property
    def changes_nm(self) -> list[float]:
        """Return the effects' changes and the ends of their intervals: one unit is for all."""
        return [n for e in self.effects.values() for n in (e.change_nm, *e.ci95_nm)]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        reach = _NORMAL_975 * self.healthy_deviation_nm
        now = _NORMAL_975 * self.now_deviation_nm
        return {
            "cycles": list(self.cycles),
            "temperature_degc": _number(self.temperature_degc),
            "healthy_temperature_degc": [_number(t) for t in self.healthy_degc],
            "extrapolated": self.extrapolated,
            "speed_rad_s": self.speed_rad_s.tolist(),
            "healthy_nm": self.healthy_nm.tolist(),
            "healthy_ci95_nm": np.column_stack(
                (self.healthy_nm - reach, self.healthy_nm + reach)
            ).tolist(),
            "now_nm": self.now_nm.tolist(),
            "now_ci95_nm": np.column_stack((self.now_nm - now, self.now_nm + now)).tolist(),
            "effects": {name: effect.to_json() for name, effect in self.effects.items()},
        }


def compare(
    cycles: Sequence[Cycle],
    features: Sequence[CycleFeatures],
    grid: SpeedGrid,
    healthy: int,
    now: slice,
) -> Comparison:
    """Compare the curves of the cycles `now` with what the healthy ones let expect for them.

    Parameters
    ----------
    cycles, features : sequence
        Of one segment, in order of time.
    grid : SpeedGrid
    healthy : int
        How many of the first cycles are healthy.
    now : slice
        Which cycles are compared, at least one.
    """
    curves = np.stack([f.friction_nm for f in features])
    noise = np.stack([f.deviation_nm for f in features])
    conditions = conditions_of(cycles)
    before = conditions.take(slice(0, healthy))
    laws = [
        learn(before, curves[:healthy, j], noise[:healthy, j], ONE_SPEED)
        for j in range(curves.shape[1])
    ]
    latest = conditions.take(now)
    expected = np.stack([law.level + law.effect(latest)[0] for law in laws], axis=-1)
    shared = np.stack([law.effect(latest)[1] for law in laws], axis=-1)
    left = curves[:healthy] - np.stack([law.level + law.effect(before)[0] for law in laws], axis=-1)
    own = _own_covariance(left, noise[now], laws)
    count = expected.shape[0]
    off = shared.mean(axis=0)
    learned = own / healthy + np.outer(off, off)
    means = np.stack([f.friction_nm for f in features])
    return Comparison(
        speed_rad_s=grid.speed_rad_s,
        healthy_nm=expected.mean(axis=0),
        healthy_deviation_nm=np.sqrt(np.diag(learned)),
        now_nm=curves[now].mean(axis=0),
        now_deviation_nm=np.sqrt(np.diag(own) / count),
        covariance_nm2=learned + own / count,
        slope_nm_per_k=np.array([_slope(law) for law in laws]),
        effects={
            name: _effect(name, grid, row, means, noise, conditions, healthy, now)
            for name, row in mean_rows(grid).items()
        },
        cycles=tuple(c.name for c in cycles[now]),
        temperature_degc=float(np.mean(latest.temperature_degc)),
        healthy_degc=(laws[0].basis.lowest[0], laws[0].basis.highest[0]),
        extrapolated=bool(np.any(laws[0].extrapolates(latest))),
    )


def _own_covariance(left: Floats, noise: Floats, laws: Sequence[Law]) -> Floats:
    """Return the covariance of one cycle's curve about its law, shape (m, m).

    The healthy cycles are few beside the speeds: their correlations are drawn half way to none.
    """
    size = np.sqrt(np.array([law.scatter for law in laws]) ** 2 + np.mean(noise**2, axis=0))
    scatter = np.maximum(np.sqrt(np.mean(left**2, axis=0)), 1e-12)
    correlation = (left / scatter).T @ (left / scatter) / left.shape[0]
    drawn = (1.0 - _SHRINK) * correlation + _SHRINK * np.eye(size.size)
    return np.asarray(drawn * np.outer(size, size))


def _slope(law: Law) -> float:
    return law.slope_per_k[0] * law.level if law.basis.temperature else 0.0


def _effect(
    name: str,
    grid: SpeedGrid,
    row: Floats,
    curves: Floats,
    noise: Floats,
    conditions: Conditions,
    healthy: int,
    now: slice,
) -> Effect:
    """Return the change of one mean torque, as a feature of its own: so errors add up right."""
    values, deviations = curves @ row, np.sqrt(noise**2 @ row**2)
    before = conditions.take(slice(0, healthy))
    law = learn(before, values[:healthy], deviations[:healthy], _PRIOR_OF_MEAN[name])
    latest = conditions.take(now)
    effect, shared = law.effect(latest)
    own = np.hypot(deviations[now], law.scatter)
    expected = law.level + float(effect.mean())
    change = float(values[now].mean()) - expected
    deviation = float(
        np.sqrt(np.mean(own**2) / own.size + np.mean(shared) ** 2 + law.level_deviation**2)
    )
    reach = _NORMAL_975 * deviation
    ends = {
        "low": (float(grid.speed_rad_s[0]), grid.low_rad_s),
        "high": (grid.low_rad_s, float(grid.speed_rad_s[-1])),
        "whole": (float(grid.speed_rad_s[0]), float(grid.speed_rad_s[-1])),
    }[name]
    return Effect(*ends, expected, change, (change - reach, change + reach))


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
