"""Which friction law the curve carries, with which numbers, and how sure that is.

All laws of `physics.friction` are fitted to the curve's points. The simplest, Coulomb + viscous,
stays unless a richer law beats it beyond its noise in three ways at once: in the error at speeds
that it has not seen (leave one speed out, by more than one standard error), in the Bayesian
information criterion (by more than 10: very strong evidence, Kass and Raftery, JASA 90 (1995)
773), and with parameters that physics allows.

Where a richer law has hardly fewer parameters than there are speeds, it cannot predict one that is
left out: four of five speeds fix Stribeck's law, and the slowest lies far outside of them. There
the passes' own noise takes the place of unseen speeds: the simple law must leave more of the curve
than noise does in one stair of twenty.

Between Stribeck and Feeny-Moon, which draw nearly the same fall, Stribeck is reported unless
Feeny-Moon beats it in the same way: Stribeck's parameters are the twin's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction import separable
from agent.identify.friction.curve import CurveFit
from agent.identify.result import Floats, FrictionModelFit, Parameter
from agent.identify.uncertainty import student_975
from agent.physics import friction
from agent.physics.friction import FrictionLaw

_STRONG_BIC = 10.0
_ENOUGH_FREEDOM = 4
_PLAIN = "Coulomb + viscous"
_BY_CHANCE = 0.05  # by which a simple law is refuted where unseen speeds cannot be predicted
_USUAL_ERROR = 3.0
_EXPONENTS = (1.0, 0.5, 1.5, 2.0)  # published ones; the first stands where the speeds tell none
_STEP = 1e-4  # relative, of a non-linear parameter's slope
_NOT_NEGATIVE = ("coulomb_nm", "static_extra_nm")


@dataclass(frozen=True)
class _LawFit:
    """A fit with what selection needs.

    `unseen_nm`, shape (n,), are the unseen-speed errors; `freedom` is how many speeds there are
    beyond the law's parameters; `chance` is how likely the passes' noise leaves as much as this law
    does, None where that is not known; `sse` the weighted sum of squares that it leaves.
    """

    fit: FrictionModelFit
    unseen_nm: Floats
    allowed: str
    freedom: int
    chance: float | None
    sse: float


def fit_friction_models(curve_fit: CurveFit) -> tuple[FrictionModelFit, ...]:
    """Fit every law that the number of speeds allows, and select one.

    Parameters
    ----------
    curve_fit : CurveFit
        The curve with its points' standard errors.

    Returns
    -------
    tuple of FrictionModelFit
        Simplest first; at most one is selected, none with fewer than two speeds.
    """
    fits: list[_LawFit] = []
    speeds = curve_fit.curve.velocity_rad_s.shape[0]
    for law in friction.LAWS.values():
        # The exponent may be held; every other parameter needs a speed, and the fit one to spare.
        free = [name for name in law.parameters if name != "exponent"]
        needed = len(free) + (1 if law.ranges else 0)
        if speeds >= needed:
            fits.append(_fit_law(law, curve_fit))
    return _select(fits, _weights(curve_fit))


def _weights(curve_fit: CurveFit) -> Floats:
    """Return the square roots of the points' weights, shape (n,), at most 1.

    Points count alike, for laws are never exact and a very quiet speed must not rule the others;
    one whose standard error is more than three times the median counts less, by its variance.
    """
    error = curve_fit.standard_error_nm
    usual = _USUAL_ERROR * float(np.median(error))
    if not np.all(np.isfinite(error)) or usual <= 0.0:
        return np.ones(error.shape[0])
    return np.asarray(usual / np.maximum(error, usual), dtype=np.float64)


def _fit_law(
    law: FrictionLaw, curve_fit: CurveFit, held: Mapping[str, float] | None = None
) -> _LawFit:
    """Fit one law by variable projection, with profile intervals and unseen-speed errors.

    An exponent that the speeds do not carry is held at the classical 1 in a second fit: left
    free, it would take the other parameters' values along. Their intervals, though, hold what other
    published exponents would make of them: see `_over_exponents`.
    """
    curve = curve_fit.curve
    speed, value = curve.velocity_rad_s, curve.friction_nm
    weight = _weights(curve_fit)
    enough = speed.shape[0] > len(law.parameters)
    bounds = separable.domain(law, speed, held)
    coarse, fine = separable.search(law, speed, value, weight, bounds)
    best = fine.best
    numbers = dict(zip(law.linear, fine.linear[best].tolist(), strict=True))
    numbers |= dict(zip(law.nonlinear, fine.nonlinear[best].tolist(), strict=True))
    parameters, region = _intervals(law, curve_fit, weight, (coarse, fine), numbers, bounds)
    free_exponent = not held and "exponent" in law.nonlinear
    if free_exponent and not (enough and parameters["exponent"].identified):
        return _over_exponents(law, curve_fit)
    unseen = _unseen(coarse, region) / weight
    predicted = law.torque(curve_fit.means.velocity_rad_s, numbers)
    measured = curve_fit.means.friction_nm
    error = measured - predicted
    count = speed.shape[0]
    # Numerical dust keeps the logarithm finite where a law runs through every point.
    sse = max(float(fine.sse[best]), 1e-20 * float(np.sum((weight * value) ** 2)), 1e-300)
    free = len(law.parameters) - len(held or {})
    bic = count * np.log(sse / count) + free * np.log(count)
    fit = FrictionModelFit(
        model=law.name,
        selected=False,
        rmse_nm=float(np.sqrt(np.mean(error**2))),
        fit_percent=fit_percent(measured, predicted),
        bic=float(bic),
        parameters=parameters,
    )
    chance = _chance(law, curve_fit)
    return _LawFit(fit, unseen, _objection(law, numbers), count - free, chance, sse)


def _over_exponents(law: FrictionLaw, curve_fit: CurveFit) -> _LawFit:
    """Return the fit with the exponent held at 1, its intervals those of every likely exponent.

    How much more friction there is at standstill, where nobody measured, depends on how the fall
    is bent: with an exponent of 2 by half of it. Every published exponent that the speeds allow
    is therefore asked, and an interval reaches as far as any of theirs.
    """
    plain, *others = (_fit_law(law, curve_fit, {"exponent": e}) for e in _EXPONENTS)
    least = min(f.sse for f in (plain, *others))
    variance, dof = _variance(curve_fit, least, plain.freedom)
    limit = least + variance * student_975(dof) ** 2
    parameters = dict(plain.fit.parameters)
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


def _intervals(
    law: FrictionLaw,
    curve_fit: CurveFit,
    weight: Floats,
    grids: tuple[separable.GridFit, separable.GridFit],
    numbers: dict[str, float],
    bounds: Floats,
) -> tuple[dict[str, Parameter], separable.GridFit]:
    """Return parameters with profile-likelihood intervals, and the grid that they come from."""
    curve = curve_fit.curve
    speed, value = curve.velocity_rad_s, curve.friction_nm
    coarse, fine = grids
    least = float(fine.sse[fine.best])
    free = len(law.linear) + int(np.count_nonzero(bounds[:, 1] > bounds[:, 0]))
    freedom = speed.shape[0] - free
    variance, dof = _variance(curve_fit, least, freedom)
    limit = least + variance * student_975(dof) ** 2
    region, at_bound = separable.profile_region(
        law, speed, value, weight, bounds, (coarse, fine), limit
    )
    inside = region.sse <= limit
    reach = region.spread[inside] * np.sqrt(limit - region.sse[inside])[:, np.newaxis]
    lower = (region.linear[inside] - reach).min(axis=0)
    upper = (region.linear[inside] + reach).max(axis=0)
    centre = fine.linear[fine.best]
    wider = _unequal_points(law, curve_fit, weight, fine, bounds)
    own = wider[: centre.size]
    lower, upper = centre - own * (centre - lower), centre + own * (upper - centre)
    ends = {n: (float(a), float(b)) for n, a, b in zip(law.linear, lower, upper, strict=True)}
    for i, name in enumerate(law.nonlinear):
        column = np.append(region.nonlinear[inside, i], fine.nonlinear[fine.best, i])
        ends[name] = _widened(law, i, column, wider[centre.size + i], bounds[i])
    reasons = _not_carried(law, at_bound, bounds)
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


def _variance(curve_fit: CurveFit, least: float, freedom: int) -> tuple[float, float]:
    """Return the variance of a weighted point about a law, and its degrees of freedom.

    The residuals', whose least sum of squares is given, hold the points' noise and the law's
    misfit. With too few speeds to tell it, the points' own takes its place where it is larger.
    """
    of_points = float(np.mean((_weights(curve_fit) * curve_fit.standard_error_nm) ** 2))
    of_residuals = least / freedom if freedom > 0 else 0.0
    if freedom >= _ENOUGH_FREEDOM or of_residuals > of_points:
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
    law: FrictionLaw, curve_fit: CurveFit, weight: Floats, fine: separable.GridFit, bounds: Floats
) -> Floats:
    """Return by how much unequal points widen the intervals, linear parameters first, shape (p,).

    The residuals tell the points' average noise; that the fast, short passes are noisier is known
    from the points' own standard errors. At least 1.
    """
    speed, at, linear = curve_fit.curve.velocity_rad_s, fine.nonlinear[fine.best], fine.linear
    slopes = [law.columns(speed, *at)]
    for i, (low, high) in enumerate(bounds):
        step = np.zeros(at.size)
        step[i] = _STEP * at[i] * (high > low)
        ahead, behind = law.columns(speed, *(at + step)), law.columns(speed, *(at - step))
        slopes.append(((ahead - behind) @ linear[fine.best])[:, np.newaxis])
    columns = np.concatenate(slopes, axis=1) * weight[:, np.newaxis]
    size = np.linalg.norm(columns, axis=0)
    solve = np.linalg.pinv(columns / np.where(size > 0.0, size, 1.0))
    variance = (weight * curve_fit.standard_error_nm) ** 2
    average = float(np.mean(variance))
    if not average > 0.0 or not np.isfinite(average):
        return np.ones(columns.shape[1])
    alike = average * np.sum(solve**2, axis=1)
    share = np.where(alike > 0.0, (solve**2) @ variance / np.maximum(alike, 1e-300), 1.0)
    return np.asarray(np.sqrt(np.maximum(share, 1.0)), dtype=np.float64)


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


def _select(fits: Sequence[_LawFit], weight: Floats) -> tuple[FrictionModelFit, ...]:
    """Mark the law that is selected, and say of each why or why not."""
    if not fits:
        return ()
    simple = fits[0]
    chosen = simple
    reasons = {simple.fit.model: "the simplest law; no richer one beats it beyond its noise"}
    for rich in fits[1:]:
        refusal = rich.allowed or _not_better(simple, rich, weight)
        if refusal:
            reasons[rich.fit.model] = refusal
            continue
        reasons[simple.fit.model], ours = _better(simple, rich)
        if chosen is simple:
            chosen = rich
            reasons[rich.fit.model] = ours
        elif not _not_better(chosen, rich, weight):
            reasons[chosen.fit.model] = f"{rich.fit.model} predicts unseen speeds better"
            chosen = rich
            reasons[rich.fit.model] = "predicts unseen speeds best"
        else:
            reasons[rich.fit.model] = f"no better at unseen speeds than {chosen.fit.model}"
    return tuple(replace(f.fit, selected=f is chosen, reason=reasons[f.fit.model]) for f in fits)


def _by_noise(simple: _LawFit, rich: _LawFit) -> bool:
    """Return whether the passes' noise decides: there are too few speeds to leave one out."""
    return rich.freedom < _ENOUGH_FREEDOM and simple.chance is not None


