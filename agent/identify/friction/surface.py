"""Friction as a surface over velocity and gearbox temperature (thesis Figure 5.7), per oil.

The laws of `surface_law` are compared on temperatures that they have not seen; the richer one
wins only by more than the comparison's own noise. Whether the Stribeck velocity moves with
temperature is one number more, of which a handful of left-out temperatures says little: a movement
of four standard errors would be missed in one case of four. There the richer law must predict
unseen temperatures better at all, and beat the simpler one over all points beyond chance (F-test).
Intervals come from leaving temperatures out, and from what the law misses alike at all of them
(`surface_misfit`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction.surface_law import LAWS, SurfaceLaw, SurfacePoints, fit_law
from agent.identify.friction.surface_misfit import missed_by_speed
from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import student_975

_LEAST_TEMPERATURES = 4
_LEAST_SPAN_DEGC = 4.0
_MOVES = "stribeck_velocity_growth_per_k"
_BEYOND_CHANCE = 5.0  # ratio of variances with 1 and 40 or more degrees: 3 % of chance
_ON_BOUND = (
    "it comes out as zero, the bound of what is physically possible; temperatures and speeds do "
    "not carry it"
)
_UNTOLD = (
    "whether the Stribeck velocity grows with temperature is not told by these: laws with and "
    "without it follow them alike; record slow speeds at temperatures further apart"
)
_LOOSE = math.log(4.0)  # an interval that spans a factor of four either way is none


@dataclass(frozen=True)
class Surface:
    """The law of friction over velocity and temperature.

    Parameters
    ----------
    oil : str
        Which oil; empty where nobody said.
    identified : bool
        Whether the points carry a temperature law.
    reason : str
        Why not; where a simpler law won, what it was compared with.
    law : str
        One of `LAWS`; empty when nothing could be fitted.
    reference_degc : float
        Tr of the law.
    parameters : mapping of str to Parameter
    rmse_nm, heldout_rmse_nm : float
        Over all points, and over temperatures left out one by one.
    heldout_by_law_nm : mapping of str to float
        The latter for every law.
    measured_degc : tuple of float
        Coldest and warmest temperature of the points.
    without : ndarray, shape (g, p)
        The parameters with each of g temperatures left out, in the law's order.
    missed : ndarray, shape (s, p)
        The parameters as each of s speeds draws them by what the law misses there.
    """

    oil: str
    identified: bool
    reason: str
    law: str = ""
    reference_degc: float = math.nan
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    rmse_nm: float = math.nan
    heldout_rmse_nm: float = math.nan
    heldout_by_law_nm: Mapping[str, float] = field(default_factory=dict)
    measured_degc: tuple[float, float] = (math.nan, math.nan)
    without: Floats = field(default_factory=lambda: np.empty((0, 0)), repr=False)
    missed: Floats = field(default_factory=lambda: np.empty((0, 0)), repr=False)

    def friction_nm(self, speed_rad_s: Floats, temperature_degc: Floats) -> Floats:
        """Return the surface's friction at speeds and temperatures of one shape.

        Raises
        ------
        ValueError
            Where there is no law.
        """
        law = self._law()
        values = [self.parameters[name].value for name in (*law.linear, *law.nonlinear)]
        return self._friction(np.array(values), speed_rad_s, temperature_degc)

    def friction_ci95_nm(self, speed_rad_s: Floats, temperature_degc: Floats) -> Floats:
        """Return both ends of the surface's 95 % interval, of the arguments' shape and two.

        Raises
        ------
        ValueError
            Where there is no law.
        """
        middle = self.friction_nm(speed_rad_s, temperature_degc)
        curves = np.stack([self._friction(v, speed_rad_s, temperature_degc) for v in self.without])
        count = float(len(curves))
        spread = np.sum((curves - curves.mean(axis=0)) ** 2, axis=0)
        square = student_975(count - 1.0) ** 2 * (count - 1.0) / count * spread
        for values in self.missed:
            square += (self._friction(values, speed_rad_s, temperature_degc) - middle) ** 2
        half = np.sqrt(square)
        return np.stack((middle - half, middle + half), axis=-1)

    def _law(self) -> SurfaceLaw:
        if not self.law:
            raise ValueError(f"there is no surface: {self.reason}")
        return LAWS[self.law]

    def _friction(self, values: Floats, speed_rad_s: Floats, temperature_degc: Floats) -> Floats:
        law = self._law()
        speed, temperature = np.broadcast_arrays(speed_rad_s, temperature_degc)
        count = len(law.linear)
        columns = law.columns(
            speed.ravel(), temperature.ravel(), self.reference_degc, list(values[count:])
        )
        return np.asarray(columns @ values[:count], dtype=np.float64).reshape(speed.shape)

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "oil": self.oil,
            "identified": self.identified,
            "reason": self.reason,
            "law": self.law or None,
            "reference_degc": None if math.isnan(self.reference_degc) else self.reference_degc,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "rmse_nm": None if math.isnan(self.rmse_nm) else self.rmse_nm,
            "heldout_rmse_nm": None if math.isnan(self.heldout_rmse_nm) else self.heldout_rmse_nm,
            "heldout_by_law_nm": dict(self.heldout_by_law_nm),
        }


def fit_surface(points: SurfacePoints, *, oil: str = "") -> Surface:
    """Fit friction over velocity and temperature, the law chosen on held-out temperatures.

    Parameters
    ----------
    points : SurfacePoints
        From several cycles at different temperatures.
    oil : str
        Which oil; fit every oil by itself.
    """
    if not points.speed_rad_s.size:
        return Surface(oil, False, "not identified: no friction curve was given")
    groups = points.groups()
    levels = int(groups.max()) + 1
    low, high = float(points.temperature_degc.min()), float(points.temperature_degc.max())
    if high - low < _LEAST_SPAN_DEGC or levels < _LEAST_TEMPERATURES:
        if levels > 1:
            these = f"{levels} temperatures from {low:.1f} to {high:.1f} degC carry"
        else:
            these = f"one temperature ({0.5 * (low + high):.1f} degC) carries"
        return Surface(
            oil,
            False,
            f"not identified: {these} no temperature law; record the same cycle at "
            f"{_LEAST_TEMPERATURES} or more, over at least {_LEAST_SPAN_DEGC:g} degC",
        )
    if np.unique(np.round(points.speed_rad_s, 6)).size < 3 or float(
        points.speed_rad_s.max()
    ) < 2.0 * float(points.speed_rad_s.min()):
        return Surface(
            oil,
            False,
            "not identified: fewer than three speeds, or all within a factor of two, do not tell "
            "viscous friction from Coulomb friction; drive a stair",
        )
    reference = float(np.mean(points.temperature_degc))
    errors = {law: _heldout(points, groups, parts, reference) for law, parts in LAWS.items()}
    law = _chosen(points, reference, errors)
    return _described(points, groups, law, reference, oil, errors)


def _heldout(
    points: SurfacePoints, groups: NDArray[np.int64], law: SurfaceLaw, reference: float
) -> Floats:
    """Return the mean squared error of every temperature, predicted from the others."""
    out = []
    _, near = fit_law(points, law, reference)
    for group in range(int(groups.max()) + 1):
        unseen = groups == group
        theta, nonlinear = fit_law(points.take(~unseen), law, reference, near)
        left = points.take(unseen)
        columns = law.columns(left.speed_rad_s, left.temperature_degc, reference, list(nonlinear))
        out.append(float(np.mean((columns @ theta - left.friction_nm) ** 2)))
    return np.array(out)


def _chosen(points: SurfacePoints, reference: float, errors: Mapping[str, Floats]) -> str:
    """Return the simplest law that no richer one beats by more than the comparison's noise."""
    laws = list(errors)
    chosen = laws[0]
    for law in laws[1:]:
        gain = errors[chosen] - errors[law]
        noise = float(np.std(gain, ddof=1)) / math.sqrt(gain.size)
        if LAWS[law].moves and LAWS[chosen].bends and LAWS[chosen].thins:
            better = gain.mean() > 0.0 and _ratio(points, reference, chosen, law) > _BEYOND_CHANCE
        else:
            better = gain.mean() > noise and errors[law].mean() < 0.9 * errors[chosen].mean()
        if better:
            chosen = law
    return chosen


