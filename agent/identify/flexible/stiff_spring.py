"""A stiffening spring's torque from the motion alone, and the minimum that is found with it.

A twist that is read from the measured torque carries that torque's noise into its own cube. That
bent intervals (the spring's a sixth too wide, the motor's inertia a tenth too narrow) and moved the
cubic spring by a third of its standard error. The last steps of the search therefore take the twist
from the motion and the parameters: the linear spring's x, and what the cube adds to it, ``y'' +
2 z w y' + w^2 y = -(k3/J) (x + y)^3``. The torque's derivative is that of all of this.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.identify.flexible.attenuation import filter_of
from agent.identify.flexible.chain import Chain, chain_of
from agent.identify.flexible.descent import Bounds
from agent.identify.flexible.loops import swing_steps
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.simulation import compiled
from agent.identify.flexible.slopes import jacobian_of, slopes
from agent.identify.flexible.twist import shaft_torque, twist_of
from agent.identify.result import Floats

_FINER = 4  # steps a sample: the cube swings three times as fast as the twist
_ARM, _CUBIC = 1, 2  # places among the linear parameters
_STEP = 1e-4  # of a central difference, relative or in logarithms
_DELAY_STEP_S = 1e-5
_LEAST_NM = 1e-6  # step of a free motion that is hardly there
_STEPS = 12
_HALVINGS = 6
_CONVERGED = 1e-9  # relative fall of the cost


def stiffening_torque(problem: Problem, point: Point, cubic: float) -> Floats:
    """Return what a cubic spring adds to the torque that the motion needs, at the rows that count.

    Parameters
    ----------
    problem : Problem
        With a single mass and a linear spring.
    point : Point
        Its known parameters, and the free motions that its stretches begin with.
    cubic : float
        The cubic spring, N m/rad^3.
    """
    chain = chain_of(point.search[: problem.shape_size], float(point.linear[_ARM]))
    (spring,), (damper,) = chain.spring_nm_per_rad, chain.damper_nm_s_per_rad
    predicted = replace(point, residual=np.zeros(int(problem.keep.sum())))
    out = []
    for p, torque in zip(problem.stretches, shaft_torque(problem, predicted), strict=True):
        linear = twist_of(p, torque, spring, damper, 0.0)
        more, rate = _swung(linear, p.period_s, chain, cubic)
        added = spring * more + damper * rate + cubic * (linear + more) ** 3
        # Of a cube, the filter that the measured torque has passed leaves less than of its root.
        out.append(p.passed(added, filter_of(p, p.omega_rad_s).astype(np.complex128)))
    return problem.counted(np.concatenate(out))


def _swung(linear: Floats, period_s: float, chain: Chain, cubic: float) -> tuple[Floats, Floats]:
    """Return how much more a stiffening spring twists than a linear one, and at what rate."""
    from scipy.linalg import expm

    count = linear.shape[0]
    finer = np.fft.irfft(_FINER * np.fft.rfft(linear), n=_FINER * count)
    step_s = period_s / _FINER
    (mass,), (spring,), (damper,) = (
        chain.inertia_kg_m2,
        chain.spring_nm_per_rad,
        chain.damper_nm_s_per_rad,
    )
    # One exponential holds the step and the response to a constant and to a ramp (Van Loan 1978).
    big = np.zeros((4, 4))
    big[0, 1], big[1, 0], big[1, 1], big[1, 2] = 1.0, -spring / mass, -damper / mass, 1.0
    big[2, 3] = 1.0 / step_s
    exact = expm(big * step_s)
    constant, ramp = exact[:2, 2], exact[:2, 3]
    twist, rate = np.zeros(finer.shape[0]), np.zeros(finer.shape[0])
    compiled(swing_steps)(
        np.ascontiguousarray(exact[:2, :2]),
        np.ascontiguousarray(constant - ramp),
        np.ascontiguousarray(ramp),
        -cubic / mass,
        finer,
        twist,
        rate,
    )
    return twist[::_FINER], rate[::_FINER]


def from_motion(problem: Problem, point: Point, bounds: Bounds) -> Point:
    """Return the minimum with the twist taken from the motion and the parameters alone.

    Parameters
    ----------
    problem : Problem
        With a cubic spring; any other's minimum stays.
    point : Point
        Its minimum with the twist read from the torque, inside of all bounds; elsewhere it stays.
    bounds : Bounds
        Of the search.
    """
    if problem.cubes is None or not (point.linear[: _CUBIC + 1] > 0.0).all():
        return point
    plain = replace(problem, cubes=None)
    count, at = point.linear.shape[0], _at(plain, point.linear, point.search)
    for _ in range(_STEPS):
        at = _with_slopes(plain, at)
        step = _step(problem, at)
        trials = (
            _at(
                plain,
                problem.feasible(at.linear + share * step[:count]),
                bounds.clip(at.search + share * step[count:]),
            )
            for share in 0.5 ** np.arange(_HALVINGS)
        )
        lower = next((t for t in trials if t.cost < at.cost), None)
        if lower is None or not (lower.linear[: _CUBIC + 1] > 0.0).all():
            return at
        fall, at = (at.cost - lower.cost) / at.cost, lower
        if fall < _CONVERGED:
            break
    return _with_slopes(plain, at)


def _step(problem: Problem, at: Point) -> Floats:
    """Return Gauss and Newton's step of linear and searched parameters; what is held stays."""
    jacobian = jacobian_of(problem, at)
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    free = scale > 0.0
    free[: at.linear.shape[0]] &= ~problem.held(at.linear)
    columns = jacobian[:, free] / scale[free]
    step = np.zeros(scale.shape[0])
    step[free] = np.linalg.lstsq(columns.T @ columns, columns.T @ at.residual, rcond=1e-13)[0]
    step[free] /= scale[free]
    return step


def _at(plain: Problem, linear: Floats, search: Floats) -> Point:
    """Return the cubic spring's problem at its parameters; of its columns, the linear spring's."""
    columns = plain.columns(search)
    known = np.delete(linear, _CUBIC)
    left = plain.target - columns @ known - _added(plain, linear, search)
    return Point(search, linear, left, columns, float(left @ left))


def _added(plain: Problem, linear: Floats, search: Floats) -> Floats:
    known = np.delete(linear, _CUBIC)
    empty = np.zeros(0)
    point = Point(search, known, empty, empty, 0.0)
    return stiffening_torque(plain, point, float(linear[_CUBIC]))


def _with_slopes(plain: Problem, at: Point) -> Point:
    """Return the point with the derivatives of all of its torque, the cube's part included."""
    count, named = at.linear.shape[0], len(plain.linear_names) + 1
    centre = np.concatenate((at.linear, at.search))
    steps = _STEP * np.abs(centre)
    steps[named:count] = np.max(steps[named:count]) + _LEAST_NM
    steps[count:-1], steps[-1] = _STEP, _DELAY_STEP_S
    moves = (_ARM, _CUBIC, *range(named, count + plain.shape_size), centre.shape[0] - 1)
    change = np.zeros((at.residual.shape[0], centre.shape[0]))
    for j in moves:
        ahead, behind = centre.copy(), centre.copy()
        ahead[j] += steps[j]
        behind[j] -= steps[j]
        up, down = (_added(plain, end[:count], end[count:]) for end in (ahead, behind))
        change[:, j] = (up - down) / (2.0 * steps[j])
    linear = replace(at, linear=np.delete(at.linear, _CUBIC))
    columns = np.insert(at.columns, _CUBIC, 0.0, axis=1) + change[:, :count]
    return replace(at, columns=columns, slopes=slopes(plain, linear) - change[:, count:])