def _better(simple: _LawFit, rich: _LawFit) -> tuple[str, str]:
    """Return why the simple law is dropped, and why the richer one replaces it."""
    if not _by_noise(simple, rich):
        return (
            "a richer law predicts unseen speeds better",
            f"predicts unseen speeds better than {_PLAIN}",
        )
    percent = f"chance {100.0 * (simple.chance or 0.0):.2g} %"
    return (
        f"it leaves more of the curve than the passes' noise does ({percent})",
        f"follows the curve where {_PLAIN} leaves more than the passes' noise does ({percent})",
    )


def _not_better(simple: _LawFit, rich: _LawFit, weight: Floats) -> str:
    """Return why the richer law does not replace the simple one; empty where it does."""
    if simple.fit.bic - rich.fit.bic <= _STRONG_BIC:
        return (
            f"its gain does not pay for its parameters (BIC {rich.fit.bic - simple.fit.bic:+.1f} "
            f"against {simple.fit.model})"
        )
    if _by_noise(simple, rich):
        if (simple.chance or 0.0) > _BY_CHANCE:
            return (
                f"the passes' noise may leave what {simple.fit.model} leaves (chance "
                f"{100.0 * (simple.chance or 0.0):.2g} %)"
            )
    elif _gain(simple, rich, weight) <= 0.0:
        return "it does not predict unseen speeds better beyond one standard error"
    return ""


def _gain(worse: _LawFit, better: _LawFit, weight: Floats) -> float:
    """Return the mean fall in squared unseen-speed error, less one standard error."""
    fall = (weight * worse.unseen_nm) ** 2 - (weight * better.unseen_nm) ** 2
    error = float(np.std(fall, ddof=1)) / np.sqrt(fall.shape[0])
    return float(np.mean(fall) - error)


def fit_percent(measured: Floats, predicted: Floats) -> float:
    """Return ``100 (1 - ||y - yhat|| / ||y - mean y||)``; NaN where the measured is constant."""
    spread = float(np.linalg.norm(measured - np.mean(measured)))
    if spread == 0.0:
        return float("nan")
    return 100.0 * (1.0 - float(np.linalg.norm(measured - predicted)) / spread)
