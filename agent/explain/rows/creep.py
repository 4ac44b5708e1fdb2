"""Near standstill friction is not fully there: those speeds are edges, too.

Dry friction of a joint that slides is at its greatest near zero speed. Where it fades there, the
joint creeps before it slips, or a simulator has smoothed the sign of the velocity, as every
integrator of rigid contacts does. Neither is a law of sliding friction; but in slow reversals there
are so many of these samples that they would be taken for one: for friction that yields, or bends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.in_step import hats, hats_at, least
from agent.explain.rows.pieces import banded, thinned
from agent.explain.rows.strata import STANDING_S, lasting
from agent.explain.rows.table import BASE, Table, without_edges
from agent.identify.result import Floats
from agent.identify.rigid.fading import missing_share

_SLOW = tuple(float(x) for x in np.geomspace(3e-4, 1e-2, 6))  # of the fastest speed
_FALLS = (0.02, 0.05, 0.12)  # of the fastest speed: over which friction may fall beside it
_FADED = 0.5  # of the dry level: with more left, friction is there
_WORTH = 0.02  # of what is left: less does nobody harm
_GONE = 4.0  # of tanh's scale: up to there friction is not whole
_MOST_ROWS = 0.3  # of what is driven: what fades along so much of it is a law, and no edge
_LEAST_KEPT = 0.5  # of all rows, with what the filter's memory takes beside the slow ones
_CRAWL = tuple(float(x) for x in np.geomspace(3e-3, 3e-5, 9))  # of the fastest speed
_JUMP = 3.0  # of the residual, between a crawl and the speeds above it
_LEAST_ROWS = 5
_KNOTS, _SHORTEST = 12, 1e-4  # of the longest stroke: where friction has surely not yielded


def without_creep(table: Table, creep_rad_s: float | None = None) -> Table:
    """Return a table in which speeds at which friction fades are left out as edges.

    Parameters
    ----------
    table : Table
    creep_rad_s : float, optional
        Up to which speed; found from the table where not given.
    """
    speed = creep_speed(table) if creep_rad_s is None else creep_rad_s
    if not speed > 0.0:
        return table
    found = without_edges(table, speed)
    if creep_rad_s is not None:
        return found
    # By the speed itself: the filter's memory widens edges, in a narrow band by half a stop.
    driven = table.sliding & ~_resting(table, speed)
    slow = driven & (np.abs(table.rows["velocity_rad_s"]) < speed)
    little = np.count_nonzero(slow) <= _MOST_ROWS * np.count_nonzero(driven)
    enough = np.count_nonzero(found.sliding) >= _LEAST_KEPT * np.count_nonzero(table.sliding)
    return found if little and enough else table


def creep_beside(table: Table, left_nm: Floats) -> float:
    """Return up to which speed friction is not fully there beside what is known, rad/s; or 0.

    Parameters
    ----------
    table : Table
    left_nm : ndarray, shape (n,)
        What is left of the measured torque at its rows; not a number where it is not known.
    """
    known = np.isfinite(left_nm)
    given = table.measured_nm - np.where(known, left_nm, 0.0)
    return without_creep(replace(table, given_nm=given, used=table.used & known)).creep_rad_s


def _resting(table: Table, speed_rad_s: float) -> NDArray[np.bool_]:
    """Return where a joint that is not driven creeps on, as after every move, shape (n,)."""
    speed, held = np.abs(table.full["velocity_rad_s"]), table.full["held_rad_s"]
    out = np.zeros(speed.shape[0])
    for piece in table.pieces:
        slow = (speed[piece.full] < speed_rad_s) & (held[piece.full] == 0.0)
        out[piece.full] = lasting(slow, STANDING_S / piece.period_s)
    return np.asarray(thinned(out, table.pieces) > 0.5)


def creep_speed(table: Table) -> float:
    """Return up to which speed dry friction is not fully there, rad/s; 0 where it always is.

    One column for each of some speeds: what ``sign(v) (1 - tanh(|v| / speed))`` takes away of the
    Coulomb level, beside the twin's own numbers and friction that is free along the travel since a
    reversal (friction that yields is a law) and along the load. Where none shows, beside friction
    that falls with speed, too: what rises towards standstill would hide what fades there. Beside a
    simulation with effects of its own it must fade in the measured torque as well.

    Parameters
    ----------
    table : Table
    """
    rows = table.sliding
    coulomb = BASE.index("coulomb_nm")
    if not rows.any() or not table.carried[coulomb]:
        return 0.0
    velocity, direction = table.full["velocity_rad_s"], table.full["direction"]
    fastest = float(np.quantile(np.abs(table.rows["velocity_rad_s"][rows]), 0.99))
    slow = fastest * np.array(_SLOW)
    near = (direction * missing_share(velocity, speed) for speed in slow)
    falling = (direction * np.exp(-np.abs(velocity) / (fastest * share)) for share in _FALLS)
    both = banded(np.stack((*near, *falling), axis=-1), table.pieces)[rows]
    faded, fall = both[:, : slow.size], both[:, slow.size :]
    sign = np.sign(table.rows["velocity_rad_s"][rows])[:, np.newaxis]
    load = np.abs(table.base[rows, BASE.index("inertia_kg_m2")])
    free = [table.base[rows], sign * hats(load), sign * _yielding(table.rows["travel_rad"][rows])]
    columns, target = np.concatenate(free, axis=1), table.target_nm[rows]
    measured, given = table.measured_nm[rows], table.given_nm[rows]
    level = float(least(table.base[rows], measured)[coulomb])

    def faded_in(torque: Floats) -> float:
        for falls in ((), tuple(fastest * share for share in _FALLS)):
            beside = np.concatenate((columns, fall[:, : len(falls)]), axis=1)
            most = (1.0 - _WORTH) * _energy(beside, torque)
            found = _fading(beside, torque, slow, faded, level=level, most=most, falls=falls)
            if found:
                return found
        return 0.0

    found = faded_in(target)
    # What the simulation has too much of near standstill looks like friction that is not there.
    if found and _energy(table.base[rows], given) > _WORTH * _energy(table.base[rows], target):
        found = faded_in(measured)
    return max(
        _GONE * found, _GONE * _simulated(table, slow, faded), _crawl(table, columns, target)
    )


def _fading(
    columns: Floats,
    target: Floats,
    slow: Floats,
    faded: Floats,
    *,
    level: float,
    most: float,
    falls: Sequence[float] = (),
) -> float:
    """Return the speed whose column of `faded` takes most of a dry level away, or 0.

    At standstill, of what there is where it has faded in: what takes the top off falls that are too
    steep, as those beside a bell are, takes nothing of the friction that the bell begins with.

    Parameters
    ----------
    columns : ndarray, shape (n, k)
        What it stands beside; `falls` last.
    target : ndarray, shape (n,)
    slow : ndarray, shape (s,)
        The speeds, rad/s.
    faded : ndarray, shape (n, s)
        What is missing by each of them.
    level : float
        N m.
    most : float
        The energy that it may leave, N m squared.
    falls : sequence of float
        Over which speeds friction falls beside it, rad/s.
    """
    best, found = most, 0.0
    for index, speed in enumerate(slow.tolist()):
        beside = np.column_stack((columns, faded[:, index]))
        left = _energy(beside, target)
        sizes = least(beside, target)
        missing = float(sizes[-1])
        for fall, size in zip(falls, sizes[-1 - len(falls) : -1], strict=True):
            missing += float(size) * (1.0 - math.exp(-_GONE * speed / fall))
        if left < best and missing < -_FADED * level:
            best, found = left, speed
    return found


def _simulated(table: Table, slow: Floats, faded: Floats) -> float:
    """Return over which speed a recorded simulation smooths its friction's sign; 0 where none does.

    The joint has all of its friction there, so that the simulation lacks some: no law of the joint
    that rises towards standstill, but the simulator's way to integrate. Its own torque tells.
    """
    if not table.simulated:
        return 0.0
    rows = table.sliding
    base, given = table.base[rows], table.given_nm[rows]
    level = float(least(base, given)[BASE.index("coulomb_nm")])
    most = _energy(base, given) - _WORTH * _energy(base, table.target_nm[rows])
    return _fading(base, given, slow, faded, level=level, most=most)


def _crawl(table: Table, columns: Floats, target: Floats) -> float:
    """Return below which speed a joint that crawls stands in truth, rad/s; 0 where none does.

    Rigid contacts of a simulator give way a little under any torque, and a clean velocity shows it.
    Friction there is what the drive makes of it, and takes a jump at the speed below which it does;
    friction that yields, bends or rises towards standstill goes on above any speed.
    """
    speed = np.abs(table.rows["velocity_rad_s"][table.sliding])
    left = (target - columns @ least(columns, target)) ** 2
    for limit in np.quantile(speed, 0.99) * np.array(_CRAWL):
        below, above = speed < limit, (speed >= limit) & (speed < _GONE * limit)
        if min(np.count_nonzero(below), np.count_nonzero(above)) < _LEAST_ROWS:
            continue
        jumps = float(np.mean(left[below])) > _JUMP**2 * float(np.mean(left[above]))
        if jumps and float(left[below].sum()) > _WORTH * float(left.sum()):
            return float(limit)
    return 0.0


def _yielding(travel_rad: Floats) -> Floats:
    """Return hat functions of the travel since a reversal, shape (n, k), evenly by its logarithm.

    Friction that yields does so within a thousandth of the longest stroke, or a tenth of it.
    """
    longest = float(np.quantile(travel_rad, 0.99))
    if not longest > 0.0:
        return hats(travel_rad)
    knots = np.geomspace(_SHORTEST * longest, longest, _KNOTS)
    return hats_at(np.log(np.maximum(travel_rad, knots[0])), np.log(knots))


def _energy(columns: Floats, target: Floats) -> float:
    rest = target - columns @ least(columns, target)
    return float(rest @ rest)
