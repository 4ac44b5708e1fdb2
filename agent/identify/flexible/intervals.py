"""From the minimum to physical parameters with intervals, or with the reason why there are none.

The prediction-error Jacobian has the linear columns and the slopes of the searched parameters. Its
covariance comes from leaving out whole blocks of time, so that coloured residuals widen it, and
Student's quantile from how few blocks carry a parameter. Blocks shorter than the chain swings
cannot see how long noise of the motion is remembered, which the chain itself colours: its peaks are
the antiresonances. That noise is known, and so is what it does (`covariance_of`); intervals are
never narrower than it allows.
Physical parameters follow to first order; those that cannot be negative in the logarithm, so that
their intervals stay above zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.attenuation import covariance_of
from agent.identify.flexible.chain import chain_of
from agent.identify.flexible.descent import Bounds
from agent.identify.flexible.projection import CUBIC, Point, Problem
from agent.identify.flexible.rivals import PLAIN, Effect, Lack
from agent.identify.flexible.slopes import jacobian_of
from agent.identify.flexible.unbiased import Unbiased
from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import (
    block_jackknife,
    correlation_time,
    jackknife_of_even_noise,
    student_975,
)

_MOST_BLOCKS, _FEWEST_BLOCKS = 80, 20
_BLOCK_CORRELATIONS = 10.0  # correlation times in a block: what its ends share is a tenth of it
_CERTAIN = 0.5  # relative standard error beyond which the data do not carry a positive number
_MOVED = 0.05  # of a parameter: by more, first order is no correction of a model plainly wrong
_STIFF = 0.3  # the same for a cubic spring: its absence is what one expects
_FILTERED = 0.5  # of a filter's corner: a resonance there loses a tenth
_STEP = 1e-6
_HIDDEN = (
    "the joint shows what this model lacks, and the number would be wrong: fit the model that the "
    "notes name, or record a motion that does not show it"
)
_TOO_SMALL = (
    "the spring's twist is too small to show whether it stiffens; record a motion with higher "
    "acceleration"
)


def physical(problem: Problem, search: Floats, linear: Floats) -> dict[str, float]:
    """Return the parameters by name, as they follow from the solution."""
    values = dict(zip(problem.linear_names, linear.tolist(), strict=False))
    nonlinear = np.exp(search[problem.shape_size : -1])
    values.update(zip(problem.law.nonlinear, nonlinear.tolist(), strict=True))
    if problem.kind is not None:
        values.update(_chain_values(search[: problem.shape_size], values))
    values["torque_delay_s"] = float(search[-1])
    return values


def _chain_values(shape: Floats, values: dict[str, float]) -> dict[str, float]:
    """Return the chain's parameters, its inertia taken from the linear solution."""
    total = max(values.pop("arm_inertia_kg_m2"), 1e-300)
    chain = chain_of(shape, total)
    masses = ("arm",) if len(chain.inertia_kg_m2) == 1 else ("gear", "arm")
    out: dict[str, float] = {}
    for i, mass in enumerate(masses):
        prefix = f"{mass}_" if len(masses) > 1 else ""
        out[f"{mass}_inertia_kg_m2"] = chain.inertia_kg_m2[i]
        out[f"{prefix}spring_nm_per_rad"] = chain.spring_nm_per_rad[i]
        out[f"{prefix}damper_nm_s_per_rad"] = chain.damper_nm_s_per_rad[i]
    turn = 2.0 * math.pi
    stopped = chain.antiresonances_rad_s() / turn
    free = chain.resonances_rad_s(max(values["motor_inertia_kg_m2"], 1e-300)) / turn
    for i in range(len(masses)):
        number = f"_{i + 1}" if len(masses) > 1 else ""
        out[f"antiresonance{number}_hz"] = float(stopped[i])
        out[f"resonance{number}_hz"] = float(free[i])
    return out


