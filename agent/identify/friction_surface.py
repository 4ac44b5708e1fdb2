"""Friction as a surface over velocity and gearbox temperature (thesis Figure 5.7), per oil.

Coulomb friction and the Stribeck line (`agent.physics.friction`) do not change with temperature;
warm oil is thinner, so that the viscous part does (`TemperatureViscous` in
`agent.physics.friction_static`). Four laws are compared on temperatures that they have not seen;
the richer one wins only by more than the comparison's own noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import student_975
from agent.physics.friction import boundary_share
from agent.physics.friction_static import thinning_share

_LEAST_TEMPERATURES = 4
_LEAST_SPAN_DEGC = 4.0
_SAME_DEGC = 0.75
_LOOSE = math.log(4.0)  # an interval that spans a factor of four either way is none

_STRIBECK = ("stribeck_velocity_rad_s", "exponent")
_SCALE = "viscous_scale_degc"
LAWS: Mapping[str, tuple[bool, bool]] = {
    "coulomb-viscous": (False, False),
    "stribeck": (True, False),
    "coulomb-viscous, temperature-dependent": (False, True),
    "stribeck, temperature-dependent": (True, True),
}
"""Name to (has a Stribeck fall, thins with temperature), simplest first."""


@dataclass(frozen=True)
class SurfacePoints:
    """Friction at speeds and temperatures, all of shape (n,).

    `speed_rad_s` is above zero and `friction_nm` opposes the motion: both directions combined.
    """

    speed_rad_s: Floats
    temperature_degc: Floats
    friction_nm: Floats
    error_nm: Floats

    def __post_init__(self) -> None:
        """Refuse arrays of different shapes and numbers that are none."""
        arrays = (self.speed_rad_s, self.temperature_degc, self.friction_nm, self.error_nm)
        if len({np.shape(a) for a in arrays}) != 1 or np.ndim(arrays[0]) != 1:
            raise ValueError(f"expected four arrays (n,), got {[np.shape(a) for a in arrays]}")
        if not all(np.isfinite(a).all() for a in arrays) or (self.error_nm <= 0.0).any():
            raise ValueError("expected finite numbers and errors above zero")

    def take(self, kept: NDArray[np.bool_]) -> SurfacePoints:
        """Return the points where `kept`, shape (n,), is true."""
        return SurfacePoints(
            self.speed_rad_s[kept],
            self.temperature_degc[kept],
            self.friction_nm[kept],
            self.error_nm[kept],
        )

    def groups(self) -> NDArray[np.int64]:
        """Return the number of the temperature that each point was measured at, shape (n,)."""
        order = np.argsort(self.temperature_degc, kind="stable")
        steps = np.diff(self.temperature_degc[order], prepend=self.temperature_degc[order[0]])
        out = np.empty(order.size, dtype=np.int64)
        out[order] = np.cumsum(steps > _SAME_DEGC)
        return out


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

    def friction_nm(self, speed_rad_s: Floats, temperature_degc: Floats) -> Floats:
        """Return the surface's friction at speeds and temperatures of one shape.

        Raises
        ------
        ValueError
            Where there is no law.
        """
        if not self.law:
            raise ValueError(f"there is no surface: {self.reason}")
        bend, thins = LAWS[self.law]
        values = {name: p.value for name, p in self.parameters.items()}
        nonlinear = [values[name] for name in _nonlinear(bend, thins)]
        speed, temperature = np.broadcast_arrays(speed_rad_s, temperature_degc)
        columns = _columns(
            speed.ravel(), temperature.ravel(), self.reference_degc, bend, thins, nonlinear
        )
        weights = np.array([values[name] for name in _linear(bend, thins)])
        return np.asarray(columns @ weights, dtype=np.float64).reshape(speed.shape)

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
        return Surface(
            oil,
            False,
            f"not identified: {levels} temperature{'s' if levels > 1 else ''} from {low:.1f} to "
            f"{high:.1f} degC carry no temperature law; record the same cycle at "
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
    errors = {law: _heldout(points, groups, law, reference) for law in LAWS}
    law = _chosen(errors)
    return _described(points, groups, law, reference, oil, errors)


def _nonlinear(bend: bool, thins: bool) -> tuple[str, ...]:
    return (_STRIBECK if bend else ()) + ((_SCALE,) if thins else ())


def _linear(bend: bool, thins: bool) -> tuple[str, ...]:
    return (
        "coulomb_nm",
        "viscous_nm_s_per_rad",
        *(("viscous_thinning_nm_s_per_rad",) if thins else ()),
        *(("static_extra_nm",) if bend else ()),
    )


def _columns(
    speed: Floats,
    temperature: Floats,
    reference: float,
    bend: bool,
    thins: bool,
    nonlinear: Sequence[float],
) -> Floats:
    """Return the law's linear columns at speeds and temperatures, shape (n, m)."""
    columns = [np.ones_like(speed), speed]
    if thins:
        columns.append(speed * thinning_share(temperature, reference, nonlinear[-1]))
    if bend:
        columns.append(boundary_share(speed, nonlinear[0], nonlinear[1]))
    return np.stack(columns, axis=-1)


