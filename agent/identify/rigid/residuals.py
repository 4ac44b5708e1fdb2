"""What the rigid body leaves unexplained: correlations with bands, and in words (thesis 4.1.2).

The residual (4.6) of low-passed signals is smooth by construction. It is therefore looked at once
in half a period of the cutoff, where white noise would have left nothing correlated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats, RigidBodyFit
from agent.identify.rigid.body import weights
from agent.identify.signals.preprocess import FilteredStretch
from agent.physics.rigid_body import PARAMETERS

_ACCELERATION = PARAMETERS.index("inertia_kg_m2")
_VELOCITY = PARAMETERS.index("viscous_nm_s_per_rad")
_BAND_SIGMAS = 2.5758  # 99 % of white noise's correlations lie inside
_EXPECTED_OUTSIDE = 0.01
_CLASSES = 12
_TELLING = 0.1  # share of the residual's energy that is worth a sentence
_FEWEST = 40


@dataclass(frozen=True)
class Residual:
    """The residual once in half a period of the cutoff; n samples of evenly spaced time.

    Parameters
    ----------
    residual_nm : ndarray, shape (n,)
        Measured less predicted torque; NaN where the two are not compared, and one NaN between
        stretches that do not join.
    velocity_rad_s, acceleration_rad_s2 : ndarray, shape (n,)
        The motion there; NaN likewise.
    period_s : float
        Between samples.
    """

    residual_nm: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    period_s: float


@dataclass(frozen=True)
class Correlation:
    """Normalised correlations of a residual, with bands that 99 % of chance stays inside.

    Parameters
    ----------
    lag_s : ndarray, shape (k,)
        From 0 up.
    auto : ndarray, shape (k,)
        Of the residual with itself; 1 at lag 0.
    auto_band : ndarray, shape (k,)
        Half-width for a white residual: 2.58/sqrt(pairs).
    cross_lag_s : ndarray, shape (2k - 1,)
        Negative where the residual comes before the velocity.
    cross : ndarray, shape (2k - 1,)
        Of velocity and residual: ``r(m) = mean v[t] e[t+m]``, normalised.
    cross_band : ndarray, shape (2k - 1,)
        Half-width for a residual that is coloured as this one, but independent of the velocity
        (Ljung, System Identification, 1999, equation 16.57).
    """

    lag_s: Floats
    auto: Floats
    auto_band: Floats
    cross_lag_s: Floats
    cross: Floats
    cross_band: Floats

    @property
    def auto_outside(self) -> float:
        """Return the share of lags above 0 at which the residual remembers itself."""
        return float(np.mean(np.abs(self.auto[1:]) > self.auto_band[1:]))

    @property
    def cross_outside(self) -> float:
        """Return the share of lags at which the residual follows, or foretells, the velocity."""
        return float(np.mean(np.abs(self.cross) > self.cross_band))


def residual_of(
    stretches: Sequence[FilteredStretch], fit: RigidBodyFit, cutoff_hz: float
) -> Residual:
    """Return what a fit leaves of the stretches' torque.

    Parameters
    ----------
    stretches : sequence of FilteredStretch
        Of one or more recordings, low-passed at `cutoff_hz`.
    fit : RigidBodyFit
        Seen or unseen: a reversed run makes the better judge.
    cutoff_hz : float
        Of the low-pass.
    """
    theta = weights(fit)
    parts: list[Floats] = []
    period_s = 0.5 / cutoff_hz
    for s in stretches:
        step = max(round(0.5 / cutoff_hz / s.stretch.period_s), 1)
        rows = np.column_stack((s.torque_nm - s.regressor @ theta, s.regressor[:, :2]))
        rows[~s.usable] = np.nan
        parts += [rows[::step], np.full((1, 3), np.nan)]
        period_s = step * s.stretch.period_s
    whole = np.concatenate(parts) if parts else np.zeros((0, 3))
    return Residual(whole[:, 0], whole[:, 1 + _VELOCITY], whole[:, 1 + _ACCELERATION], period_s)


def correlate(residual: Residual, lags: int = 30) -> Correlation:
    """Return auto- and cross-correlation up to so many lags (Figure 4.3).

    Pairs with a masked end are left out, and the bands count the pairs that are there.

    Raises
    ------
    ValueError
        Fewer than 40 samples, or a residual or velocity that never changes.
    """
    known = np.isfinite(residual.residual_nm)
    count = int(np.count_nonzero(known))
    if count < _FEWEST:
        raise ValueError(f"expected at least {_FEWEST} samples of the residual, got {count}")
    lags = min(lags, count // 4)
    error = _normalised(residual.residual_nm, known)
    velocity = _normalised(residual.velocity_rad_s, known)
    auto, pairs = _products(error, error, known, lags)
    backward, before = _products(error, velocity, known, lags)
    forward, after = _products(velocity, error, known, lags)
    own, _ = _products(velocity, velocity, known, lags)
    # Coloured and independent: var r(m) = sum over lags of the two autocorrelations / pairs.
    colour = max(1.0 + 2.0 * float(np.sum(auto[1:] * own[1:])), 0.0)
    cross_pairs = np.concatenate((before[:0:-1], after))
    lag_s = residual.period_s * np.arange(lags + 1, dtype=np.float64)
    return Correlation(
        lag_s=lag_s,
        auto=auto,
        auto_band=_BAND_SIGMAS / np.sqrt(np.maximum(pairs, 1)),
        cross_lag_s=np.concatenate((-lag_s[:0:-1], lag_s)),
        cross=np.concatenate((backward[:0:-1], forward)),
        cross_band=_BAND_SIGMAS * np.sqrt(colour / np.maximum(cross_pairs, 1)),
    )


def residual_in_words(residual: Residual, correlation: Correlation) -> tuple[str, ...]:
    """Say what the residual tells about the model, one sentence for each finding."""
    known = np.isfinite(residual.residual_nm)
    error = residual.residual_nm[known]
    velocity, acceleration = residual.velocity_rad_s[known], residual.acceleration_rad_s2[known]
    found = [_memory_in_words(correlation)]
    by_velocity = explained_share(velocity, error)
    if by_velocity > _TELLING:
        found.append(
            f"{100 * by_velocity:.0f} % of its energy depends on the velocity alone: friction "
            "that Coulomb and viscous friction do not describe"
        )
    by_acceleration = explained_share(acceleration, error)
    if by_acceleration > _TELLING:
        found.append(
            f"{100 * by_acceleration:.0f} % of its energy depends on the acceleration alone: an "
            "inertia that is not constant in the band, or saturation"
        )
    growth = _growth(acceleration, error)
    if growth > 2.0:
        found.append(
            f"it is {growth:.1f} times as large in the most accelerated tenth of the samples as "
            "in the calmest half: the arm is flexible, or the direction changes there"
        )
    outside = correlation.cross_outside
    if outside > 3.0 * _EXPECTED_OUTSIDE:
        found.append(
            f"it is correlated with the velocity at {100 * outside:.0f} % of the lags: the motion "
            "still carries torque that the model lacks"
        )
    else:
        found.append("it is uncorrelated with the velocity, as far as these data can tell")
    return tuple(f"{text[0].upper()}{text[1:]}." for text in found)


def explained_share(variable: Floats, residual_nm: Floats) -> float:
    """Return the share of a residual's energy that a curve over one variable carries, 0 to 1.

    Means over classes of equally many samples, corrected for what as many classes of pure chance
    would carry; negative chance is 0.

    Parameters
    ----------
    variable, residual_nm : ndarray, shape (n,)
        Finite.
    """
    count = residual_nm.size
    classes = min(_CLASSES, count // 10)
    energy = float(np.sum(residual_nm**2))
    if classes < 2 or energy == 0.0:
        return 0.0
    parts = np.array_split(residual_nm[np.argsort(variable, kind="stable")], classes)
    carried = sum(float(p.mean()) ** 2 * p.size for p in parts) / energy
    return max((carried - classes / count) / (1.0 - classes / count), 0.0)


def _memory_in_words(correlation: Correlation) -> str:
    """Say how long the residual remembers itself."""
    if correlation.auto_outside <= 3.0 * _EXPECTED_OUTSIDE:
        return "the residual is white above the filter's own memory: noise, no missing dynamics"
    beyond = np.abs(correlation.auto[1:]) - correlation.auto_band[1:]
    most = int(np.argmax(beyond)) + 1
    return (
        f"the residual is correlated with itself, most ({correlation.auto[most]:+.2f}) at a lag of "
        f"{correlation.lag_s[most]:.2g} s: feedback, ringing, or torque that the cycle repeats"
    )


def _growth(acceleration: Floats, error: Floats) -> float:
    """Return the residual's size in fast changes against that in calm motion."""
    size = np.abs(acceleration)
    calm = error[size <= np.quantile(size, 0.5)]
    fast = error[size >= np.quantile(size, 0.9)]
    below = float(np.sqrt(np.mean(calm**2)))
    return float(np.sqrt(np.mean(fast**2))) / below if below > 0.0 else 0.0


def _normalised(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """Return the values less their mean over their deviation, 0 where they are not known."""
    deviation = float(np.std(values[known]))
    if deviation == 0.0:
        raise ValueError("expected a residual and a velocity that change, got a constant")
    return np.where(known, (values - np.mean(values[known])) / deviation, 0.0)


def _products(
    first: Floats, later: Floats, known: NDArray[np.bool_], lags: int
) -> tuple[Floats, NDArray[np.int64]]:
    """Return ``mean first[t] later[t+m]`` for m = 0..lags, and how many pairs each has."""
    ends = first.shape[0]
    there = known.astype(np.int64)
    pairs = np.array([int(there[: ends - m] @ there[m:]) for m in range(lags + 1)], dtype=np.int64)
    sums = np.array([float(first[: ends - m] @ later[m:]) for m in range(lags + 1)])
    return sums / np.maximum(pairs, 1), pairs
