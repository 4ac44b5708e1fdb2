"""One friction law fitted to the curve: its numbers, what it leaves, and how it predicts.

A law is fitted twice: first with points that count nearly alike, which tells how far it misses
them, and then with the weights that follow from that (`weights`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.friction import separable
from agent.identify.friction.curve import CurveFit
from agent.identify.friction.intervals import intervals, numbers_of, variance_of
from agent.identify.friction.warming import beside_warming
from agent.identify.friction.weights import Weights, misfit, weights
from agent.identify.result import Floats, FrictionModelFit, Parameter
from agent.identify.uncertainty import student_975
from agent.physics.friction import FrictionLaw

_EXPONENTS = (1.0, 0.5, 1.5, 2.0)  # published ones; the first stands where the speeds tell none
_NOT_NEGATIVE = ("coulomb_nm", "static_extra_nm")


@dataclass(frozen=True)
class LawFit:
    """A fit with what selection needs.

    `unseen_nm`, shape (n,), are the unseen-speed errors; `weight`, shape (n,), the square roots of
    the points' weights; `freedom` is how many speeds there are beyond the law's parameters;
    `chance` is how likely the passes' noise leaves as much as this law does, None where that is not
    known; `sse` the weighted sum of squares that it leaves.
    """

    fit: FrictionModelFit
    unseen_nm: Floats
    weight: Floats
    allowed: str
    freedom: int
    chance: float | None
    sse: float


def fit_law(law: FrictionLaw, curve_fit: CurveFit) -> LawFit:
    """Fit one law by variable projection, with profile intervals and unseen-speed errors.

    An exponent that the speeds do not carry is held at the classical 1 in another fit: left
    free, it would take the other parameters' values along. Their intervals, though, hold what other
    published exponents would make of them: see `_over_exponents`.

    Parameters
    ----------
    law : FrictionLaw
        What is fitted.
    curve_fit : CurveFit
        The curve with its points' standard errors.
    """
    own = _weights(law, curve_fit)
    found = _fit(law, curve_fit, own)
    exponent = found.fit.parameters.get("exponent")
    speed = curve_fit.curve.velocity_rad_s
    enough = speed.shape[0] > len(law.parameters)
    if exponent is not None and not (enough and exponent.identified):
        found = _over_exponents(law, curve_fit, own)
    if curve_fit.warming is None:
        return found
    return replace(found, fit=beside_warming(found.fit, law, speed, own.root, curve_fit.warming))


def _weights(law: FrictionLaw, curve_fit: CurveFit) -> Weights:
    """Return the points' weights for a law that misses them by as much as this one does."""
    curve, error = curve_fit.curve, curve_fit.standard_error_nm
    speed = curve.velocity_rad_s
    first = weights(error)
    _, fine = separable.search(
        law, speed, curve.friction_nm, first.root, separable.domain(law, speed)
    )
    left = fine.residual[fine.best] / first.root
    return weights(error, misfit(left, error, speed.shape[0] - len(law.parameters)))


def _fit(
    law: FrictionLaw,
    curve_fit: CurveFit,
    own: Weights,
    held: Mapping[str, float] | None = None,
) -> LawFit:
    """Fit one law with given weights, its non-linear parameters in `held` at their values."""
    curve, weight = curve_fit.curve, own.root
    speed, value = curve.velocity_rad_s, curve.friction_nm
    bounds = separable.domain(law, speed, held)
    coarse, fine = separable.search(law, speed, value, weight, bounds)
    parameters, region = intervals(law, curve_fit, own, (coarse, fine), bounds)
    numbers = numbers_of(law, fine)
    measured = curve_fit.means.friction_nm
    predicted = law.torque(curve_fit.means.velocity_rad_s, numbers)
    count = speed.shape[0]
    # Numerical dust keeps the logarithm finite where a law runs through every point.
    sse = max(float(fine.sse[fine.best]), 1e-20 * float(np.sum((weight * value) ** 2)), 1e-300)
    free = len(law.parameters) - len(held or {})
    # Laws have weights of their own; the normal likelihood's determinant makes them comparable.
    bic = count * np.log(sse / count) - 2.0 * np.sum(np.log(weight)) + free * np.log(count)
    fit = FrictionModelFit(
        model=law.name,
        selected=False,
        rmse_nm=float(np.sqrt(np.mean((measured - predicted) ** 2))),
        fit_percent=fit_percent(measured, predicted),
        bic=float(bic),
        parameters=parameters,
    )
    return LawFit(
        fit,
        _unseen(coarse, region) / weight,
        weight,
        _objection(law, numbers),
        count - free,
        _chance(law, curve_fit),
        sse,
    )


