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

from agent.identify.flexible.chain import chain_of
from agent.identify.flexible.descent import Bounds, descend
from agent.identify.flexible.preparation import Complexes, Prepared
from agent.identify.flexible.projection import Point, Problem
from agent.identify.result import Floats

_TURNS = 40
_ROUNDS = 10
_SETTLED = 1e-3  # relative change of the parameters: the last steps are others
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
        twist_of(p, torque, spring, damper, cubic) ** 3
        for p, torque in zip(problem.stretches, shaft_torque(problem, point), strict=True)
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


def shaft_torque(problem: Problem, point: Point) -> list[Floats]:
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


def twist_of(p: Prepared, torque_nm: Floats, spring: float, damper: float, cubic: float) -> Floats:
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
