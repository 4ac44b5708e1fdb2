"""Static laws of sliding friction, each written once: equation, parameters, source, limits.

All laws are odd in velocity (motor side, rad/s) and give the friction torque that opposes motion
with the sign of the velocity, so that ``torque - friction`` accelerates the joint. At rest they
return zero: friction at standstill is indeterminate and belongs to no static law.

A law is *separable*: given its non-linear parameters it is linear in the others,
``friction = columns(velocity, nonlinear) @ linear``. Estimators project the linear part out and
search the non-linear part alone (variable projection, Golub & Pereyra 1973; the extensive search
of the thesis, section 4.4.3, is the same idea on a grid).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class NonlinearRange:
    """Where one non-linear parameter may lie, as a function of the speeds at hand.

    Parameters
    ----------
    name : str
        The parameter's name, unit included.
    lower, upper : float
        Bounds; when `per_speed` is ``+1`` they are multiples of the lowest and highest speed, when
        ``-1`` of the reciprocals of the highest and lowest speed, and when ``0`` absolute.
    per_speed : int
        How the parameter scales with a change of the unit of speed.
    logarithmic : bool
        Whether a grid over it is even in its logarithm.
    """

    name: str
    lower: float
    upper: float
    per_speed: int
    logarithmic: bool

    def bounds(self, slowest_rad_s: float, fastest_rad_s: float) -> tuple[float, float]:
        """Return the bounds for data between two speeds (both above zero, rad/s)."""
        if self.per_speed > 0:
            return self.lower * slowest_rad_s, self.upper * fastest_rad_s
        if self.per_speed < 0:
            return self.lower / fastest_rad_s, self.upper / slowest_rad_s
        return self.lower, self.upper


@dataclass(frozen=True)
class FrictionLaw:
    """One friction law and its split into a linear and a non-linear part.

    Parameters
    ----------
    name : str
        As in contract section 7.
    linear, nonlinear : tuple of str
        Parameter names with units; `nonlinear` has one `NonlinearRange` each in `ranges`.
    columns : callable
        ``columns(velocity (n,), *nonlinear) -> (..., n, len(linear))``; non-linear parameters may
        be arrays that broadcast against each other and lead the result's shape.
    source : str
        Where the equation comes from.
    limits : str
        Where it stops being true.
    """

    name: str
    linear: tuple[str, ...]
    ranges: tuple[NonlinearRange, ...]
    columns: Callable[..., Floats]
    source: str
    limits: str

    @property
    def nonlinear(self) -> tuple[str, ...]:
        """Return the names of the non-linear parameters."""
        return tuple(r.name for r in self.ranges)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Return all parameter names, linear ones first."""
        return self.linear + self.nonlinear

    def torque(self, velocity_rad_s: ArrayLike, parameters: Mapping[str, float]) -> Floats:
        """Return the friction torque in N m, of the velocity's shape.

        Raises
        ------
        ValueError
            Naming the parameters that are missing.
        """
        missing = [name for name in self.parameters if name not in parameters]
        if missing:
            raise ValueError(f"{self.name} needs {', '.join(self.parameters)}; missing: {missing}")
        velocity = np.asarray(velocity_rad_s, dtype=np.float64)
        columns = self.columns(velocity.ravel(), *(parameters[name] for name in self.nonlinear))
        linear = np.array([parameters[name] for name in self.linear], dtype=np.float64)
        return np.asarray(columns @ linear, dtype=np.float64).reshape(velocity.shape)


def _leading(*nonlinear: ArrayLike) -> list[Floats]:
    """Return the non-linear parameters with one trailing axis, to broadcast against samples."""
    return [
        np.asarray(p, dtype=np.float64)[..., np.newaxis] for p in np.broadcast_arrays(*nonlinear)
    ]


