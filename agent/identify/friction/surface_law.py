"""Friction laws over velocity and temperature, and their fit to measured points.

Coulomb friction does not change with temperature; warm oil is thinner, so that the viscous part
falls (`TemperatureViscous`) and, in the richest law, the boundary region reaches to higher speeds
(the Stribeck velocity's line of `ExtendedFriction`). A law is linear in its torques: these are
projected out, and at most four numbers are searched.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.physics.friction import boundary_share
from agent.physics.friction_oil import thinning_share

_SAME_DEGC, _WIDEST_DEGC = 0.75, 1.0
_STARTS = (0.3, 0.55, 0.8)
_TRIALS = 60
_STEEPEST = 0.9  # share of the way to a Stribeck velocity of zero at the coldest point
_FLATTEST_PER_K = 1e-4


@dataclass(frozen=True)
class SurfacePoints:
    """Friction at speeds and temperatures, all of shape (n,).

    `speed_rad_s` is above zero and `friction_nm` opposes the motion: both directions combined.
    `recording` is the number of the recording that each is from: while the gearbox warms up its
    speeds are passed at temperatures of their own, and yet err together.
    """

    speed_rad_s: Floats
    temperature_degc: Floats
    friction_nm: Floats
    error_nm: Floats
    recording: NDArray[np.int64] | None = None

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
            None if self.recording is None else self.recording[kept],
        )

    def groups(self) -> NDArray[np.int64]:
        """Return the number of the temperature that each point was measured at, shape (n,).

        Recordings of the same mean temperature count as one.
        """
        if self.recording is None:
            return _levels(self.temperature_degc)
        _, own = np.unique(self.recording, return_inverse=True)
        means = np.bincount(own, weights=self.temperature_degc) / np.bincount(own)
        return _levels(means)[own]

    def levels_degc(self) -> Floats:
        """Return the mean of each temperature that was measured at, shape (g,), rising."""
        groups = self.groups()
        return np.asarray(np.bincount(groups, weights=self.temperature_degc) / np.bincount(groups))


def _levels(temperature_degc: Floats) -> NDArray[np.int64]:
    """Return numbers, rising, of temperatures that lie apart, shape (n,).

    Where many lie close to their neighbours, as night by night, a level ends where it has grown
    too wide: forty nights from 20 to 26 degrees are no two temperatures.
    """
    order = np.argsort(temperature_degc, kind="stable")
    rising = temperature_degc[order]
    out = np.empty(order.size, dtype=np.int64)
    level, first, last = 0, rising[0], rising[0]
    for place, degc in zip(order, rising, strict=True):
        if degc - last > _SAME_DEGC or degc - first > _WIDEST_DEGC:
            level, first = level + 1, degc
        out[place], last = level, degc
    return out


@dataclass(frozen=True)
class SurfaceLaw:
    """Which parts a law has.

    Parameters
    ----------
    bends : bool
        Has a Stribeck fall.
    thins : bool
        Its viscous part falls with temperature.
    moves : bool
        Its Stribeck velocity grows with temperature.
    """

    bends: bool = False
    thins: bool = False
    moves: bool = False

    @property
    def linear(self) -> tuple[str, ...]:
        """Return the names of the torques and slopes."""
        return (
            "coulomb_nm",
            "viscous_nm_s_per_rad",
            *(("viscous_thinning_nm_s_per_rad",) if self.thins else ()),
            *(("static_extra_nm",) if self.bends else ()),
        )

    @property
    def nonlinear(self) -> tuple[str, ...]:
        """Return the names of what is searched."""
        return (
            *(("stribeck_velocity_rad_s", "exponent") if self.bends else ()),
            *(("stribeck_velocity_growth_per_k",) if self.moves else ()),
            *(("viscous_scale_degc",) if self.thins else ()),
        )

    def columns(
        self, speed: Floats, temperature: Floats, reference_degc: float, nonlinear: Sequence[float]
    ) -> Floats:
        """Return the linear columns at speeds and temperatures, shape (n, m)."""
        values = dict(zip(self.nonlinear, nonlinear, strict=True))
        columns = [np.ones_like(speed), speed]
        if self.thins:
            share = thinning_share(temperature, reference_degc, values["viscous_scale_degc"])
            columns.append(speed * share)
        if self.bends:
            growth = values.get("stribeck_velocity_growth_per_k", 0.0)
            # Beyond the temperatures of the fit the straight line must not reach zero.
            wider = np.maximum(1.0 + growth * (temperature - reference_degc), 1.0 - _STEEPEST)
            fall = values["stribeck_velocity_rad_s"] * wider
            columns.append(boundary_share(speed, fall, values["exponent"]))
        return np.stack(columns, axis=-1)

    def bounds(self, points: SurfacePoints, reference_degc: float) -> list[tuple[float, float]]:
        """Return where each searched number may lie."""
        speed = points.speed_rad_s
        colder = max(reference_degc - float(points.temperature_degc.min()), 1.0)
        known = {
            "stribeck_velocity_rad_s": (0.5 * float(speed.min()), float(speed.max())),
            "exponent": (0.5, 4.0),
            "stribeck_velocity_growth_per_k": (_FLATTEST_PER_K, _STEEPEST / colder),
            "viscous_scale_degc": (3.0, 150.0),
        }
        return [known[name] for name in self.nonlinear]


LAWS: Mapping[str, SurfaceLaw] = MappingProxyType(
    {
        "coulomb-viscous": SurfaceLaw(),
        "stribeck": SurfaceLaw(bends=True),
        "coulomb-viscous, temperature-dependent": SurfaceLaw(thins=True),
        "stribeck, temperature-dependent": SurfaceLaw(bends=True, thins=True),
        "stribeck moving, temperature-dependent": SurfaceLaw(bends=True, thins=True, moves=True),
    }
)
"""The laws by name, simplest first."""


def fit_law(
    points: SurfacePoints, law: SurfaceLaw, reference_degc: float, near: Floats | None = None
) -> tuple[Floats, Floats]:
    """Return linear and searched parameters that minimise the weighted squares.

    Parameters
    ----------
    points : SurfacePoints
    law : SurfaceLaw
    reference_degc : float
        Tr of the viscous part.
    near : ndarray, optional
        Searched parameters to start from, as from a fit to nearly the same points; else the
        search starts at several places.
    """
    from scipy.optimize import least_squares, nnls

    target = points.friction_nm / points.error_nm

    def solve(log_nonlinear: Floats) -> tuple[Floats, Floats]:
        columns = law.columns(
            points.speed_rad_s,
            points.temperature_degc,
            reference_degc,
            [float(x) for x in np.exp(log_nonlinear)],
        )
        scaled = columns / points.error_nm[:, np.newaxis]
        theta = np.asarray(nnls(scaled, target)[0], dtype=np.float64)
        return theta, np.asarray(scaled @ theta - target, dtype=np.float64)

    def residuals(log_nonlinear: Floats) -> Floats:
        return solve(log_nonlinear)[1]

    bounds = law.bounds(points, reference_degc)
    if not bounds:
        return solve(np.zeros(0))[0], np.zeros(0)
    lower, upper = (np.log([b[i] for b in bounds]) for i in (0, 1))
    best: tuple[float, Floats] | None = None
    starts = [lower + share * (upper - lower) for share in _STARTS]
    if near is not None:
        inside = 1e-6 * (upper - lower)
        starts = [np.clip(np.log(near), lower + inside, upper - inside)]
    for start in starts:
        found = least_squares(residuals, start, bounds=(lower, upper), max_nfev=_TRIALS)
        if best is None or found.cost < best[0]:
            best = (float(found.cost), np.asarray(found.x, dtype=np.float64))
    assert best is not None
    return solve(best[1])[0], np.exp(best[1])