def _over_exponents(law: FrictionLaw, curve_fit: CurveFit, own: Weights) -> LawFit:
    """Return the fit with the exponent held at 1, its intervals those of every likely exponent.

    How much more friction there is at standstill, where nobody measured, depends on how the fall
    is bent: with an exponent of 2 by half of it. Every published exponent that the speeds allow
    is therefore asked, and an interval reaches as far as any of theirs.
    """
    plain, *others = (_fit(law, curve_fit, own, {"exponent": e}) for e in _EXPONENTS)
    least = min(f.sse for f in (plain, *others))
    variance, dof = variance_of(curve_fit, own, least, plain.freedom)
    limit = least + variance * student_975(dof) ** 2
    parameters: dict[str, Parameter] = dict(plain.fit.parameters)
    for name, parameter in parameters.items():
        ends = [f.fit.parameters[name].ci95 for f in others if f.sse <= limit]
        reach = [parameter.ci95, *(e for e in ends if e is not None)]
        if parameter.ci95 is not None:
            lower, upper = zip(*(e for e in reach if e is not None), strict=True)
            parameters[name] = replace(parameter, ci95=(min(lower), max(upper)))
    return replace(plain, fit=replace(plain.fit, parameters=parameters))


def _chance(law: FrictionLaw, curve_fit: CurveFit) -> float | None:
    """Return how likely the passes' noise leaves what a linear law leaves of the curve."""
    if curve_fit.noise is None or law.ranges:
        return None
    curve = curve_fit.curve
    return curve_fit.noise.chance(law.columns(curve.velocity_rad_s), curve.friction_nm)


def _unseen(coarse: separable.GridFit, region: separable.GridFit) -> Floats:
    """Return the weighted error at every speed when that speed is left out, shape (n,).

    Exact on the grids: leaving point j out lowers the squared error by ``r_j^2/(1 - h_j)``, and
    the non-linear parameters are searched anew for every point that is left out.
    """
    sse = np.concatenate((coarse.sse, region.sse))[:, np.newaxis]
    residual = np.vstack((coarse.residual, region.residual))
    free = np.maximum(1.0 - np.vstack((coarse.leverage, region.leverage)), 1e-9)
    without = sse - residual**2 / free
    choice = np.argmin(without, axis=0)
    column = np.arange(residual.shape[1])
    return np.asarray((residual / free)[choice, column], dtype=np.float64)


def _objection(law: FrictionLaw, numbers: dict[str, float]) -> str:
    """Return why physics does not allow these numbers; empty where it does."""
    negative = [n for n in _NOT_NEGATIVE if numbers.get(n, 0.0) < 0.0]
    if law.ranges and negative:
        return f"{negative[0]} comes out negative, which friction cannot be"
    return ""


def fit_percent(measured: Floats, predicted: Floats) -> float:
    """Return ``100 (1 - ||y - yhat|| / ||y - mean y||)``; NaN where the measured is constant."""
    spread = float(np.linalg.norm(measured - np.mean(measured)))
    if spread == 0.0:
        return float("nan")
    return 100.0 * (1.0 - float(np.linalg.norm(measured - predicted)) / spread)
