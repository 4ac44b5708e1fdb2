"""What a motion would let its estimates see: expected covariance before anything moves.

Two fits follow a recording. The friction law is fitted to the friction curve, whose points count
alike: with the law's sensitivities ``X`` at the speeds and the points' variances ``V``, the
covariance is ``(X'X)^-1 X'VX (X'X)^-1``. The rigid body is regressed on every moving sample: the
covariance is ``S (integral r r' dt)^-1`` with the regressor ``r`` and the noise's density ``S``.
Noise that forgets faster than a ramp or a dwell lasts counts by its density at frequency zero
(Box and Jenkins, Time Series Analysis, section 2.1), be it white or coloured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from trajectories.checks import TrajectoryError, not_negative, positive
from trajectories.trajectory import Trajectory

Floats = NDArray[np.float64]
Sensitivity = Callable[[Floats], Floats]

BODY_PARAMETERS = ("inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm", "torque_offset_nm")
NORMAL_975 = 1.959963984540054
NORMAL_80 = 0.8416212335729143
SAME_SPEED = 0.035
"""Speeds that differ by less, relatively, are one point of the friction curve."""

_KEPT = 0.88  # of a dwell: an estimator leaves a tenth out after the ramp and a little before
_SAMPLE_S = 0.01
_INFLATION = 1000.0  # beyond, the rigid body's estimator refuses to tell columns apart
_SINGULAR = 1e8  # beyond, rounding would make up the friction law's intervals


@dataclass(frozen=True)
class TorqueNoise:
    """What the torque signal carries besides the joint: white noise and exponentially coloured.

    Parameters
    ----------
    white_nm, coloured_nm : float
        Standard deviations of one sample.
    correlation_s : float
        Over which the coloured part's autocorrelation falls to 1/e.
    sample_rate_hz : float
        Of the recording.
    """

    white_nm: float
    coloured_nm: float
    correlation_s: float
    sample_rate_hz: float

    def __post_init__(self) -> None:
        for name in ("white_nm", "coloured_nm", "correlation_s"):
            not_negative(name, getattr(self, name))
        positive("sample_rate_hz", self.sample_rate_hz)
        if self.density_nm2_s <= 0.0:
            raise TrajectoryError("without any torque noise every motion is as good as another")

    @property
    def density_nm2_s(self) -> float:
        """Density S at frequency zero: a mean over a long time T has the variance S/T."""
        return (
            self.white_nm**2 / self.sample_rate_hz + 2.0 * self.coloured_nm**2 * self.correlation_s
        )


@dataclass(frozen=True)
class Belief:
    """What is thought of a joint before it has been measured.

    Parameters
    ----------
    friction_names : tuple of str
        Parameters of the friction law.
    friction_scales : tuple of float
        Size that each is thought to have, above zero.
    friction : tuple of callable
        One for every member of the prior, the nominal one first: speeds (n,), rad/s, to the
        friction torque's derivatives (n, p) by the parameters, N m per unit.
    inertia_kg_m2, gravity_nm : float
        Sizes of the rigid body's parameters, motor side, above zero.
    gear_ratio : float
        Motor turns per arm turn.
    """

    friction_names: tuple[str, ...]
    friction_scales: tuple[float, ...]
    friction: tuple[Sensitivity, ...]
    inertia_kg_m2: float
    gravity_nm: float
    gear_ratio: float

    def __post_init__(self) -> None:
        if not self.friction_names or len(self.friction_names) != len(self.friction_scales):
            raise TrajectoryError(
                f"every friction parameter needs a size: got {len(self.friction_names)} names and "
                f"{len(self.friction_scales)} sizes"
            )
        if not self.friction:
            raise TrajectoryError("a belief needs at least one member of the prior")
        for name, scale in zip(self.friction_names, self.friction_scales, strict=True):
            positive(f"size of {name}", scale)
        for name in ("inertia_kg_m2", "gravity_nm", "gear_ratio"):
            positive(name, getattr(self, name))

    @property
    def body_scales(self) -> Floats:
        """Sizes in the order of `BODY_PARAMETERS`, shape (4,)."""
        return np.array([self.inertia_kg_m2, self.gravity_nm, self.gravity_nm, self.gravity_nm])

    def columns(self, speed_rad_s: Floats) -> Floats:
        """Return scaled sensitivities of all members, shape (members, n, p), N m."""
        scales = np.asarray(self.friction_scales)
        return np.stack([member(speed_rad_s) * scales for member in self.friction])


@dataclass(frozen=True)
class Expectation:
    """What one run of a motion is expected to tell, for the nominal joint.

    Parameters
    ----------
    speed_rad_s, point_error_nm : ndarray, shape (n,)
        The friction curve's points and their standard errors.
    half_widths : mapping of str to float
        Half of the expected 95 % interval; infinite where the motion does not carry it.
    """

    speed_rad_s: Floats
    point_error_nm: Floats
    half_widths: Mapping[str, float]

    @property
    def level_error_nm(self) -> float:
        """Standard error of the friction's level: the mean over all points of the curve."""
        n = self.point_error_nm.size
        return float(np.sqrt(np.sum(self.point_error_nm**2))) / n if n else math.inf

    @property
    def visible_rise_nm(self) -> float:
        """Smallest rise of friction at all speeds alike that two runs show.

        At 5 % false alarms (two-sided) four of five such rises are seen:
        ``(1.96 + 0.84) sqrt(2)`` standard errors of the level.
        """
        return (NORMAL_975 + NORMAL_80) * math.sqrt(2.0) * self.level_error_nm

    @property
    def visible_rise_at_one_speed_nm(self) -> float:
        """The same for a rise that only the least certain point of the curve shows."""
        if not self.point_error_nm.size:
            return math.inf
        return (NORMAL_975 + NORMAL_80) * math.sqrt(2.0) * float(self.point_error_nm.max())


