"""The torque about reversals: left out of the search, and taken in where the model explains it.

About a reversal friction is least known, and the filter spreads what is not over four periods of
its cutoff. Left out, an eighth of a triangle wave is lost, with most of what tells Coulomb from
viscous friction and half of what tells three masses apart: their springs' standard errors rise by
half over the Cramer-Rao bound. Where friction is what the law says, only the moment of the reversal
is unknown, which costs a few blows of unknown size (`Prepared.through_reversals`). Whether it is,
the torque itself says: what is left near reversals must be no more than what is left elsewhere, and
must lack nothing that has a name.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from agent.identify.flexible.attenuation import covariance_of
from agent.identify.flexible.descent import Bounds, descend
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.rivals import lack_of

_SIGMAS = 4.0  # by which more may be left near reversals than elsewhere


def through_reversals(problem: Problem, point: Point, bounds: Bounds) -> tuple[Problem, Point]:
    """Return the problem and its minimum with reversals taken in, where the model explains them.

    Parameters
    ----------
    problem : Problem
        With a chain, and its reversals left out.
    point : Point
        Its minimum.
    bounds : Bounds
        Of the search.
    """
    wider = replace(problem, stretches=tuple(p.through_reversals() for p in problem.stretches))
    near = np.concatenate([~p.usable[p.moving] for p in problem.stretches])
    if not near.any() or near.all():
        return problem, point
    lowest, converged = descend(wider, point.search, bounds)
    left = float(near.sum()) - _taken(wider, lowest)
    # Of rows that the filter has made alike, so many are independent.
    independent = left * min(2.0 * p.cutoff_hz * p.period_s for p in problem.stretches)
    if not converged or independent < 1.0:
        return problem, point
    inside = float(np.sum(lowest.residual[near] ** 2)) / left
    elsewhere = float(np.mean(lowest.residual[~near] ** 2))
    if inside > elsewhere * (1.0 + _SIGMAS * math.sqrt(2.0 / independent)):
        return problem, point
    return (problem, point) if lack_of(wider, lowest).rivals else (wider, lowest)


def _taken(problem: Problem, point: Point) -> float:
    """Return how many rows' worth of the measuring noise the blows take with them.

    Those of one reversal are alike, and what tells them apart lies where the filter leaves little.
    """
    begin, taken = 0, 0.0
    rows = int(problem.keep.sum())
    for basis in problem.blow_bases:
        end = begin + basis.shape[0]
        wide = np.zeros((basis.shape[1], rows))
        wide[:, begin:end] = basis.T
        one = np.zeros((1, rows))
        one[0, begin + basis.shape[0] // 2] = 1.0
        variance = float(covariance_of(problem, point, one)[0, 0])
        taken += float(np.trace(covariance_of(problem, point, wide))) / variance
        begin = end
    return taken
