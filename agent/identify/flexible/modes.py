"""The linear stage for three masses: two single masses side by side, searched before the chain.

Seen from the motor, a chain of two masses is the sum of its two modes, each of which is one mass
behind one spring; with light damping that is exact to first order. In this form the modes' masses
are linear and are solved for, and nothing but two frequencies and their damping is searched, where
the chain's own parameters all bend both modes. The chain then follows link by link.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.identify.flexible.chain import Chain, chain_of, shape_of
from agent.identify.flexible.descent import Bounds, approach, bounds_of, descend
from agent.identify.flexible.projection import Point, Problem, evaluate
from agent.identify.result import Floats

_GRID = 24
_RATIO = 0.03  # damping of a second mode, to begin with
_APART = 8.0  # how far a second mode may lie from the first
_SAME = 0.1  # difference of logarithms at which two modes are one
_TRIED = 3  # how many valleys of the second frequency are searched
_ARM, _SECOND = 1, 2  # places of the modes' masses among the linear parameters


def second_mode_starts(one: Problem, known: Floats, low_hz: float, high_hz: float) -> list[Floats]:
    """Return starts for a chain of two masses, the best first.

    Parameters
    ----------
    one : Problem
        With one mass.
    known : ndarray
        Its minimum's searched parameters.
    low_hz, high_hz : float
        Where the second mode may lie.

    Returns
    -------
    list of ndarray
        Searched parameters of the three-mass problem; empty where no second mode carries mass.
    """
    both = replace(one, kind="two-arms")
    box = bounds_of(both, low_hz, high_hz, one.fastest_rad_s)
    first = float(known[0])
    low = max(np.log(2.0 * np.pi * low_hz), first - np.log(_APART))
    high = max(min(np.log(2.0 * np.pi * high_hz), first + np.log(_APART)), low + _SAME)
    trials = [
        np.concatenate((known[:2], [omega, np.log(_RATIO)], known[2:]))
        for omega in np.linspace(low, high, _GRID)
        if abs(omega - first) > _SAME
    ]
    costs = [np.inf, *(evaluate(both, t).cost for t in trials), np.inf]
    valleys = [i for i in range(1, len(trials) + 1) if costs[i] <= min(costs[i - 1], costs[i + 1])]
    valleys.sort(key=lambda i: costs[i])
    points: list[Point] = []
    for i in valleys[:_TRIED]:
        lowest = min((p.cost for p in points), default=np.inf)
        points.append(descend(both, trials[i - 1], box, rival=lowest)[0])
    return _chains(points)


def approach_chain(chain: Problem, start: Floats, bounds: Bounds) -> Floats:
    """Return a start for a chain of two masses, from wherever one began: by way of its modes."""
    search = bounds.clip(start)
    both = replace(chain, kind="two-arms")
    box = _mode_bounds(bounds)
    held = np.log(chain_of(search[:5]).antiresonances_rad_s())
    modes = np.concatenate(([held[0], search[1], held[1], search[3]], search[5:]))
    point = descend(both, approach(both, modes, box), box)[0]
    found = _chains([point])
    return bounds.clip(found[0]) if found else search


def with_mode(problem: Problem, known: Floats, omega_rad_s: float, bounds: Bounds) -> list[Floats]:
    """Return starts that have a mode at a frequency, beside or in place of what was found.

    Parameters
    ----------
    problem : Problem
        Of one or two masses behind the motor.
    known : ndarray
        Searched parameters of its minimum, which lacks the mode.
    omega_rad_s : float
        Where it swings, the motor held.
    """
    size = problem.shape_size
    mode, rest = [np.log(omega_rad_s), np.log(_RATIO)], known[size:]
    if problem.kind == "two-mass":
        return [np.concatenate((mode, rest))]
    both = replace(problem, kind="two-arms")
    held = np.log(chain_of(known[:size]).antiresonances_rad_s())
    box = _mode_bounds(bounds)
    trials = (np.concatenate(([w, known[1]], mode, rest)) for w in held)
    return _chains([descend(both, t, box)[0] for t in trials])


def _mode_bounds(bounds: Bounds) -> Bounds:
    """Return the box of two arms that belongs to that of a chain of two masses."""
    low, high = float(np.min(bounds.lower[:4:2])), float(np.max(bounds.upper[:4:2]))
    return Bounds(
        np.concatenate(([low, bounds.lower[1]] * 2, bounds.lower[5:])),
        np.concatenate(([high, bounds.upper[1]] * 2, bounds.upper[5:])),
    )


def _chains(points: Sequence[Point]) -> list[Floats]:
    """Return the three-mass searches of two-arm minima, those left out where an arm is empty."""
    alive = [p for p in points if p.linear[_ARM] > 0.0 and p.linear[_SECOND] > 0.0]
    alive.sort(key=lambda p: p.cost)
    return [np.concatenate((_shape(p), p.search[4:])) for p in alive]


def _shape(point: Point) -> Floats:
    """Return the shape of the chain whose modes against a held motor are the two arms'.

    The moments ``mu_n = sum M_i w_i^(2n)`` of the modes' masses give the chain link by link:
    ``k1 = mu_1``, ``J1 = mu_1^2/mu_2``, ``k2 = mu_3 J1^2/mu_1^2 - k1``; by Cauchy's inequality
    nothing comes out negative. Dampers proportional to the springs, ``d = beta k``, give a mode the
    damping ratio ``beta w/2``: beta is the modes' mean, by mass.
    """
    masses = point.linear[[_ARM, _SECOND]] / float(np.sum(point.linear[[_ARM, _SECOND]]))
    squares = np.exp(2.0 * point.search[[0, 2]])
    ratios = np.exp(point.search[[1, 3]])
    mu1, mu2, mu3 = (float(masses @ squares**n) for n in (1, 2, 3))
    nearest = mu1 * mu1 / mu2
    spring = mu3 * nearest**2 / mu1**2 - mu1
    beta = float(masses @ (2.0 * ratios / np.sqrt(squares)))
    inertias, springs = (nearest, max(1.0 - nearest, 1e-9)), (mu1, max(spring, 1e-9 * mu1))
    return shape_of(Chain(inertias, springs, (beta * springs[0], beta * springs[1])))