def _ratio(points: SurfacePoints, reference: float, simple: str, rich: str) -> float:
    """Return F, the fall in squared error a parameter of the richer law, over what it leaves."""
    left = []
    for law in (LAWS[simple], LAWS[rich]):
        theta, nonlinear = fit_law(points, law, reference)
        columns = law.columns(
            points.speed_rad_s, points.temperature_degc, reference, list(nonlinear)
        )
        error = (columns @ theta - points.friction_nm) / points.error_nm
        left.append((float(error @ error), len(theta) + len(nonlinear)))
    (worse, few), (least, many) = left
    freedom = points.friction_nm.shape[0] - many
    return (worse - least) / (many - few) / max(least / freedom, 1e-300) if freedom > 0 else 0.0


def _described(
    points: SurfacePoints,
    groups: NDArray[np.int64],
    law: str,
    reference: float,
    oil: str,
    errors: Mapping[str, Floats],
) -> Surface:
    """Fit the chosen law to all points, with intervals from leaving temperatures out."""
    parts = LAWS[law]
    theta, nonlinear = fit_law(points, parts, reference)
    count = int(groups.max()) + 1
    without = [fit_law(points.take(groups != g), parts, reference, nonlinear) for g in range(count)]
    columns = parts.columns(points.speed_rad_s, points.temperature_degc, reference, list(nonlinear))
    heldout = {name: math.sqrt(float(e.mean())) for name, e in errors.items()}
    temperatures = points.temperature_degc
    missed = missed_by_speed(points, parts, reference, theta, nonlinear)
    parameters = _parameters(parts, theta, nonlinear, without, missed)
    if parts.bends and parts.thins and not parts.moves:
        parameters[_MOVES] = Parameter.not_identified(_UNTOLD)
    return Surface(
        oil,
        parts.thins,
        ""
        if parts.thins
        else "no temperature dependence: laws with one do not predict unseen temperatures better",
        law,
        reference,
        parameters,
        float(np.sqrt(np.mean((columns @ theta - points.friction_nm) ** 2))),
        heldout[law],
        heldout,
        (float(temperatures.min()), float(temperatures.max())),
        np.stack([np.concatenate(pair) for pair in without]),
        np.column_stack(
            (theta + missed[:, : theta.size], nonlinear * np.exp(missed[:, theta.size :]))
        ),
    )


