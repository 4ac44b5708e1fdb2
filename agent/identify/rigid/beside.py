"""Least squares of the rigid body beside what is none of it, where the data show it.

An arm behind a spring is heavier the faster the motion changes: seen from the motor, a joint of
motor inertia Jm and arm inertia Ja on a spring k asks for ``(Jm + Ja/(1 - w^2 Ja/k)) a``, which is
``(Jm + Ja) a - (Ja^2/k) d2a/dt2`` to the first order below the resonance. Where the data show that
second term, its column takes part in the fit, so that neither the inertia nor gravity (at the
ends of a stroke, acceleration looks like position) has to stand in for it. So does a torque that
comes later or earlier than the motion, and gravity on a stroke that is too short to tell it. None
of them is a parameter of the rigid body, and none predicts anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.rigid.carried import INFLATION, variance_inflation
from agent.identify.rigid.rows import Rows
from agent.identify.uncertainty import block_jackknife, covariance_of_one_memory, student_975
from agent.physics.rigid_body import GRAVITY, PARAMETERS

_UNMISTAKABLE = 3.0
_TURNS_LATE = 2.0  # samples: friction that turns within less may be late by the sampling
_ALONE = 0.5  # of friction's lateness: as much at most is everything else late
_BEYOND = 1.5  # times a filter's second order: what its third may add


@dataclass(frozen=True)
class Fit:
    """Kept parameters and their 95 % intervals, shapes (p,) and (p, 2), and what took part."""

    theta: Floats
    ends: Floats
    spring: bool = False
    late_s: float = 0.0


def fit_beside(rows: Rows, kept: Sequence[int], blocks: NDArray[np.int64], *, spring: bool) -> Fit:
    """Fit the kept parameters, beside what is none of them where the data show it."""
    columns = rows.some(kept)
    theta, ends, _ = _with_ends(columns, rows.torque_nm, blocks)
    fit = Fit(theta, ends)
    if not spring or PARAMETERS.index("inertia_kg_m2") not in kept:
        return fit
    slope = _gravity_left_out(rows, kept)
    if slope is None:
        return _beside_spring_and_lateness(rows, columns, fit, blocks)
    beside, weight = _beside(rows, columns, fit, slope, blocks, positive=False)
    if weight != 0.0:
        rows = replace(rows, torque_nm=rows.torque_nm - weight * slope)
        return _beside_spring_and_lateness(rows, columns, beside, blocks)
    wider = beside.ends - fit.ends
    fit = _beside_spring_and_lateness(rows, columns, fit, blocks)
    return replace(fit, ends=fit.ends + wider)


def _beside_spring_and_lateness(
    rows: Rows, columns: Floats, fit: Fit, blocks: NDArray[np.int64]
) -> Fit:
    """Return the fit beside a spring and a torque that is late, where the data show them.

    Each hides the other: a spring that is not plain is asked for again beside the lateness.
    """
    snap = -rows.snap_rad_s4
    sprung, stiffness = _beside(rows, columns, fit, snap, blocks, positive=True)
    if stiffness == 0.0:
        late = _late(rows, columns, sprung)
        beside, late_s = _beside_lateness(rows, columns, sprung, late, blocks)
        if late_s == 0.0:
            turning = _late_friction(rows, columns, fit)
            if turning is None:
                return beside
            turned, by = _beside(rows, columns, fit, turning, blocks, positive=True)
            return turned if by > _TURNS_LATE * _period_s(rows) else beside
        held = Fit(np.append(beside.theta, late_s), np.vstack((beside.ends, (late_s, late_s))))
        both = np.column_stack((columns, late))
        sprung, stiffness = _beside(rows, both, held, snap, blocks, positive=True)
        sprung = Fit(sprung.theta[:-1], sprung.ends[:-1])
        if stiffness == 0.0:
            return replace(sprung, late_s=late_s)
    held = Fit(np.append(sprung.theta, stiffness), np.vstack((sprung.ends, (stiffness, stiffness))))
    columns = np.column_stack((columns, snap))  # the spring's torque is late with the others
    fit, late_s = _beside_lateness(rows, columns, held, _late(rows, columns, held), blocks)
    return Fit(fit.theta[:-1], fit.ends[:-1], spring=True, late_s=late_s)


def _late(rows: Rows, columns: Floats, fit: Fit) -> Floats:
    """Return what the torque changes by for every second that it comes late, shape (N,)."""
    return -np.gradient(columns @ fit.theta, rows.time_s)


def _beside_lateness(
    rows: Rows, columns: Floats, fit: Fit, late: Floats, blocks: NDArray[np.int64]
) -> tuple[Fit, float]:
    """Return the fit beside a torque that comes late, and by how many seconds; 0 for not.

    A torque that comes dt later than the motion is ``X theta - dt d(X theta)/dt``: at reversals
    friction then looks like inertia. A drive's torque filter or a late velocity (a negative dt) of
    6 ms bent Coulomb friction by 4 % and inertia by 2 %.
    """
    without = fit
    fit, late_s = _beside(rows, columns, fit, late, blocks, positive=False)
    if late_s == 0.0:
        return fit, 0.0
    turning = _late_friction(rows, columns, without)
    if turning is not None and _friction_alone_is_late(rows, columns, late, turning, blocks):
        return _beside(rows, columns, without, turning, blocks, positive=True)[0], 0.0
    # A filter and a delay part in the second derivative, by up to the filter's dt^2.
    bend = _BEYOND * late_s**2 * np.gradient(late, rows.time_s)
    both = np.column_stack((columns, late))
    moved = np.abs(np.linalg.solve(both.T @ both, both.T @ bend)[:-1])
    return replace(fit, ends=fit.ends + np.stack((-moved, moved), axis=-1)), late_s


def _period_s(rows: Rows) -> float:
    """Return the time between rows, s, as most of them have it."""
    return float(np.median(np.diff(rows.time_s)))


def _late_friction(rows: Rows, columns: Floats, fit: Fit) -> Floats | None:
    """Return what a Coulomb friction that comes late changes the torque by per second, (N,)."""
    dry = rows.columns[:, PARAMETERS.index("coulomb_nm")]
    own = [k for k in range(columns.shape[1]) if np.array_equal(columns[:, k], dry)]
    if not own:
        return None
    return np.asarray(-np.gradient(columns[:, own[0]] * fit.theta[own[0]], rows.time_s))


def _friction_alone_is_late(
    rows: Rows, columns: Floats, late: Floats, turning: Floats, blocks: NDArray[np.int64]
) -> bool:
    """Return whether friction turns later than the motion, and nothing else is late with it.

    Contacts yield before they slip, so that friction has turned some milliseconds after the motion
    has. A torque that is late is so on every ramp as well, where the inertia shows it.
    """
    both = np.column_stack((columns, late - turning, turning))
    if np.any(variance_inflation(both)[-2:] > INFLATION):
        return False
    theta, ends, _ = _with_ends(both, rows.torque_nm, blocks)
    others, friction = float(theta[-2]), float(theta[-1])
    most = float(np.max(np.abs(ends[-2])))
    return abs(others) < most < _ALONE * friction


def _gravity_left_out(rows: Rows, kept: Sequence[int]) -> Floats | None:
    """Return how gravity changes along a stroke too short to tell it, shape (N,); else None.

    On such a stroke sine, cosine and a constant are one. What is left of them, a slope along the
    stroke, is felt all the same: at its ends it looks like acceleration.
    """
    gravity = [PARAMETERS.index(name) for name in GRAVITY]
    if not np.isfinite(rows.arm_stroke_rad) or any(i in kept for i in gravity):
        return None
    columns = rows.columns[:, gravity] - rows.columns[:, gravity].mean(axis=0)
    slope = columns @ np.linalg.eigh(columns.T @ columns)[1][:, -1]
    return np.asarray(slope, dtype=np.float64)


def _beside(
    rows: Rows,
    columns: Floats,
    fit: Fit,
    extra: Floats,
    blocks: NDArray[np.int64],
    *,
    positive: bool,
) -> tuple[Fit, float]:
    """Return the fit beside one more column, and the column's coefficient where it took part.

    It takes part where its coefficient exceeds zero by three times its own interval. Between one
    and three times it may be what friction does at reversals: the parameters are those without, and
    the intervals reach over both fits.
    """
    both = np.column_stack((columns, extra))
    if variance_inflation(both)[-1] > INFLATION:
        return fit, 0.0
    theta, ends, scatter = _with_ends(both, rows.torque_nm, blocks)
    ends, size = ends[:-1], float(theta[-1] if positive else abs(theta[-1]))
    if not size > scatter[-1]:
        return fit, 0.0
    if size > _UNMISTAKABLE * scatter[-1]:
        return replace(fit, theta=theta[:-1], ends=ends), float(theta[-1])
    lower, upper = np.minimum(fit.ends, ends), np.maximum(fit.ends, ends)
    return replace(fit, ends=np.stack((lower[:, 0], upper[:, 1]), axis=-1)), 0.0


def _with_ends(
    columns: Floats, torque_nm: Floats, blocks: NDArray[np.int64]
) -> tuple[Floats, Floats, Floats]:
    """Return least squares, its 95 % intervals, shape (p, 2), and half of what its blocks scatter.

    What a few blocks carry, gravity at the ends of a stroke, is known no better than from these
    few: by chance they scatter little. An interval is never narrower than the blocks' noise makes
    it that remembers as long everywhere as all parameters together show.
    """
    theta, covariance, dof = block_jackknife(columns, torque_nm, blocks)
    shared = covariance_of_one_memory(columns, torque_nm - columns @ theta, blocks)
    scatter, least = (
        student_975(dof) * np.sqrt(np.maximum(np.diag(c), 0.0)) for c in (covariance, shared)
    )
    reach = np.maximum(scatter, least)
    return theta, np.stack((theta - reach, theta + reach), axis=-1), scatter
