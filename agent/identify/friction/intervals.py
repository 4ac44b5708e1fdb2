"""Which numbers of a friction law the points carry, and how sure they are: profile likelihood.

An interval is where a law that is fitted with its parameter held leaves no more than the noise
allows, on grids that follow the region of the non-linear parameters to its ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction import separable
from agent.identify.friction.curve import CurveFit
from agent.identify.friction.weights import Weights
from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import student_975
from agent.physics.friction import FrictionLaw

ENOUGH_FREEDOM = 4  # speeds beyond the parameters: fewer do not tell by themselves how much is left
_LIKELY = 0.2  # of the likeliest noise's weight
_STEP = 1e-4  # relative, of a non-linear parameter's slope


def intervals(
    law: FrictionLaw,
    curve_fit: CurveFit,
    weights: Weights,
    grids: tuple[separable.GridFit, separable.GridFit],
    bounds: Floats,
) -> tuple[dict[str, Parameter], separable.GridFit]:
    """Return parameters with profile-likelihood intervals, and the grid that they come from.

    Parameters
    ----------
    law : FrictionLaw
        What was fitted.
    curve_fit : CurveFit
        To which points.
    weights : Weights
        With which weights.
    grids : pair of GridFit
        As `separable.search` returns them.
    bounds : ndarray, shape (k, 2)
        The `separable.domain`.
    """
    curve, fine = curve_fit.curve, grids[1]
    speed, value = curve.velocity_rad_s, curve.friction_nm
    least = float(fine.sse[fine.best])
    free = len(law.linear) + int(np.count_nonzero(bounds[:, 1] > bounds[:, 0]))
    variance, dof = variance_of(curve_fit, weights, least, speed.shape[0] - free)
    limit = least + variance * student_975(dof) ** 2
    region, at_bound = separable.profile_region(
        law, speed, value, weights.root, bounds, grids, limit
    )
    wider = _unequal_points(law, curve_fit, weights, fine, bounds)
    ends = _ends(law, region, limit, fine, wider, bounds)
    numbers, reasons = numbers_of(law, fine), _not_carried(law, at_bound, bounds)
    parameters = {}
    for name in law.parameters:
        if name in reasons:
            parameters[name] = Parameter.not_identified(reasons[name], numbers[name])
        elif not np.all(np.isfinite(ends[name])):
            parameters[name] = Parameter.not_identified(
                "too few speeds for an interval", numbers[name]
            )
        else:
            parameters[name] = Parameter(numbers[name], ends[name])
    return parameters, region


def _ends(
    law: FrictionLaw,
    region: separable.GridFit,
    limit: float,
    fine: separable.GridFit,
    wider: Floats,
    bounds: Floats,
) -> dict[str, tuple[float, float]]:
    """Return how far a region with sums of squares up to a limit reaches in each parameter.

    `wider`, shape (p,), is by how much unequal points widen that, linear parameters first.
    """
    inside = region.sse <= limit
    reach = region.spread[inside] * np.sqrt(limit - region.sse[inside])[:, np.newaxis]
    lower = (region.linear[inside] - reach).min(axis=0)
    upper = (region.linear[inside] + reach).max(axis=0)
    centre = fine.linear[fine.best]
    own = wider[: centre.size]
    lower, upper = centre - own * (centre - lower), centre + own * (upper - centre)
    ends = {n: (float(a), float(b)) for n, a, b in zip(law.linear, lower, upper, strict=True)}
    for i, name in enumerate(law.nonlinear):
        column = np.append(region.nonlinear[inside, i], fine.nonlinear[fine.best, i])
        ends[name] = _widened(law, i, column, wider[centre.size + i], bounds[i])
    return ends


def numbers_of(law: FrictionLaw, fine: separable.GridFit) -> dict[str, float]:
    """Return the best grid point's parameters by name."""
    best = fine.best
    numbers = dict(zip(law.linear, fine.linear[best].tolist(), strict=True))
    return numbers | dict(zip(law.nonlinear, fine.nonlinear[best].tolist(), strict=True))


def variance_of(
    curve_fit: CurveFit, weights: Weights, least: float, freedom: int
) -> tuple[float, float]:
    """Return the variance of a weighted point about a law, and its degrees of freedom.

    The residuals', whose least sum of squares is given, hold the points' noise and the law's
    misfit. With too few speeds to tell it, the points' own takes its place where it is larger; so
    it does where points share an error of gravity, which a law follows and no residual shows.
    """
    of_points = float(np.mean((weights.root * curve_fit.standard_error_nm) ** 2))
    of_residuals = least / freedom if freedom > 0 else 0.0
    told = freedom >= ENOUGH_FREEDOM and not curve_fit.shared_gravity
    if told or of_residuals > of_points:
        return of_residuals, float(freedom)
    return of_points, float(np.sum(curve_fit.dof))


