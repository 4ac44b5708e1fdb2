"""A spring that stiffens: its twist, and what the cube of it adds to the torque (thesis 3.2).

Behind a motor whose acceleration a is known, the arm's twist obeys ``x'' + 2 z w x' + w^2 x =
a - (k3/J) x^3``, and the joint's torque on the motor is ``J (a - x'')``. Given the cube of the
twist both are linear in it: with ``G(s) = 1/(s^2 + 2 z w s + w^2)`` the cubic part adds
``k3 s^2 G x^3`` to what the linear spring says. The twist itself follows from the torque of the
whole joint, ``k x + d x' + k3 x^3``, in which k3 is a small part; it is found by turns.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.identify.flexible.chain import Chain, chain_of
from agent.identify.flexible.descent import Bounds, descend
from agent.identify.flexible.preparation import Complexes, Prepared
from agent.identify.flexible.projection import Point, Problem
from agent.identify.result import Floats
from agent.physics.flexibility import held_poles_per_s

_TURNS = 40
_ROUNDS = 10
_CORRECTIONS = 2  # of a step's end
_FINER = 4  # steps a sample
_SETTLED = 1e-5  # relative change of the parameters
_CUBIC = 2  # place of the cubic spring among the linear parameters
_FARTHEST = 1e6  # rad: no spring twists so far, and its cube is still a number
_SMALL = 1e-6  # relative change of the twist at which it stands


def cubes_of(problem: Problem, point: Point) -> tuple[Floats, ...]:
    """Return the third power of every stretch's twist, rad^3, shape (n,) each.

    Parameters
    ----------
    problem : Problem
        With a single mass behind the motor.
    point : Point
        A solution of it, a cubic spring's included where the problem has one.
    """
    chain = chain_of(point.search[: problem.shape_size], float(max(point.linear[1], 1e-300)))
    (spring,), (damper,) = chain.spring_nm_per_rad, chain.damper_nm_s_per_rad
    cubic = 0.0 if problem.cubes is None else float(point.linear[_CUBIC])
    return tuple(
        _twist(p, torque, spring, damper, cubic) ** 3
        for p, torque in zip(problem.stretches, _shaft_torque(problem, point), strict=True)
    )


def stiffened(problem: Problem, point: Point, bounds: Bounds) -> tuple[Problem, Point]:
    """Return the problem with a cubic spring beside the linear one, and its minimum.

    Parameters
    ----------
    problem : Problem
        With a single mass and a linear spring.
    point : Point
        Its minimum.
    """
    for _ in range(_ROUNDS):
        fresh = replace(problem, cubes=cubes_of(problem, point))
        lowest = descend(fresh, point.search, bounds)[0]
        moved = float(np.max(np.abs(lowest.search - point.search)))
        if problem.cubes is not None:
            cubic, before = float(lowest.linear[_CUBIC]), float(point.linear[_CUBIC])
            moved = max(moved, abs(cubic - before) / max(cubic, before, 1e-300))
        else:
            moved = np.inf
        problem, point = fresh, lowest
        if moved < _SETTLED:
            break
    return problem, point


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
    chain = chain_of(point.search[: problem.shape_size], float(point.linear[1]))
    (spring,), (damper,) = chain.spring_nm_per_rad, chain.damper_nm_s_per_rad
    predicted = replace(point, residual=np.zeros_like(point.residual))
    out = []
    for p, torque in zip(problem.stretches, _shaft_torque(problem, predicted), strict=True):
        linear = _twist(p, torque, spring, damper, 0.0)
        more, rate = _swung(linear, p.period_s, chain, cubic)
        out.append(spring * more + damper * rate + cubic * (linear + more) ** 3)
    return problem.counted(np.concatenate(out))


def _swung(linear: Floats, period_s: float, chain: Chain, cubic: float) -> tuple[Floats, Floats]:
    """Return how much more a stiffening spring twists than a linear one, and at what rate.

    The difference obeys ``y'' + 2 z w y' + w^2 y = -(k3/J) (x + y)^3`` and begins at rest; its
    two poles are stepped exactly for a force that runs straight between steps, which are finer
    than the samples: the cube swings three times as fast as the twist.
    """
    count = linear.shape[0]
    finer = np.fft.irfft(_FINER * np.fft.rfft(linear), n=_FINER * count)
    period_s /= _FINER
    poles = held_poles_per_s(
        chain.inertia_kg_m2, chain.spring_nm_per_rad, chain.damper_nm_s_per_rad
    )
    decay = np.exp(poles * period_s)
    whole = (decay - 1.0) / poles
    end = (whole / period_s - 1.0) / poles
    scale, apart = -cubic / chain.total_kg_m2, complex(poles[0] - poles[1])
    twist = finer.tolist()
    rate = np.zeros(len(twist))
    state = np.zeros(2, dtype=np.complex128)
    force = scale * twist[0] ** 3
    for i in range(1, len(twist)):
        begun = decay * state + (whole - end) * force
        ahead, alone = scale * twist[i - 1] ** 3, twist[i]
        for _ in range(_CORRECTIONS):
            fresh = begun + end * ahead
            twist[i] = alone + (complex(fresh[0] - fresh[1]) / apart).real
            ahead = scale * twist[i] ** 3
        state, force = begun + end * ahead, ahead
        rate[i] = (complex(poles[0] * state[0] - poles[1] * state[1]) / apart).real
    return np.array(twist[::_FINER]) - linear, rate[::_FINER]


def _shaft_torque(problem: Problem, point: Point) -> list[Floats]:
    """Return the torque of the whole joint on the motor, free motion included.

    It is the measured torque less what inertia and friction of the motor take; the model's own
    about standstill, where nobody knows friction. Taken from the model everywhere, an error of the
    twist would feed itself through the resonance.
    """
    columns, named = problem.all_columns(point.search), len(problem.linear_names)
    parts = np.r_[1 : 2 if problem.cubes is None else 3, named : columns.shape[1]]
    torque = columns[:, parts] @ point.linear[parts]
    torque[problem.keep] += point.residual
    ends = np.cumsum([p.torque_nm.shape[0] for p in problem.stretches])
    return np.split(torque, ends[:-1])


def _twist(p: Prepared, torque_nm: Floats, spring: float, damper: float, cubic: float) -> Floats:
    """Solve ``k x + d x' + k3 x^3 = torque`` for the twist x by turns."""
    link: Complexes = np.asarray(spring + 1j * p.omega_rad_s * damper, dtype=np.complex128)
    twist = np.clip(p.passed(torque_nm, 1.0 / link), -_FARTHEST, _FARTHEST)
    largest = float(np.max(np.abs(twist)))
    # Half of what the cube adds to the stiffness at most: then every turn brings the twist nearer.
    stiffer = link + 1.5 * cubic * largest**2
    for _ in range(_TURNS if cubic > 0.0 else 0):
        step = p.passed(torque_nm - cubic * twist**3 - p.passed(twist, link), 1.0 / stiffer)
        twist += step
        if float(np.max(np.abs(step))) < _SMALL * largest:
            break
    return twist
