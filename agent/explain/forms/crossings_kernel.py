"""A clearance that is crossed and closed without bouncing, event by event. Import this late."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from agent.identify.result import Floats


@njit(cache=True, nogil=True)
def _likeness(
    pull: Floats,
    turns: NDArray[np.int32],
    residual: Floats,
    begins: NDArray[np.bool_],
    period_s: Floats,
    half_gap: float,
    film: float,
) -> float:
    """Return the energy of a residual that lies along one clearance's torque; 0 where against it.

    While the teeth are apart the motor misses what the arm takes, but for what a film between them
    drags along; where they meet again the arm is brought to the motor's speed at once.
    """
    along, energy = 0.0, 0.0
    apart = False
    side, twist, speed, before = 1.0, 0.0, 0.0, 0.0
    i = 0
    while i < pull.shape[0]:
        now = pull[i]
        if begins[i]:
            apart, side = False, 1.0 if now >= 0.0 else -1.0
        elif apart:
            dt = period_s[i]
            ends, torque = speed + 0.5 * (now + before) * dt, -now
            if film != 0.0:  # else a division by one would be half of the work
                drag = 0.5 * film * dt
                ends = (speed * (1.0 - drag) + 0.5 * (now + before) * dt) / (1.0 + drag)
                torque = 0.5 * film * (speed + ends) - now
            reached = twist + 0.5 * (speed + ends) * dt
            if abs(reached) >= half_gap and reached * ends > 0.0:
                way = abs(reached) - abs(twist)
                part = min(max((half_gap - abs(twist)) / way, 0.0), 1.0) if way > 0.0 else 1.0
                torque = (speed + (ends - speed) * part) / dt + torque * part
                apart, side = False, 1.0 if reached > 0.0 else -1.0
            speed, twist = ends, reached
            along += torque * residual[i]
            energy += torque * torque
        elif now * side < 0.0:
            late = period_s[i]
            if before * side > 0.0:
                late *= now / (now - before)
            apart, speed = True, 0.5 * now * late
            twist = side * half_gap + speed * late / 3.0
            along -= now * residual[i]
            energy += now * now
        i += 1
        if not apart and i < pull.shape[0]:
            i = turns[0 if side > 0.0 else 1, i]  # the teeth touch until then: nothing adds up
        before = pull[i - 1]
    return along * along / energy if along > 0.0 and energy > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _turns(pull: Floats, begins: NDArray[np.bool_], out: NDArray[np.int32]) -> None:
    """Note from every sample on when the pull next falls below zero, and when above; (2, n).

    Or when a stretch begins; past the last sample where nothing of it comes.
    """
    below = above = pull.shape[0]
    for i in range(pull.shape[0] - 1, -1, -1):
        if begins[i] or pull[i] < 0.0:
            below = i
        if begins[i] or pull[i] > 0.0:
            above = i
        out[0, i], out[1, i] = below, above


@njit(cache=True, nogil=True)
def likeness_of(
    inertial: Floats,
    dry: Floats,
    weight: Floats,
    viscous: Floats,
    residual: Floats,
    begins: NDArray[np.bool_],
    period_s: Floats,
    points: Floats,
) -> Floats:
    """Return the likeness at every point, shape (p,).

    What pulls the teeth apart is the same for all gaps: it is summed once for points that follow
    each other and differ in their gap alone.

    Parameters
    ----------
    inertial, dry, weight, viscous : ndarray, shape (n,)
        The motor's acceleration, and Coulomb friction, weight and viscous friction over the whole
        inertia, rad/s2.
    residual : ndarray, shape (n,)
    begins : ndarray of bool, shape (n,)
        Where a stretch begins.
    period_s : ndarray, shape (n,)
    points : ndarray, shape (p, 5)
        Half gap in rad, the arm's share of the inertia, and of the Coulomb friction, the damping of
        the film over the arm's inertia, 1/s, and the arm's share of the viscous friction.
    """
    out = np.empty(points.shape[0])
    pull = np.empty(inertial.shape[0])
    turns = np.empty((2, inertial.shape[0]), dtype=np.int32)
    for k in range(points.shape[0]):
        share, friction, dragged = points[k, 1], points[k, 2], points[k, 4]
        same = (
            k > 0
            and share == points[k - 1, 1]
            and friction == points[k - 1, 2]
            and dragged == points[k - 1, 4]
        )
        if not same:
            weigh, rub, drag_on = 1.0 / share, friction / share, dragged / share
            for i in range(pull.shape[0]):
                pull[i] = inertial[i] + weigh * weight[i] + rub * dry[i] + drag_on * viscous[i]
            _turns(pull, begins, turns)
        out[k] = _likeness(pull, turns, residual, begins, period_s, points[k, 0], points[k, 3])
    return out