def usable_s(dwell_s: Floats | float, settle_s: float) -> Floats:
    """Return how much of a dwell is evaluated: less what settles, less a tenth."""
    return np.maximum(_KEPT * (np.asarray(dwell_s, dtype=np.float64) - settle_s), 0.0)


def friction_information(columns: Floats, variance: Floats) -> Floats:
    """Return ``X'X (X'VX)^-1 X'X``: the inverse covariance of a fit whose points count alike.

    Parameters
    ----------
    columns : ndarray, shape (members, n, p)
        Scaled sensitivities.
    variance : ndarray, shape (n,)
        Of the points.

    Returns
    -------
    ndarray, shape (members, p, p)
        Written as ``R'(Q'VQ)^-1 R`` with ``X = QR``, which stays finite where columns are nearly
        parallel.
    """
    basis, triangle = np.linalg.qr(columns)
    spread = np.swapaxes(basis, -1, -2) @ (variance[:, np.newaxis] * basis)
    out = np.swapaxes(triangle, -1, -2) @ np.linalg.solve(spread, triangle)
    return np.asarray(out, dtype=np.float64)


def expect(
    trajectory: Trajectory, belief: Belief, noise: TorqueNoise, *, settle_s: float = 0.2
) -> Expectation:
    """Return what one run of any trajectory is expected to tell.

    Parameters
    ----------
    trajectory : Trajectory
        With steady windows in both directions at each speed that is to count.
    belief : Belief
        The nominal joint is its first member.
    noise : TorqueNoise
    settle_s : float
        Lost at the start of every steady window.
    """
    speed, variance = curve_points(trajectory, noise, settle_s)
    half: dict[str, float] = dict.fromkeys((*belief.friction_names, *BODY_PARAMETERS), math.inf)
    if speed.size >= len(belief.friction_names):
        columns = belief.columns(speed)[:1]
        if _apart(columns[0], _SINGULAR):
            covariance = np.linalg.inv(friction_information(columns, variance)[0])
            error = np.sqrt(np.diag(covariance)) * np.asarray(belief.friction_scales)
            half |= dict(zip(belief.friction_names, (NORMAL_975 * error).tolist(), strict=True))
    half |= _body_half_widths(trajectory, belief, noise)
    return Expectation(speed, np.sqrt(variance), MappingProxyType(half))


def curve_points(
    trajectory: Trajectory, noise: TorqueNoise, settle_s: float
) -> tuple[Floats, Floats]:
    """Return the speeds held in both directions, shape (n,), and their friction's variances.

    A speed's friction is half the difference of its mean torques, each over all its dwells.
    """
    held: list[float] = []
    seen_s: list[list[float]] = []  # forward and backward
    for window in sorted(trajectory.steady_windows(), key=lambda w: abs(w.velocity_rad_s)):
        speed = abs(window.velocity_rad_s)
        if not held or speed - held[-1] > SAME_SPEED * held[-1]:
            held.append(speed)
            seen_s.append([0.0, 0.0])
        side = 0 if window.velocity_rad_s > 0.0 else 1
        seen_s[-1][side] += float(usable_s(window.end_s - window.start_s, settle_s))
    found = [
        (speed, 0.25 * noise.density_nm2_s * (1.0 / ahead_s + 1.0 / back_s))
        for speed, (ahead_s, back_s) in zip(held, seen_s, strict=True)
        if ahead_s > 0.0 and back_s > 0.0
    ]
    if not found:
        return np.zeros(0), np.zeros(0)
    speeds, variances = zip(*found, strict=True)
    return np.array(speeds), np.array(variances)


def _body_half_widths(
    trajectory: Trajectory, belief: Belief, noise: TorqueNoise
) -> dict[str, float]:
    """Return half of the expected intervals of `BODY_PARAMETERS`, friction fitted along."""
    count = max(math.ceil(trajectory.duration_s / _SAMPLE_S), 1)
    step_s = trajectory.duration_s / count
    motion = trajectory.sample((np.arange(count) + 0.5) * step_s)
    moving = motion.velocity_rad_s != 0.0
    arm = motion.position_rad[moving] / belief.gear_ratio
    velocity = motion.velocity_rad_s[moving]
    columns = np.column_stack(
        (
            motion.acceleration_rad_s2[moving],
            np.sin(arm),
            np.cos(arm),
            np.ones_like(arm),
            velocity,
            np.sign(velocity),
        )
    )
    if columns.shape[0] < columns.shape[1]:
        return dict.fromkeys(BODY_PARAMETERS, math.inf)
    kept = [0, 1, 2, 3, 4, 5] if _apart(columns) else [0, 3, 4, 5]
    if not _apart(columns[:, kept]):
        return dict.fromkeys(BODY_PARAMETERS, math.inf)
    size = np.sqrt(np.sum(columns[:, kept] ** 2, axis=0))
    unit = columns[:, kept] / size
    variance = np.diag(np.linalg.inv(unit.T @ unit)) / size**2 * noise.density_nm2_s / step_s
    half = dict.fromkeys(BODY_PARAMETERS, math.inf)
    for k, value in zip(kept, (NORMAL_975 * np.sqrt(variance)).tolist(), strict=True):
        if k < len(BODY_PARAMETERS):
            half[BODY_PARAMETERS[k]] = value
    return half


def _apart(columns: Floats, limit: float = _INFLATION) -> bool:
    """Tell whether no parameter's variance grows beyond a limit because columns are alike."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    if not np.all(size > 0.0):
        return False
    unit = columns / size
    values, vectors = np.linalg.eigh(unit.T @ unit)
    inflation = vectors**2 @ (1.0 / np.maximum(values, 1e-13))
    return bool(inflation.max() <= limit)