def _stack(*columns: Floats) -> Floats:
    """Return the columns side by side, broadcast to one shape, along a new last axis."""
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def boundary_share(
    velocity_rad_s: Floats | float,
    stribeck_velocity_rad_s: Floats | float,
    exponent: Floats | float,
) -> Floats:
    """Return the Stribeck line ``exp(-|v/vs|^d)``, from 1 at rest to 0, broadcast (no unit)."""
    return np.asarray(np.exp(-((np.abs(velocity_rad_s) / stribeck_velocity_rad_s) ** exponent)))


def _coulomb_viscous_columns(velocity_rad_s: Floats) -> Floats:
    """Return ``[sign v, v]``, shape (n, 2); thesis (3.9)."""
    return _stack(np.sign(velocity_rad_s), velocity_rad_s)


def _stribeck_columns(
    velocity_rad_s: Floats, stribeck_velocity_rad_s: ArrayLike, exponent: ArrayLike
) -> Floats:
    """Return ``[sign v, v, sign v exp(-|v/vs|^d)]``, shape (..., n, 3)."""
    scale, power = _leading(stribeck_velocity_rad_s, exponent)
    direction = np.sign(velocity_rad_s)
    boundary = boundary_share(velocity_rad_s, scale, power)
    return _stack(direction, velocity_rad_s, direction * boundary)


def _feeny_moon_columns(velocity_rad_s: Floats, mu: ArrayLike, beta: ArrayLike) -> Floats:
    """Return ``[sign v (mu + (1 - mu)/cosh(beta v)), v]``, shape (..., n, 2); thesis (4.22)."""
    share, rate = _leading(mu, beta)
    # 1/cosh x written with exp(-|x|), which cannot overflow at high speed.
    decay = np.exp(-np.abs(rate * velocity_rad_s))
    sech = 2.0 * decay / (1.0 + decay * decay)
    level = np.sign(velocity_rad_s) * (share + (1.0 - share) * sech)
    return _stack(level, velocity_rad_s)


COULOMB_VISCOUS = FrictionLaw(
    name="coulomb-viscous",
    linear=("coulomb_nm", "viscous_nm_s_per_rad"),
    ranges=(),
    columns=_coulomb_viscous_columns,
    source="thesis (3.9): fc sign(v) + fv v",
    limits="sliding only; no fall of friction at low speed, no bend at high speed",
)

STRIBECK = FrictionLaw(
    name="stribeck",
    linear=("coulomb_nm", "viscous_nm_s_per_rad", "static_extra_nm"),
    ranges=(
        # Slower than half the slowest speed the fall is over before the first point; beyond the
        # fastest it is a straight line, and so a viscous term.
        NonlinearRange("stribeck_velocity_rad_s", 0.5, 1.0, per_speed=1, logarithmic=True),
        NonlinearRange("exponent", 0.5, 4.0, per_speed=0, logarithmic=True),
    ),
    columns=_stribeck_columns,
    source=(
        "[fc + fs exp(-|v/vs|^d)] sign(v) + fv v; Armstrong-Helouvry, Dupont, Canudas de Wit, "
        "Automatica 30 (1994) 1083, with the exponent left free"
    ),
    limits="sliding only; one lubrication regime change; no memory of the past (presliding)",
)

FEENY_MOON = FrictionLaw(
    name="feeny-moon",
    linear=("coulomb_nm", "viscous_nm_s_per_rad"),
    ranges=(
        NonlinearRange("mu", 0.05, 1.0, per_speed=0, logarithmic=False),
        NonlinearRange("beta_s_per_rad", 0.5, 4.0, per_speed=-1, logarithmic=True),
    ),
    columns=_feeny_moon_columns,
    source="thesis (3.10), (4.22): fv v + fc (mu + (1 - mu)/cosh(beta v)), fc signed with v",
    limits="sliding only; fc is the level at zero speed, mu fc the level after the fall",
)

LAWS: Mapping[str, FrictionLaw] = MappingProxyType(
    {law.name: law for law in (COULOMB_VISCOUS, STRIBECK, FEENY_MOON)}
)
"""Every friction law by its name in contract section 7, simplest first."""