def _parameters(
    law: SurfaceLaw,
    theta: Floats,
    nonlinear: Floats,
    without: list[tuple[Floats, Floats]],
    missed: Floats,
) -> dict[str, Parameter]:
    """Return every parameter with its interval, without one temperature and by what is missed."""
    count = float(len(without))
    values = np.concatenate((theta, np.log(nonlinear)))
    left = np.stack([np.concatenate((linear, np.log(other))) for linear, other in without])
    spread = np.sum((left - left.mean(axis=0)) ** 2, axis=0)
    half = student_975(count - 1.0) * np.sqrt((count - 1.0) / count * spread)
    half = np.hypot(half, np.linalg.norm(missed, axis=0))
    out: dict[str, Parameter] = {}
    for i, name in enumerate(law.linear):
        if values[i] <= 0.0:
            out[name] = Parameter.not_identified(_ON_BOUND, values[i])
        else:
            out[name] = Parameter(values[i], (values[i] - half[i], values[i] + half[i]))
    for i, name in enumerate(law.nonlinear, start=theta.size):
        value = math.exp(values[i])
        if half[i] > _LOOSE:
            out[name] = Parameter.not_identified(
                "the temperatures and speeds carry its order of magnitude only", value
            )
        else:
            out[name] = Parameter(
                value, (math.exp(values[i] - half[i]), math.exp(values[i] + half[i]))
            )
    return out