def _fit(points: SurfacePoints, law: str, reference: float) -> tuple[Floats, Floats]:
    """Return linear and non-linear parameters that minimise the weighted squares."""
    from scipy.optimize import least_squares, nnls

    bend, thins = LAWS[law]
    speed, temperature = points.speed_rad_s, points.temperature_degc
    target = points.friction_nm / points.error_nm

    def solve(log_nonlinear: Floats) -> tuple[Floats, Floats]:
        columns = _columns(speed, temperature, reference, bend, thins, list(np.exp(log_nonlinear)))
        scaled = columns / points.error_nm[:, np.newaxis]
        theta = np.asarray(nnls(scaled, target)[0], dtype=np.float64)
        return theta, np.asarray(scaled @ theta - target, dtype=np.float64)

    def residuals(log_nonlinear: Floats) -> Floats:
        return solve(log_nonlinear)[1]

    bounds = []
    if bend:
        bounds += [(0.5 * float(speed.min()), float(speed.max())), (0.5, 4.0)]
    if thins:
        bounds += [(3.0, 150.0)]
    if not bounds:
        return solve(np.zeros(0))[0], np.zeros(0)
    lower, upper = (np.log([b[i] for b in bounds]) for i in (0, 1))
    best: tuple[float, Floats] | None = None
    for share in (0.3, 0.55, 0.8):
        start = lower + share * (upper - lower)
        found = least_squares(residuals, start, bounds=(lower, upper), max_nfev=60)
        if best is None or found.cost < best[0]:
            best = (float(found.cost), np.asarray(found.x, dtype=np.float64))
    assert best is not None
    return solve(best[1])[0], np.exp(best[1])


def _heldout(
    points: SurfacePoints, groups: NDArray[np.int64], law: str, reference: float
) -> Floats:
    """Return the mean squared error of every temperature, predicted from the others."""
    bend, thins = LAWS[law]
    out = []
    for group in range(int(groups.max()) + 1):
        unseen = groups == group
        theta, nonlinear = _fit(points.take(~unseen), law, reference)
        left = points.take(unseen)
        columns = _columns(
            left.speed_rad_s, left.temperature_degc, reference, bend, thins, list(nonlinear)
        )
        out.append(float(np.mean((columns @ theta - left.friction_nm) ** 2)))
    return np.array(out)


def _chosen(errors: Mapping[str, Floats]) -> str:
    """Return the simplest law that no richer one beats by more than the comparison's noise."""
    laws = list(errors)
    chosen = laws[0]
    for law in laws[1:]:
        gain = errors[chosen] - errors[law]
        noise = float(np.std(gain, ddof=1)) / math.sqrt(gain.size)
        if float(gain.mean()) > noise and errors[law].mean() < 0.9 * errors[chosen].mean():
            chosen = law
    return chosen


def _described(
    points: SurfacePoints,
    groups: NDArray[np.int64],
    law: str,
    reference: float,
    oil: str,
    errors: Mapping[str, Floats],
) -> Surface:
    """Fit the chosen law to all points, with intervals from leaving temperatures out."""
    bend, thins = LAWS[law]
    theta, nonlinear = _fit(points, law, reference)
    values = np.concatenate((theta, np.log(nonlinear)))
    count = int(groups.max()) + 1
    without = []
    for group in range(count):
        linear_g, nonlinear_g = _fit(points.take(groups != group), law, reference)
        without.append(np.concatenate((linear_g, np.log(nonlinear_g))))
    spread = np.stack(without) - np.mean(without, axis=0)
    half = student_975(count - 1.0) * np.sqrt((count - 1.0) / count * np.sum(spread**2, axis=0))
    parameters: dict[str, Parameter] = {}
    for i, name in enumerate(_linear(bend, thins)):
        parameters[name] = Parameter(values[i], (values[i] - half[i], values[i] + half[i]))
    for i, name in enumerate(_nonlinear(bend, thins), start=theta.size):
        value = math.exp(values[i])
        if half[i] > _LOOSE:
            parameters[name] = Parameter.not_identified(
                "the temperatures and speeds carry its order of magnitude only", value
            )
        else:
            low, high = math.exp(values[i] - half[i]), math.exp(values[i] + half[i])
            parameters[name] = Parameter(value, (low, high))
    columns = _columns(
        points.speed_rad_s, points.temperature_degc, reference, bend, thins, list(nonlinear)
    )
    heldout = {name: math.sqrt(float(e.mean())) for name, e in errors.items()}
    reason = (
        ""
        if thins
        else ("no temperature dependence: laws with one do not predict unseen temperatures better")
    )
    return Surface(
        oil,
        thins,
        reason,
        law,
        reference,
        parameters,
        float(np.sqrt(np.mean((columns @ theta - points.friction_nm) ** 2))),
        heldout[law],
        heldout,
    )