def parameters_of(
    problem: Problem, unbiased: Unbiased, bounds: Bounds, lack: Lack
) -> tuple[dict[str, Parameter], float]:
    """Return every physical parameter, and the condition number of the Jacobian.

    Intervals reach as far as what the model lacks would move their parameter.
    """
    point, larger = unbiased.point, unbiased.amplified
    jacobian = jacobian_of(problem, point)
    norms = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    there = np.flatnonzero(norms > 0.0)
    size, named = jacobian.shape[1], len(problem.linear_names)
    scaled = jacobian[:, there] / norms[there]
    singular = np.linalg.svd(scaled, compute_uv=False)
    condition = float(singular[0] / max(singular[-1], 1e-300))
    blocks = _blocks(point.residual)
    places, sizes = np.ix_(there, there), np.outer(norms[there], norms[there])
    covariance, even = np.zeros((size, size)), np.zeros((size, size))
    covariance[places] = block_jackknife(scaled, point.residual, blocks)[1] / sizes
    even[places] = jackknife_of_even_noise(scaled, blocks) / sizes
    covariance, even = (larger @ each @ larger.T for each in (covariance, even))
    influence = np.zeros((size, jacobian.shape[0]))
    influence[there] = np.linalg.pinv(scaled) / norms[there, np.newaxis]
    influence = larger @ influence
    # Free motions are nobody's parameters: named ones and the search remain.
    index = np.r_[0:named, size - problem.search_size : size]
    spread = _Spread(
        covariance[np.ix_(index, index)],
        even[np.ix_(index, index)],
        influence[index],
        blocks,
        covariance_of(problem, point, influence[index]),
    )
    bias = _bias_of(problem, point, lack, index)
    return _with_intervals(problem, point, bounds, spread, bias), condition


