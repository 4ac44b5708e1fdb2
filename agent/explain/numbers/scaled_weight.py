"""A weight that is off by a few percent in its own direction: a number, and no hose beside it.

A hose or an offset that is taken for gravity asks for a vector of its own, which points anywhere
and is as large as it likes. Where what the recordings ask for lies in line with the weight that the
twin has, is little of it, and few other directions would do as well, the weight's number is off:
one number says what a look-alike needs two for, and two coincidences.
"""

from __future__ import annotations

import math

import numpy as np

from agent.explain.choosing.search import Library
from agent.explain.rows.evidence import solve
from agent.explain.rows.table import BASE
from agent.identify.result import Floats
from agent.physics.rigid_body import GRAVITY

_DIRECTIONS = 24  # of half a turn: a vector and its opposite are one
_COINCIDENCE = 0.15  # of all directions: no more do as well, and the twin's is one of them
_IN_LINE_RAD = math.radians(10.0)  # sine and cosine part may each be off by a little
_LITTLE = 0.03  # of the twin's weight: one rarely knows it better, and few hoses pull so weakly
_SURELY = 3.0  # standard errors, as between any two laws


def only_its_size(library: Library, gravity: Floats, rest: Floats) -> bool:
    """Return whether a little weight in line with the twin's does as well as any, and few others.

    Parameters
    ----------
    library : Library
    gravity : ndarray, shape (m, 2)
        Weighted columns of gravity's sine and cosine part.
    rest : ndarray, shape (m, p)
        Weighted columns of all that is fitted beside it.
    """
    own = np.array([library.scene.as_given[BASE.index(name)] for name in GRAVITY])
    if gravity.shape[1] < own.shape[0] or not own.any():
        return False
    columns = np.concatenate((gravity, rest), axis=1)
    more = solve(columns.T @ columns, columns.T @ library.target)[: own.shape[0]]
    if np.linalg.norm(more) > _LITTLE * np.linalg.norm(own):
        return False
    free = library.errors_with(rest, gravity)

    def does(angle: float) -> bool:
        one = gravity @ np.array([[math.cos(angle)], [math.sin(angle)]])
        loss = library.errors_with(rest, one) - free
        chance = _SURELY * float(np.std(loss)) * math.sqrt(loss.shape[0])
        return float(loss.sum()) <= max(chance, 0.0)

    along = math.atan2(own[1], own[0])
    aside = math.remainder(math.atan2(more[1], more[0]) - along, math.pi)
    if abs(aside) > _IN_LINE_RAD and not does(along):
        return False
    every = [does(along + math.pi * k / _DIRECTIONS) for k in range(_DIRECTIONS)]
    return float(np.mean(every)) <= _COINCIDENCE
