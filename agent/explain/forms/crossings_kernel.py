"""A clearance that is crossed and closed without bouncing, event by event. Import this late.

From where the teeth part, how far the arm has got from them does not depend on how wide the gap
is: of all gaps of one arm a wider one is only crossed later. So every flight is followed once, as
far as the widest gap reaches, and what each gap makes of it is noted where it ends.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from agent.identify.result import Floats

_NOWHERE = 0  # the side on which an arm is whose stretch ended before it had landed


@njit(cache=True, nogil=True)
def _flown(
    pull: Floats,
    residual: Floats,
    begins: NDArray[np.bool_],
    period_s: Floats,
    at: int,
    half_gaps: Floats,
    film: float,
    ends_at: NDArray[np.int32],
    lands_on: NDArray[np.int8],
    along: Floats,
    energy: Floats,
) -> None:
    """Follow an arm from where the teeth part until the widest gap is crossed.

    While the teeth are apart the motor misses what the arm takes, but for what a film between them
    drags along; where they meet again the arm is brought to the motor's speed at once.

    Parameters
    ----------
    pull, residual, begins, period_s : ndarray, shape (n,)
    at : int
        Where the teeth part: the first sample at which the pull is against the side they were on.
    half_gaps : ndarray, shape (g,)
        Ascending.
    film : float
        1/s.
    ends_at, lands_on, along, energy : ndarray, shape (g,)
        For every gap: the first sample after the flight, the side on which the teeth meet, and the
        sums of torque times residual and of squared torque; written here.
    """
    n, count = pull.shape[0], half_gaps.shape[0]
    now = pull[at]
    side = -1.0 if now > 0.0 else 1.0
    late = period_s[at]
    if pull[at - 1] * side > 0.0:
        late *= now / (now - pull[at - 1])
    speed = 0.5 * now * late
    away = -side * speed * late / 3.0
    so_far, square = -now * residual[at], now * now
    before = now
    flying = 0  # the narrowest gap that has not been crossed
    i = at + 1
    while flying < count and i < n and not begins[i]:
        now, dt = pull[i], period_s[i]
        ends, torque = speed + 0.5 * (now + before) * dt, -now
        if film != 0.0:  # else a division by one would be half of the work
            drag = 0.5 * film * dt
            ends = (speed * (1.0 - drag) + 0.5 * (now + before) * dt) / (1.0 + drag)
            torque = 0.5 * film * (speed + ends) - now
        reached = away - side * 0.5 * (speed + ends) * dt
        back = reached <= 0.0 and side * ends > 0.0
        while flying < count:
            half_gap = half_gaps[flying]
            if not back and not (reached >= 2.0 * half_gap and side * ends < 0.0):
                break
            was = abs(half_gap - away)
            way = abs(half_gap - reached) - was
            part = min(max((half_gap - was) / way, 0.0), 1.0) if way > 0.0 else 1.0
            blow = (speed + (ends - speed) * part) / dt + torque * part
            ends_at[flying] = i + 1
            lands_on[flying] = side if back else -side
            along[flying] = so_far + blow * residual[i]
            energy[flying] = square + blow * blow
            flying += 1
        speed, away, before = ends, reached, now
        so_far += torque * residual[i]
        square += torque * torque
        i += 1
    for k in range(flying, count):
        ends_at[k], lands_on[k], along[k], energy[k] = i, _NOWHERE, so_far, square


@njit(cache=True, nogil=True)
def _runs(
    pull: Floats,
    begins: NDArray[np.bool_],
    signs: NDArray[np.int8],
    changes: NDArray[np.bool_],
    first: NDArray[np.int32],
) -> int:
    """Note where every run of one sign of the pull begins; return how many there are.

    Every stretch begins another one. `signs` and `changes`, shape (m,) with eight dividing m, are
    written as well: most samples change nothing, and are passed over eight at a time.
    """
    n = pull.shape[0]
    for i in range(n):
        signs[i] = np.int8(pull[i] > 0.0) - np.int8(pull[i] < 0.0)
    changes[0] = True
    for i in range(1, n):
        changes[i] = (signs[i] != signs[i - 1]) | begins[i]
    count = 0
    eights = changes.view(np.uint64)
    for word in range(eights.shape[0]):
        if eights[word]:
            for i in range(8 * word, 8 * word + 8):
                if changes[i]:
                    first[count] = i
                    count += 1
    return count


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
    """Return the energy of a residual that lies along each clearance's torque, shape (p,).

    0 where it lies against it.

    Parameters
    ----------
    inertial, dry, weight, viscous : ndarray, shape (n,)
        The motor's acceleration, and Coulomb friction, weight and viscous friction over the whole
        inertia, rad/s2.
    residual : ndarray, shape (n,)
    begins : ndarray of bool, shape (n,)
        Where a stretch begins, as it does at the first sample.
    period_s : ndarray, shape (n,)
    points : ndarray, shape (p, 5)
        Half gap in rad, the arm's share of the inertia, and of the Coulomb friction, the damping of
        the film over the arm's inertia, 1/s, and the arm's share of the viscous friction. Gaps of
        one arm follow each other, the narrowest first.
    """
    n, out = inertial.shape[0], np.empty(points.shape[0])
    pull = np.empty(n)
    begin_at = np.empty(n + 1, dtype=np.int32)
    signs, changes = np.zeros(n + -n % 8, dtype=np.int8), np.zeros(n + -n % 8, dtype=np.bool_)
    flight = np.full(n, -1, dtype=np.int32)  # that which begins at a sample; -1: not followed yet
    widest = 1
    first = 0
    for k in range(1, points.shape[0] + 1):
        if k == points.shape[0] or not np.array_equal(points[k, 1:], points[first, 1:]):
            widest, first = max(widest, k - first), k
    ends_at = np.empty((n, widest), dtype=np.int32)
    lands_on = np.empty((n, widest), dtype=np.int8)
    along, energy = np.empty((n, widest)), np.empty((n, widest))
    first = 0
    while first < points.shape[0]:
        share, friction, film, dragged = points[first, 1:]
        last = first + 1
        while last < points.shape[0] and np.array_equal(points[last, 1:], points[first, 1:]):
            last += 1
        weigh, rub, drag_on = 1.0 / share, friction / share, dragged / share
        for i in range(n):
            pull[i] = inertial[i] + weigh * weight[i] + rub * dry[i] + drag_on * viscous[i]
        runs = _runs(pull, begins, signs, changes, begin_at)
        begin_at[runs] = n
        flight[:] = -1
        flights, half_gaps = 0, points[first:last, 0]
        for k in range(last - first - 1, -1, -1):  # the widest gap that parts at a sample asks most
            sum_along, sum_energy, i, run, side = 0.0, 0.0, 0, 0, 0
            while i < n:
                while begin_at[run + 1] <= i:
                    run += 1
                if begins[i]:
                    side = -1 if signs[i] < 0 else 1
                elif signs[i] * side < 0:
                    f = flight[i]
                    if f < 0:
                        f = flight[i] = flights
                        flights += 1
                        _flown(
                            pull,
                            residual,
                            begins,
                            period_s,
                            i,
                            half_gaps[: k + 1],
                            film,
                            ends_at[f],
                            lands_on[f],
                            along[f],
                            energy[f],
                        )
                    sum_along += along[f, k]
                    sum_energy += energy[f, k]
                    i, side = ends_at[f, k], lands_on[f, k]
                    continue
                i = begin_at[run + 1]  # the teeth touch until then: nothing adds up
            out[first + k] = (
                sum_along * sum_along / sum_energy if sum_along > 0.0 and sum_energy > 0.0 else 0.0
            )
        first = last
    return out
