"""From the minimum to physical parameters with intervals, or with the reason why there are none.

The prediction-error Jacobian has the linear columns and the slopes of the searched parameters. Its
covariance comes from leaving out whole blocks of time, so that coloured residuals widen it.
Physical parameters follow to first order; those that cannot be negative in the logarithm, so that
their intervals stay above zero.
"""

from __future__ import annotations

import math

import numpy as np

from agent.identify.flexible.chain import chain_of
from agent.identify.flexible.projection import Bounds, Point, Problem, slopes
from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import block_jackknife, student_975

_BLOCKS = 80
_CERTAIN = 0.5  # relative standard error beyond which the data do not carry a positive number
_STEP = 1e-6


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
    problem: Problem, point: Point, bounds: Bounds
) -> tuple[dict[str, Parameter], float]:
    """Return every physical parameter, and the condition number of the Jacobian."""
    jacobian = np.concatenate((point.columns, -slopes(problem, point)), axis=1)
    norms = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    there = norms > 0.0
    size, named = jacobian.shape[1], len(problem.linear_names)
    covariance = np.zeros((size, size))
    blocks = np.minimum(
        np.arange(jacobian.shape[0]) * _BLOCKS // jacobian.shape[0], _BLOCKS - 1
    ).astype(np.int64)
    singular = np.linalg.svd(jacobian[:, there] / norms[there], compute_uv=False)
    condition = float(singular[0] / max(singular[-1], 1e-300))
    _, part, dof = block_jackknife(jacobian[:, there], point.residual, blocks)
    covariance[np.ix_(there, there)] = part
    # Free motions are nobody's parameters: named ones and the search remain.
    index = np.r_[0:named, size - problem.search_size : size]
    covariance = covariance[np.ix_(index, index)]
    return _with_intervals(problem, point, bounds, covariance, student_975(dof)), condition


def _with_intervals(
    problem: Problem, point: Point, bounds: Bounds, covariance: Floats, quantile: float
) -> dict[str, Parameter]:
    named = len(problem.linear_names)
    centre = np.concatenate((point.linear[:named], point.search))
    values = physical(problem, point.search, point.linear)
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    gradient = {name: np.zeros(centre.shape[0]) for name in values}
    for j in range(centre.shape[0]):
        step = _STEP * max(abs(centre[j]), spread[j], 1e-6)
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
        error = math.sqrt(max(float(gradient[name] @ covariance @ gradient[name]), 0.0))
        touched = [s for s in stuck if gradient[name][s] != 0.0]
        out[name] = _parameter(name, value, error, quantile, bool(touched))
    return out


def _at_bound(problem: Problem, point: Point, bounds: Bounds) -> list[int]:
    """Return which coordinates (named linear ones, then the search) lie on their bounds."""
    named = len(problem.linear_names)
    zero = [i for i in range(named) if problem.positive[i] and point.linear[i] <= 0.0]
    margin = 1e-6 * (bounds.upper - bounds.lower)
    on = (point.search <= bounds.lower + margin) | (point.search >= bounds.upper - margin)
    return zero + [named + int(i) for i in np.flatnonzero(on)]


_SIGNED = frozenset({"gravity_sin_nm", "gravity_cos_nm", "torque_offset_nm", "torque_delay_s"})


def _parameter(name: str, value: float, error: float, quantile: float, bounded: bool) -> Parameter:
    if not (math.isfinite(value) and math.isfinite(error)):
        return Parameter.not_identified("the recordings do not excite it")
    if name in _SIGNED:
        if bounded:
            return Parameter.not_identified("it lies on the bound of its search")
        return Parameter(value, (value - quantile * error, value + quantile * error))
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
    factor = math.exp(quantile * relative)
    return Parameter(value, (value / factor, value * factor))