def _blocks(residual: Floats) -> NDArray[np.int64]:
    """Return the block of time of every row: long against what colours the residuals."""
    rows = residual.shape[0]
    longest = rows / (_BLOCK_CORRELATIONS * correlation_time([residual]))
    count = int(np.clip(longest, _FEWEST_BLOCKS, _MOST_BLOCKS))
    return np.asarray(np.arange(rows) * count // rows, dtype=np.int64)


@dataclass(frozen=True)
class _Spread:
    """How parameters scatter: named linear ones, then the search.

    `even` is what the blocks would say of even noise of variance 1, `influence`, shape (p, n), what
    every row's residual does to the parameters; `known` the covariance that the measuring noise
    alone gives.
    """

    covariance: Floats
    even: Floats
    influence: Floats
    blocks: NDArray[np.int64]
    known: Floats

    def of(self, gradient: Floats) -> tuple[float, float]:
        """Return the standard error of a function of the parameters, and Student's quantile.

        The degrees of freedom are Satterthwaite's, ``(sum c)^2 / sum c^2`` over the shares c that
        the blocks would have under even noise: what a few corners of the motion carry is known no
        better than from these few.
        """
        each = (gradient @ self.influence) ** 2
        # Leaving blocks out finds too much, and how much too much of even noise is known.
        excess = float(gradient @ self.even @ gradient) / max(float(each.sum()), 1e-300)
        variance = float(gradient @ self.covariance @ gradient) / max(excess, 1.0)
        shares = np.bincount(self.blocks, each).astype(np.float64)
        shares /= max(float(shares.sum()), 1e-300)  # first: their squares may be too small
        dof = 1.0 / max(float(shares @ shares), 1.0 / shares.shape[0])
        quantile, certain = student_975(dof), student_975(math.inf)
        known = float(gradient @ self.known @ gradient)
        if variance * quantile**2 < known * certain**2:
            return math.sqrt(known), certain
        return math.sqrt(max(variance, 0.0)), quantile


@dataclass(frozen=True)
class _Bias:
    """What the model lacks: how it would move parameters, what is plain, what hides the parts."""

    shift: Floats
    plain: frozenset[Effect]
    hides_parts: bool

    def hides(self, name: str, value: float, moved: float, half_width: float) -> bool:
        """Return whether a parameter is not known for what the model plainly lacks."""
        part = name.endswith(("inertia_kg_m2", "spring_nm_per_rad", "damper_nm_s_per_rad"))
        if part and self.hides_parts:
            return True
        return bool(self.plain) and abs(moved) > max(half_width, _MOVED * abs(value))


def _bias_of(problem: Problem, point: Point, lack: Lack, index: NDArray[np.int64]) -> _Bias:
    """Return what the model lacks does to the named parameters and the searched ones.

    Inertias, springs and dampers are those of no part of the joint with one mass instead of two,
    however little of the torque the second explains, or with a third that is plain; and where a
    filter takes so much of a swing that first order does not say how far it moves them. Elsewhere
    first order errs by as large a part of itself as the resonance is of the filter's corner.
    """
    values = physical(problem, point.search, point.linear)
    fastest = 2.0 * math.pi * max(v for name, v in values.items() if name.startswith("resonance"))
    filtered = max((fastest / r.at_rad_s for r in lack.rivals if r.effect == "filter"), default=0.0)
    few = 0.0 if problem.kind == "two-mass" else PLAIN
    plain = frozenset(r.effect for r in lack.rivals if r.share > PLAIN)
    shift = (1.0 + filtered) * lack.shift[index]
    return _Bias(shift, plain, lack.share_of("mode") > few or filtered > _FILTERED)


def _with_intervals(
    problem: Problem, point: Point, bounds: Bounds, spread: _Spread, bias: _Bias
) -> dict[str, Parameter]:
    named = len(problem.linear_names)
    centre = np.concatenate((point.linear[:named], point.search))
    values = physical(problem, point.search, point.linear)
    sizes = np.sqrt(np.maximum(np.diag(spread.covariance), 0.0))
    gradient = {name: np.zeros(centre.shape[0]) for name in values}
    for j in range(centre.shape[0]):
        step = _STEP * max(abs(centre[j]), sizes[j], 1e-6)
        ahead, behind = centre.copy(), centre.copy()
        ahead[j] += step
        behind[j] -= step
        up = physical(problem, ahead[named:], ahead[:named])
        down = physical(problem, behind[named:], behind[:named])
        for name in values:
            gradient[name][j] = (up[name] - down[name]) / (2.0 * step)
    stuck = _at_bound(problem, point, bounds)
    out = {}
    for name, value in values.items():
        error, quantile = spread.of(gradient[name])
        touched = [s for s in stuck if gradient[name][s] != 0.0]
        moved = float(gradient[name] @ bias.shift)
        hidden = name not in _SIGNED and bias.hides(name, value, moved, quantile * error)
        if hidden and not touched:
            out[name] = Parameter.not_identified(_HIDDEN)
        else:
            out[name] = _parameter(name, value, (error, quantile), moved, bool(touched))
    return out


def _at_bound(problem: Problem, point: Point, bounds: Bounds) -> list[int]:
    """Return which coordinates (named linear ones, then the search) lie on their bounds."""
    named = len(problem.linear_names)
    zero = [i for i in range(named) if problem.positive[i] and point.linear[i] <= 0.0]
    margin = 1e-6 * (bounds.upper - bounds.lower)
    on = (point.search <= bounds.lower + margin) | (point.search >= bounds.upper - margin)
    return zero + [named + int(i) for i in np.flatnonzero(on)]


_SIGNED = frozenset({"gravity_sin_nm", "gravity_cos_nm", "torque_offset_nm", "torque_delay_s"})


def _parameter(
    name: str, value: float, spread: tuple[float, float], moved: float, bounded: bool
) -> Parameter:
    """Return a parameter from standard error, quantile, and what may have moved it."""
    error, quantile = spread
    if not (math.isfinite(value) and math.isfinite(error)):
        return Parameter.not_identified("the recordings do not excite it")
    low, high = quantile * error - min(moved, 0.0), quantile * error + max(moved, 0.0)
    if name in _SIGNED:
        if bounded:
            return Parameter.not_identified("it lies on the bound of its search")
        return Parameter(value, (value - low, value + high))
    if name == CUBIC and (bounded or error > _STIFF * value):
        return Parameter.not_identified(_TOO_SMALL)
    if bounded or value <= 0.0:
        return Parameter.not_identified(
            "it came to rest on the bound of what is physically possible; the recordings do not "
            "carry it"
        )
    relative = error / value
    if relative > _CERTAIN:
        return Parameter.not_identified(
            f"the recordings do not excite it: its standard error is {100.0 * relative:.0f} % of it"
        )
    if max(low, high) > quantile * _CERTAIN * value:  # by what may have moved it, too
        return Parameter.not_identified(_HIDDEN)
    return Parameter(value, (value * math.exp(-low / value), value * math.exp(high / value)))