def _widened(
    law: FrictionLaw, i: int, column: Floats, wider: float, bounds: Floats
) -> tuple[float, float]:
    """Return a non-linear parameter's ends, as far again from its value, the column's last."""
    logarithmic = law.ranges[i].logarithmic
    values = np.log(column) if logarithmic else column
    centre = values[-1]
    ends = centre + wider * (np.array([values.min(), values.max()]) - centre)
    low, high = np.clip(np.exp(ends) if logarithmic else ends, *bounds).tolist()
    return low, high


def _unequal_points(
    law: FrictionLaw,
    curve_fit: CurveFit,
    weights: Weights,
    fine: separable.GridFit,
    bounds: Floats,
) -> Floats:
    """Return by how much unequal points widen the intervals, linear parameters first, shape (p,).

    The residuals tell the weighted points' average noise, of which they show the less of a point
    the more it draws the law to itself. Weights allow for a misfit of the law where there need be
    none, and so leave the fast, short passes noisier than the others. By how much is not known: a
    misfit may be chance, and noise with a memory tells less against a short pass than white noise.
    The largest is taken of what the passes allow. At least 1.
    """
    weight = weights.root
    speed, at, linear = curve_fit.curve.velocity_rad_s, fine.nonlinear[fine.best], fine.linear
    slopes = [law.columns(speed, *at)]
    for i, (low, high) in enumerate(bounds):
        step = np.zeros(at.size)
        step[i] = _STEP * at[i] * (high > low)
        ahead, behind = law.columns(speed, *(at + step)), law.columns(speed, *(at - step))
        slopes.append(((ahead - behind) @ linear[fine.best])[:, np.newaxis])
    columns = np.concatenate(slopes, axis=1) * weight[:, np.newaxis]
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)
    solve = np.linalg.pinv(scaled)
    shown = np.maximum(1.0 - np.einsum("ij,ji->i", scaled, solve), 0.0)
    if shown.sum() < ENOUGH_FREEDOM - 0.5:  # there the points' own errors stand for the residuals
        shown = np.ones_like(shown)
    wider = np.ones(columns.shape[1])
    for of_points in _likely_variances(curve_fit, weights.misfit_nm):
        variance = weight**2 * of_points
        average = float(shown @ variance / shown.sum())
        if not average > 0.0 or not np.isfinite(average):
            continue
        alike = average * np.sum(solve**2, axis=1)
        share = np.where(alike > 0.0, (solve**2) @ variance / np.maximum(alike, 1e-300), 1.0)
        wider = np.maximum(wider, np.sqrt(share))
    return wider


def _likely_variances(curve_fit: CurveFit, misfit_nm: float) -> list[Floats]:
    """Return the points' variances, (n,) each, with and without a misfit, and of likely noises."""
    own = curve_fit.standard_error_nm**2
    noise = curve_fit.noise
    if noise is None:
        return [own + misfit_nm**2, own]
    likely = noise.covariance_nm2[noise.weight > _LIKELY * noise.weight.max()]
    return [own + misfit_nm**2, own, *np.diagonal(likely, axis1=1, axis2=2)]


def _not_carried(law: FrictionLaw, at_bound: NDArray[np.bool_], bounds: Floats) -> dict[str, str]:
    """Return the parameters whose interval reaches the end of what these speeds can tell."""
    reasons: dict[str, str] = {}
    for i, name in enumerate(law.nonlinear):
        if bounds[i, 0] == bounds[i, 1]:
            reasons[name] = f"held at {bounds[i, 0]:g}: these speeds do not tell it"
            continue
        low, high = bool(at_bound[i, 0]), bool(at_bound[i, 1])
        if name == "mu" and high:
            low = True
        if not (low or high):
            continue
        side = "both ends" if low and high else ("the lower end" if low else "the upper end")
        reasons[name] = f"its interval reaches {side} of what these speeds can tell"
        if name in ("stribeck_velocity_rad_s", "beta_s_per_rad"):
            too_slow = low if name == "stribeck_velocity_rad_s" else high
            too_fast = high if name == "stribeck_velocity_rad_s" else low
            if too_slow and "static_extra_nm" in law.linear:
                reasons["static_extra_nm"] = (
                    "the fall may be over below the slowest speed: slower speeds would tell"
                )
            if too_fast:
                for other in law.linear:
                    reasons[other] = (
                        "the fall may go on beyond the fastest speed: faster speeds would tell"
                    )
    return reasons
