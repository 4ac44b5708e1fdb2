"""One factor on all of the torque: the torque constant is not what the drive takes it for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.search import Library
from agent.explain.numbers.plain_refits import own_structure
from agent.explain.numbers.reach import reach_of
from agent.explain.rows.table import BASE
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Twin

_ALIKE = 1.05  # one factor for all explains the error as well, within five percent
_LOST = 1.25  # or within half the noise's amplitude, as a number beside another finding is lost
_MISSED = 0.05  # of what all numbers gain: then it misses no more
_FEWER = 0.5  # of what the numbers that would be told in its place leave
_FEWEST = 3  # numbers that it must stand for
_OUTDONE = 0.8  # of what it leaves: two numbers that leave less are what is wrong
_AS_WELL = 1.1  # times that: one or two numbers that leave no more may be wrong as well
_OWN, _OWN_SHARE = 0.0075, 0.1  # each number may be off by itself: so much of it, or of the factor
_NEAR = 0.35  # of the factor: numbers that are off by it to so much may be one constant
_NEARLY = 1.25  # times what all numbers leave
_FEWEST_STEADY = 2  # of them that no law found lets vary


@dataclass(frozen=True)
class Factor:
    """One factor on all of the torque, and what it may be instead.

    Parameters
    ----------
    parameter : Parameter
        The true torque over the reported one.
    instead : tuple of str
        The fewest of the twin's numbers, two at most, that explain as much where they are wrong by
        themselves, the one that explains most of it first; empty where none do.
    """

    parameter: Parameter
    instead: tuple[str, ...] = ()


def factor_column(library: Library) -> Floats:
    """Return the weighted torque of the simulation as given, shape (m, 1): of the twin's numbers.

    A recorded simulation's numbers are its own: all of its torque is taken.
    """
    scene = library.scene
    table = scene.table
    torque = table.given_nm if table.simulated else table.base @ scene.as_given
    return library.weighing.weighted(torque)[:, np.newaxis]


def one_factor_does(
    library: Library, own: Floats, beside: Floats, material: float, told: Floats | None = None
) -> bool:
    """Return whether one factor explains of unseen data what freeing all numbers explains.

    Parameters
    ----------
    library : Library
    own : ndarray, shape (m, p)
        Weighted columns of the numbers that are freed.
    beside : ndarray, shape (m, k)
        Of the effects that stand beside either.
    material : float
        Weighted squared error that it must remove.
    told : ndarray, shape (m, t), optional
        Of the numbers that would be called wrong in its place: then the factor by itself must leave
        half of what they leave or less, the others as given. What has no name bends each number
        another way, and refitting all of them takes that up as well.
    """
    table = library.scene.table
    if np.count_nonzero(library.scene.as_given[table.carried]) < _FEWEST:
        return False
    without, refitted = _left(library, own[:, :0], beside), _left(library, own, beside)
    factors = factor_column(library), _nearly_one(library, own, beside)
    one = min(_left(library, factor, beside) for factor in factors)
    close = _LOST * refitted if told is None else _FEWER * _left(library, told, beside)
    nearly = one <= close and one - refitted <= _MISSED * (without - refitted)
    if not (one <= _ALIKE * refitted or nearly) or without - one < material:
        return False
    pairs = combinations(range(own.shape[1]), 2)
    return all(_left(library, own[:, list(pair)], beside) > _OUTDONE * one for pair in pairs)


def may_be_one_factor(library: Library, twin: Twin) -> bool:
    """Return whether numbers that are all wrong may be one constant, and each a little off."""
    own = _own_columns(library, twin)
    if own.shape[1] < _FEWEST:
        return False
    beside = own[:, :0]
    nearly = _left(library, _nearly_one(library, own, beside, (math.inf, _NEAR)), beside)
    return nearly <= _NEARLY * _left(library, own, beside)


def _own_columns(library: Library, twin: Twin) -> Floats:
    """Return the weighted columns of the numbers that a twin has, shape (m, p)."""
    table = library.scene.table
    return library.base[:, np.isin(np.flatnonzero(table.carried), own_structure(table, twin))]


def _instead(library: Library, own: Floats, beside: Floats) -> tuple[int, ...]:
    """Return the fewest numbers that leave no more than one factor does, the greatest first."""

    def left(numbers: Sequence[int]) -> float:
        return _left(library, own[:, list(numbers)], beside)

    most = _AS_WELL * _left(library, factor_column(library), beside)
    for count in (1, 2):
        best = min(combinations(range(own.shape[1]), count), key=left, default=())
        if best and left(best) <= most:
            return tuple(sorted(best, key=lambda number: left((number,))))
    return ()


def _nearly_one(
    library: Library,
    own: Floats,
    beside: Floats,
    off_by: tuple[float, float] = (_OWN, _OWN_SHARE),
) -> Floats:
    """Return what one factor changes where each number may be off a little by itself, (m, 1).

    A twin's numbers are known to half a percent at best. Where the torque is fifty times its noise
    that shows, and makes no five wrong numbers of one wrong constant. `off_by` is how much of a
    number, and of the factor, that may be.
    """
    whole = factor_column(library)
    numbers = np.linalg.lstsq(own, whole[:, 0])[0]
    factor = np.linalg.lstsq(np.concatenate((whole, beside), axis=1), library.target)[0][0]
    moved = np.linalg.lstsq(np.concatenate((own, beside), axis=1), library.target)[0]
    most = min(off_by[0], off_by[1] * abs(factor)) * np.abs(numbers)
    off = np.clip(moved[: own.shape[1]] - factor * numbers, -most, most)
    return np.asarray(factor * whole + (own @ off)[:, np.newaxis])


def one_factor(
    library: Library,
    twin: Twin,
    beside: Floats,
    varied: Floats,
    material: float,
    named: frozenset[str],
    told: Floats | None = None,
) -> Factor | None:
    """Return the torque constant's factor, where it explains what all numbers explain.

    It must do so beside the effects that were found, too: else it was their absence that bent it.
    And its interval must leave 1 out: what brakes now and then asks for more torque on the average,
    and not for a factor.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.
    beside : ndarray, shape (m, k)
        The effects' columns.
    varied : ndarray, shape (m, v)
        Of the numbers that the effects let vary through what the twin says: what such a number
        is where the law begins is open, and no factor need stand for it.
    material : float
        Weighted squared error that it must remove.
    named : frozenset of str
        The effects, and what may stand in their place.
    told : ndarray, shape (m, t), optional
        Of the numbers that would be called wrong in its place.
    """
    table = library.scene.table
    own = _own_columns(library, twin)
    steady = np.count_nonzero(library.scene.as_given[table.carried]) - varied.shape[1]
    if varied.shape[1] and steady < _FEWEST_STEADY:
        return None
    beside = np.concatenate((beside, varied), axis=1)
    if not one_factor_does(library, own, beside, material, told):
        return None
    columns = np.concatenate((factor_column(library), beside), axis=1)
    basis = basis_of(columns)
    left = library.target - basis @ (basis.T @ library.target)
    moved = float(np.linalg.lstsq(columns, library.target)[0][0])
    reach = reach_of(
        library.candidates, library.weighing, columns, left, named | {"torque-constant-error"}
    )
    low, high = (1.0 + moved + float(end[0]) for end in (reach.below, reach.above))
    if low <= 0.0 or low <= 1.0 <= high:
        return None
    # The reported torque is the true one over the factor.
    factor = Parameter(1.0 / (1.0 + moved), (1.0 / high, 1.0 / low))
    names = [BASE[i] for i in own_structure(table, twin)]
    return Factor(factor, tuple(names[i] for i in _instead(library, own, beside)))


def _left(library: Library, own: Floats, beside: Floats) -> float:
    """Return the squared error on unseen data; without columns, all of it."""
    return float(library.errors_with(own, beside).sum())
