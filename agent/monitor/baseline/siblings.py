"""Learning from grown joints of one kind what a young one like them may borrow (`kind`).

Each joint's cycles are taken for

    y_i = level (1 + b . phi(c_i) + drift t_i) + noise,

all of one basis phi; the drift is taken out, so that slow wear or running-in is not learned as
warmth. What a joint's cycles say of b is a normal likelihood, and b differs between the joints of a
kind by Student's law with few degrees of freedom, so that one of another kind among them pulls
little. Middle and covariance are found by expectation and maximisation (Dempster, Laird and Rubin,
J. R. Stat. Soc. B 39 (1977) 1; Lange, Little and Taylor, JASA 84 (1989) 881) from the broad priors
on, so that what no joint shows, such as a payload that never changed, stays as open as it was.
Scatter and the correlation of neighbours are counted in each joint; their median holds, and how far
joints differ in them says how much it is worth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.compensation.compensation import PRIORS, Basis, Conditions, Prior
from agent.monitor.compensation.held import DECAYS_K, basis_of
from agent.monitor.compensation.kind import FEWEST_SIBLINGS, Kind, Shape
from agent.monitor.detection.standing import shown_tie
from agent.monitor.history.table import Features

_STEPS = 40  # of expectation and maximisation
_TAIL = 4.0  # degrees of freedom of the law between joints: one of another kind pulls little
_OUTLIER = 5.0  # robust deviations
_MAD_TO_SIGMA = 1.4826
_HARDLY = 0.02  # share of a shape that no joint has
_DIFFER = 0.02  # variance between joints of the logarithm of the scatter's square, at least
_TIES_DIFFER = 0.0025  # variance between joints of the correlation, at least


@dataclass(frozen=True)
class _Seen:
    """What one joint's cycles say under one shape.

    Of the coefficients b, as a share of its level: exp(pull . b - b . stiffness . b / 2). `left`
    are the residuals, as shares.
    """

    stiffness: Floats
    pull: Floats
    left: Floats
    tie: float


def kinds_of(grown: Sequence[tuple[Features, Floats]]) -> dict[str, Kind]:
    """Return what grown joints of one kind show of each feature.

    Parameters
    ----------
    grown : sequence of (Features, ndarray of shape (n,))
        Of each joint, healthy cycles in order of time and when they were run, s.

    Returns
    -------
    dict of str to Kind
        Empty where there are fewer than `FEWEST_SIBLINGS` joints whose temperature is known
        throughout, and as few where it is known nowhere.
    """
    warm = [one for one in grown if np.all(np.isfinite(one[0].conditions.temperature_degc))]
    taken = warm or [
        one for one in grown if not np.any(np.isfinite(one[0].conditions.temperature_degc))
    ]
    if len(taken) < FEWEST_SIBLINGS:
        return {}
    basis = basis_of(_pooled([features.conditions for features, _ in taken]))
    return {name: _kind(taken, basis, name, prior) for name, prior in PRIORS.items()}


def _pooled(conditions: Sequence[Conditions]) -> Conditions:
    return Conditions(
        np.concatenate([c.temperature_degc for c in conditions]),
        np.concatenate([c.payload_kg for c in conditions]),
        np.concatenate([c.load_nm for c in conditions]),
    )


def _kind(grown: Sequence[tuple[Features, Floats]], basis: Basis, name: str, prior: Prior) -> Kind:
    """Return what the joints show of one feature."""
    decays = DECAYS_K if basis.temperature else DECAYS_K[:1]
    seen = [[_seen(f, time_s, basis, d, name) for d in decays] for f, time_s in grown]
    scale = np.array([[np.log(np.std(one.left)) for one in joint] for joint in seen])
    counts = np.array([joint[0].left.size for joint in seen])
    ties = np.array([joint[int(np.argmin(s))].tie for joint, s in zip(seen, scale, strict=True)])
    worth = counts * (1.0 - np.maximum(ties, 0.0)) / (1.0 + np.maximum(ties, 0.0))
    likely = -worth[:, None] * scale
    likely = np.exp(likely - likely.max(axis=1, keepdims=True))
    share = np.mean(likely / likely.sum(axis=1, keepdims=True), axis=0) + _HARDLY
    shapes = tuple(
        Shape(d, float(s), *_between([joint[k] for joint in seen], basis, prior))
        for k, (d, s) in enumerate(zip(decays, share / share.sum(), strict=True))
    )
    least = 2.0 * np.min(scale, axis=1)  # logarithm of the variance
    return Kind(
        joints=len(grown),
        basis=basis,
        shapes=shapes,
        scatter=math.exp(0.5 * float(np.median(least))),
        worth=2.0 / _one_more(least, float(np.mean(2.0 / worth)), _DIFFER),
        tie=float(np.clip(np.median(ties), 0.0, 0.8)),
        tie_worth=1.0 / _one_more(ties, float(np.mean(1.0 / counts)), _TIES_DIFFER),
    )


def _one_more(shown: Floats, error: float, least: float) -> float:
    """Return the variance of one more joint's number about the median of those that were shown.

    `error` is the variance that each is known with; so few joints know how they differ only
    roughly (Student's variance for their degrees of freedom).
    """
    n = shown.size
    spread = _MAD_TO_SIGMA * float(np.median(np.abs(shown - np.median(shown))))
    between = max(spread**2 - error, 0.0) + least
    return between * (n + 1.0) / n * (n - 1.0) / (n - 3.0)


def _seen(features: Features, time_s: Floats, basis: Basis, decay_k: float, name: str) -> _Seen:
    """Return what one joint's cycles say of the coefficients, level and drift taken out."""
    y = features.values[name]
    time = (time_s - time_s[0]) / max(float(time_s[-1] - time_s[0]), 1.0)
    still = np.stack((np.ones_like(y), time), axis=-1)
    columns = basis.columns(features.conditions, decay_k)
    kept = np.ones(y.size, dtype=np.bool_)
    for _ in range(2):
        both = np.hstack((still, columns))
        fit = np.linalg.lstsq(both[kept], y[kept], rcond=None)[0]
        left = y - both @ fit
        robust = 1.4826 * float(np.median(np.abs(left[kept])))
        kept = np.abs(left) <= _OUTLIER * max(robust, np.finfo(float).tiny)
    level = float(np.mean(y[kept] - columns[kept] @ fit[2:]))
    own, share = still[kept], y[kept] / level
    apart = columns[kept] - own @ np.linalg.lstsq(own, columns[kept], rcond=None)[0]
    residual = left[kept] / level
    tie = float(np.clip(shown_tie(residual - residual.mean()), -0.5, 0.8))
    long_run = max(1.0, (1.0 + tie) / (1.0 - tie))
    variance = long_run * float(residual @ residual) / max(residual.size - both.shape[1], 1)
    return _Seen(apart.T @ apart / variance, apart.T @ share / variance, residual, tie)


def _between(seen: Sequence[_Seen], basis: Basis, prior: Prior) -> tuple[Floats, Floats]:
    """Return middle (p,) and covariance (p, p) of one more joint's coefficients."""
    middle, width = basis.prior(prior)
    covariance = np.diag(width**2)
    stiffness = np.stack([one.stiffness for one in seen])
    pull = np.stack([one.pull for one in seen])
    n = len(seen)
    weight = np.ones(n)
    for _ in range(_STEPS):
        held = np.linalg.inv(covariance)
        open_ = np.linalg.inv(stiffness + held)
        each = np.einsum("jab,jb->ja", open_, pull + held @ middle)
        middle = weight @ each / np.sum(weight)
        away = each - middle
        far = np.einsum("ja,ab,jb->j", away, held, away) + np.einsum("jab,ab->j", open_, held)
        weight = (_TAIL + width.size) / (_TAIL + far)
        covariance = np.mean(open_, axis=0) + (away.T * weight) @ away / n
    spread = (n + 1.0) / (n - 3.0)  # Student's, and the mean's own error
    wide = 1.0 / width**2
    return middle, np.linalg.inv(np.linalg.inv(spread * covariance) + np.diag(wide))
