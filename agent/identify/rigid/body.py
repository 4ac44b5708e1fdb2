"""The rigid-body regression of thesis (4.5): inertia, friction, gravity and offset in one fit.

Columns that this motion cannot tell apart are left out and reported with the reason; they are
never given a number. Intervals come from leaving out blocks of time, because the residuals are
coloured by ripple, control and the filter.

An arm behind a spring is heavier the faster the motion changes: seen from the motor, a joint of
motor inertia Jm and arm inertia Ja on a spring k asks for ``(Jm + Ja/(1 - w^2 Ja/k)) a``, which is
``(Jm + Ja) a - (Ja^2/k) d2a/dt2`` to the first order below the resonance. Where the data show that
second term, its column takes part in the fit, so that neither the inertia nor gravity (at the
ends of a stroke, acceleration looks like position) has to stand in for it. It is no parameter of
the rigid body, and predicts nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction.law_fit import fit_percent
from agent.identify.result import Floats, Parameter, RigidBodyFit, Validation
from agent.identify.rigid.linear import time_blocks
from agent.identify.signals.preprocess import SPEED_CHANGE, FilteredStretch
from agent.identify.uncertainty import block_jackknife, student_975
from agent.physics.rigid_body import PARAMETERS

_INFLATION = 1000.0  # a parameter's variance against that with all other columns orthogonal
_UNMISTAKABLE = 3.0
_BEYOND = 1.5  # times a filter's second order: what its third may add
_BLOCKS = 40
_FEWEST_BLOCKS = 12
_OFFSET = "torque_offset_nm"
_VISCOUS = "viscous_nm_s_per_rad"
_GRAVITY = ("gravity_sin_nm", "gravity_cos_nm")
_NOISE_SHARE = 0.3  # of the acceleration's root mean square: the inertia is 9 % too low
_DROP_FIRST = (*_GRAVITY, "inertia_kg_m2", _OFFSET, _VISCOUS)


@dataclass(frozen=True)
class Rows:
    """Filtered, usable samples of all recordings: N rows.

    Parameters
    ----------
    columns : ndarray, shape (N, 6)
        In the order of `PARAMETERS`.
    torque_nm : ndarray, shape (N,)
        Filtered alike.
    time_s : ndarray, shape (N,)
        Time of filtering units, rising without gaps or overlaps over stretches and recordings.
    snap_rad_s4 : ndarray, shape (N,)
        Second derivative of the acceleration column.
    inertia_hidden : str
        Why the inertia is not felt: velocity that hardly changes, noise; empty where it is.
    arm_stroke_rad : float
        How far the arm moved; NaN without a position.
    """

    columns: Floats
    torque_nm: Floats
    time_s: Floats
    snap_rad_s4: Floats
    inertia_hidden: str
    arm_stroke_rad: float

    def some(self, kept: Sequence[int]) -> Floats:
        """Return these columns, shape (N, k); all of them without a copy."""
        return self.columns if len(kept) == self.columns.shape[1] else self.columns[:, kept]


def collect_rows(
    stretches: Sequence[FilteredStretch], arm_stroke_rad: float, noise_share: float = 0.0
) -> Rows:
    """Put the usable samples of all filtered stretches under each other.

    Parameters
    ----------
    stretches : sequence of FilteredStretch
        Of all recordings.
    arm_stroke_rad : float
        How far the arm moved; NaN without a position.
    noise_share : float
        Measuring noise in the filtered acceleration, as a share of its root mean square.
    """
    columns, torques, times, snaps = [], [], [], []
    clock_s = 0.0
    for s in stretches:
        time_s = s.stretch.time_s - s.stretch.time_s[0] + clock_s
        clock_s = float(time_s[-1]) + s.stretch.period_s
        columns.append(s.regressor[s.usable])
        torques.append(s.torque_nm[s.usable])
        times.append(time_s[s.usable])
        snaps.append(s.snap_rad_s4[s.usable])
    fastest = max((float(np.abs(s.velocity_rad_s).max()) for s in stretches), default=0.0)
    change = max((float(np.ptp(s.velocity_rad_s)) for s in stretches), default=0.0)
    hidden = ""
    if change <= SPEED_CHANGE * fastest:
        hidden = "the velocity hardly changes inside any stretch of data"
    elif noise_share > _NOISE_SHARE:
        hidden = "the acceleration is drowned in measuring noise"
    return Rows(
        np.concatenate(columns) if columns else np.zeros((0, len(PARAMETERS))),
        np.concatenate(torques) if torques else np.zeros(0),
        np.concatenate(times) if times else np.zeros(0),
        np.concatenate(snaps) if snaps else np.zeros(0),
        inertia_hidden=hidden,
        arm_stroke_rad=arm_stroke_rad,
    )


def fit_rigid_body(rows: Rows, *, spring: bool = True) -> RigidBodyFit | None:
    """Regress the torque on the motion, shape (N, 6), as far as the motion carries it.

    Parameters
    ----------
    rows : Rows
        Filtered samples.
    spring : bool
        Whether a spring between motor and arm, and a torque that is late against the motion, may
        take part, where the data show them.

    Returns
    -------
    RigidBodyFit or None
        `condition_number` is (4.11), the ratio of the singular values of the regressor as it is
        (unscaled columns, as in the thesis), over the columns that were kept. None with too few
        samples to say anything.
    """
    if rows.torque_nm.shape[0] < 10 * len(PARAMETERS):
        return None
    reasons = _left_out(rows)
    kept = [i for i, name in enumerate(PARAMETERS) if name not in reasons]
    columns = rows.some(kept)
    blocks = time_blocks(rows.time_s, _BLOCKS)
    if int(blocks[-1]) + 1 < _FEWEST_BLOCKS or not kept:
        return None
    fit = _regress(rows, kept, blocks, spring=spring)
    parameters: dict[str, Parameter] = {}
    for name in PARAMETERS:
        if name in reasons:
            parameters[name] = Parameter.not_identified(reasons[name])
        else:
            k = kept.index(PARAMETERS.index(name))
            low, high = fit.ends[k].tolist()
            parameters[name] = Parameter(float(fit.theta[k]), (low, high))
    predicted = columns @ fit.theta
    singular = np.linalg.svd(columns.T @ columns, compute_uv=False)
    condition = float(np.sqrt(singular[0] / singular[-1])) if singular[-1] > 0.0 else np.inf
    return RigidBodyFit(
        parameters=parameters,
        condition_number=condition,
        rmse_nm=float(np.sqrt(np.mean((rows.torque_nm - predicted) ** 2))),
        fit_percent=fit_percent(rows.torque_nm, predicted),
        as_twin=_as_twin(rows, kept, blocks, parameters, spring=spring),
        spring_took_part=fit.spring,
        torque_late_s=fit.late_s,
    )


def _as_twin(
    rows: Rows,
    kept: Sequence[int],
    blocks: NDArray[np.int64],
    parameters: Mapping[str, Parameter],
    *,
    spring: bool,
) -> dict[str, float]:
    """Return the values of a fit without what a twin cannot hold and the data do not show.

    A twin has no constant torque. Gravity of a fit that has one, on a stroke on which its cosine is
    nearly constant, is off by as much as the offset is, and neither is more than chance. Nor has it
    friction that pushes: where viscous friction comes out negative by chance, Coulomb friction is
    too high by as much. Nothing where the data show what a twin cannot hold, or nothing is so.
    """
    without = []
    offset, viscous = parameters[_OFFSET], parameters[_VISCOUS]
    if offset.ci95 is not None and offset.ci95[0] <= 0.0 <= offset.ci95[1]:
        without.append(_OFFSET)
    if viscous.ci95 is not None and viscous.value < 0.0 <= viscous.ci95[1]:
        without.append(_VISCOUS)
    if not without:
        return {}
    others = [i for i in kept if PARAMETERS[i] not in without]
    theta = _regress(rows, others, blocks, spring=spring).theta
    return {PARAMETERS[i]: float(value) for i, value in zip(others, theta, strict=True)}


@dataclass(frozen=True)
class _Fit:
    """Kept parameters and their 95 % intervals, shapes (p,) and (p, 2), and what took part."""

    theta: Floats
    ends: Floats
    spring: bool = False
    late_s: float = 0.0


def _regress(rows: Rows, kept: Sequence[int], blocks: NDArray[np.int64], *, spring: bool) -> _Fit:
    """Fit the kept parameters, beside what is none of them where the data show it."""
    columns = rows.some(kept)
    theta, reach = _with_reach(columns, rows.torque_nm, blocks)
    fit = _Fit(theta, np.stack((theta - reach, theta + reach), axis=-1))
    if not spring or PARAMETERS.index("inertia_kg_m2") not in kept:
        return fit
    slope = _gravity_left_out(rows, kept)
    if slope is None:
        return _beside_spring_or_lateness(rows, columns, fit, blocks)
    beside, weight = _beside(rows, columns, fit, slope, blocks, positive=False)
    if weight != 0.0:
        rows = replace(rows, torque_nm=rows.torque_nm - weight * slope)
        return _beside_spring_or_lateness(rows, columns, beside, blocks)
    wider = beside.ends - fit.ends
    fit = _beside_spring_or_lateness(rows, columns, fit, blocks)
    return replace(fit, ends=fit.ends + wider)


def _beside_spring_or_lateness(
    rows: Rows, columns: Floats, fit: _Fit, blocks: NDArray[np.int64]
) -> _Fit:
    """Return the fit beside a spring, or a torque that is late, where the data show one.

    A torque that comes dt later than the motion is ``X theta - dt d(X theta)/dt``: at reversals
    friction then looks like inertia. A drive's torque filter or a late velocity (a negative dt) of
    6 ms bent Coulomb friction by 4 % and inertia by 2 %.
    """
    fit, stiffness = _beside(rows, columns, fit, -rows.snap_rad_s4, blocks, positive=True)
    if stiffness > 0.0:
        # Both are first terms of a series; what they make together is as large as the second ones.
        return replace(fit, spring=True)
    late = -np.gradient(columns @ fit.theta, rows.time_s)
    fit, late_s = _beside(rows, columns, fit, late, blocks, positive=False)
    if late_s == 0.0:
        return fit
    # A filter and a delay part in the second derivative, by up to the filter's dt^2.
    bend = _BEYOND * late_s**2 * np.gradient(late, rows.time_s)
    both = np.column_stack((columns, late))
    moved = np.abs(np.linalg.solve(both.T @ both, both.T @ bend)[:-1])
    ends = fit.ends + np.stack((-moved, moved), axis=-1)
    return replace(fit, ends=ends, late_s=late_s)


def _gravity_left_out(rows: Rows, kept: Sequence[int]) -> Floats | None:
    """Return how gravity changes along a stroke too short to tell it, shape (N,); else None.

    On such a stroke sine, cosine and a constant are one. What is left of them, a slope along the
    stroke, is felt all the same: at its ends it looks like acceleration.
    """
    gravity = [PARAMETERS.index(name) for name in _GRAVITY]
    if not np.isfinite(rows.arm_stroke_rad) or any(i in kept for i in gravity):
        return None
    columns = rows.columns[:, gravity] - rows.columns[:, gravity].mean(axis=0)
    slope = columns @ np.linalg.eigh(columns.T @ columns)[1][:, -1]
    return np.asarray(slope, dtype=np.float64)


def _beside(
    rows: Rows,
    columns: Floats,
    fit: _Fit,
    extra: Floats,
    blocks: NDArray[np.int64],
    *,
    positive: bool,
) -> tuple[_Fit, float]:
    """Return the fit beside one more column, and the column's coefficient where it took part.

    It takes part where its coefficient exceeds zero by three times its own interval. Between one
    and three times it may be what friction does at reversals: the parameters are those without, and
    the intervals reach over both fits.
    """
    both = np.column_stack((columns, extra))
    if variance_inflation(both)[-1] > _INFLATION:
        return fit, 0.0
    theta, reach = _with_reach(both, rows.torque_nm, blocks)
    size = float(theta[-1] if positive else abs(theta[-1]))
    if not size > reach[-1]:
        return fit, 0.0
    ends = np.stack((theta - reach, theta + reach), axis=-1)[:-1]
    if size > _UNMISTAKABLE * reach[-1]:
        return replace(fit, theta=theta[:-1], ends=ends), float(theta[-1])
    lower, upper = np.minimum(fit.ends, ends), np.maximum(fit.ends, ends)
    return replace(fit, ends=np.stack((lower[:, 0], upper[:, 1]), axis=-1)), 0.0


def _with_reach(
    columns: Floats, torque_nm: Floats, blocks: NDArray[np.int64]
) -> tuple[Floats, Floats]:
    theta, covariance, dof = block_jackknife(columns, torque_nm, blocks)
    return theta, student_975(dof) * np.sqrt(np.maximum(np.diag(covariance), 0.0))


def weights(fit: RigidBodyFit) -> Floats:
    """Return the fitted parameters, shape (6,), with zero where one was not identified."""
    values = [fit.parameters[name] for name in PARAMETERS]
    return np.array([p.value if p.identified else 0.0 for p in values])


def validate(fit: RigidBodyFit, rows: Rows, name: str) -> Validation:
    """Predict a run that the fit has not seen.

    Parameters
    ----------
    fit : RigidBodyFit
        From other recordings.
    rows : Rows
        The unseen run, filtered with the fit's own cutoff.
    name : str
        What the run is called.
    """
    predicted = rows.columns @ weights(fit)
    error = rows.torque_nm - predicted
    size = float(np.linalg.norm(rows.torque_nm))
    return Validation(
        recording=name,
        rmse_nm=float(np.sqrt(np.mean(error**2))) if error.size else float("nan"),
        fit_percent=fit_percent(rows.torque_nm, predicted) if error.size else float("nan"),
        relative_torque_error_percent=(
            100.0 * float(np.linalg.norm(error)) / size if size > 0.0 else float("nan")
        ),
    )


def variance_inflation(columns: Floats) -> Floats:
    """Return how much each parameter's variance grows because the columns are not orthogonal.

    Diagonal of the inverse of the columns' Gram matrix, columns scaled to unit length: 1 for an
    orthogonal column, infinite for one that the others make up. No mean is taken away: the
    constant is one of the columns.

    Parameters
    ----------
    columns : ndarray, shape (N, p)
    """
    gram = columns.T @ columns
    length = np.sqrt(np.diag(gram))
    out = np.full(columns.shape[1], np.inf)
    alive = length > 0.0
    unit = gram[np.ix_(alive, alive)] / np.outer(length[alive], length[alive])
    values, vectors = np.linalg.eigh(unit)
    usable = np.maximum(values, 1e-13)
    out[alive] = np.einsum("ij,j->i", vectors**2, 1.0 / usable)
    return out


def _left_out(rows: Rows) -> dict[str, str]:
    """Return the columns that this motion does not carry, with the reason for each."""
    reasons: dict[str, str] = {}
    if not np.isfinite(rows.arm_stroke_rad):
        for name in _GRAVITY:
            reasons[name] = "no position was recorded"
    if rows.inertia_hidden:
        reasons["inertia_kg_m2"] = rows.inertia_hidden
    while True:
        kept = [i for i, name in enumerate(PARAMETERS) if name not in reasons]
        inflation = dict(
            zip(
                [PARAMETERS[i] for i in kept],
                variance_inflation(rows.some(kept)).tolist(),
                strict=True,
            )
        )
        mixed = [name for name in _DROP_FIRST if inflation.get(name, 0.0) > _INFLATION]
        if not mixed:
            return reasons
        for name in _GRAVITY if mixed[0] in _GRAVITY else mixed[:1]:
            reasons[name] = _mixed_reason(name, rows)


def _mixed_reason(name: str, rows: Rows) -> str:
    """Say why a column cannot be told from the others."""
    if name in _GRAVITY:
        degrees = np.degrees(rows.arm_stroke_rad)
        return (
            f"on a stroke of {degrees:.3g} degrees of the arm, gravity cannot be told from a "
            "constant torque"
        )
    return {
        "inertia_kg_m2": "the acceleration cannot be told from the other columns",
        "torque_offset_nm": "moving one way, a constant torque cannot be told from friction",
        "viscous_nm_s_per_rad": "at one speed, viscous friction cannot be told from Coulomb",
    }[name]
