"""The four features of thesis 6.2.1 from a friction curve, the same way for every cycle.

Every feature is linear in the friction at the speeds of one grid, which all cycles of a history
share: the curve is brought onto the grid by straight lines between its points, and the points'
deviations are carried along.

- Coulomb and viscous friction: the plain law fitted to the grid's speeds by least squares
  (thesis 4.4.3). Where the cycle has just the grid's speeds, that is the estimate's own fit.
- The integral of the curve over velocity: the trapezoidal rule from the slowest to the fastest
  speed of the grid, in N m rad/s = W. It begins at the slowest speed measured, not at zero.
- Its low-speed part: the same up to `low_rad_s`, by default a third of the fastest speed, as
  the 100 of some 300 rad/s of Figure 5.9.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.detection.series import FEATURES
from agent.monitor.history.cycle import CycleCurve

LOW_SHARE = 1.0 / 3.0
_BEYOND = 0.04  # of the grid's end: so far a straight line may be led on
_FEWEST = 3
_NORMAL_975 = 1.959963984540054


@dataclass(frozen=True)
class SpeedGrid:
    """The speeds at which all cycles of a history are compared.

    Parameters
    ----------
    speed_rad_s : ndarray, shape (m,)
        Rising; from the slowest to the fastest speed that the cycles have in common.
    low_rad_s : float
        Where the low-speed part ends; inside the range.

    Raises
    ------
    ValueError
        Fewer than three speeds, or a bound outside of them.
    """

    speed_rad_s: Floats
    low_rad_s: float

    def __post_init__(self) -> None:
        speed = self.speed_rad_s
        if speed.size < _FEWEST or np.any(np.diff(speed) <= 0.0):
            raise ValueError(f"expected {_FEWEST} rising speeds or more, got {speed.tolist()}")
        if not speed[0] < self.low_rad_s < speed[-1]:
            raise ValueError(
                f"the low-speed part must end between {speed[0]:.3g} and {speed[-1]:.3g} rad/s, "
                f"got {self.low_rad_s:.3g}"
            )

    def covered_by(self, curve: CycleCurve) -> bool:
        """Tell whether a curve reaches from the grid's slowest to its fastest speed."""
        slowest, fastest = float(self.speed_rad_s[0]), float(self.speed_rad_s[-1])
        return bool(
            curve.speed_rad_s[0] <= slowest * (1.0 + _BEYOND)
            and curve.speed_rad_s[-1] >= fastest * (1.0 - _BEYOND)
        )

    def rows(self) -> Floats:
        """Return what the friction on the grid is multiplied with, shape (4, m), as `FEATURES`."""
        speed = self.speed_rad_s
        law = np.column_stack((np.ones_like(speed), speed))
        coulomb, viscous = np.linalg.pinv(law)
        return np.stack((coulomb, viscous, _trapezoid(speed, speed[-1]), self.low_row()))

    def low_row(self) -> Floats:
        """Return the weights of the low-speed integral, shape (m,)."""
        return _trapezoid(self.speed_rad_s, self.low_rad_s)

    def high_row(self) -> Floats:
        """Return the weights of the integral above the low-speed part, shape (m,)."""
        return _trapezoid(self.speed_rad_s, self.speed_rad_s[-1]) - self.low_row()


@dataclass(frozen=True)
class CycleFeatures:
    """One cycle's features with one standard deviation each, and its curve on the grid.

    `values` and `deviations` have the keys of `FEATURES`; `friction_nm` and `deviation_nm` the
    grid's shape (m,).
    """

    values: Mapping[str, float]
    deviations: Mapping[str, float]
    friction_nm: Floats
    deviation_nm: Floats

    def ci95(self, feature: str) -> tuple[float, float]:
        """Return the 95 % interval that the curve's points give a feature."""
        reach = _NORMAL_975 * self.deviations[feature]
        return self.values[feature] - reach, self.values[feature] + reach


def grid_of(curves: Sequence[CycleCurve], low_rad_s: float | None = None) -> SpeedGrid:
    """Return the grid that these curves have in common.

    The range is that of the middle curve (medians of slowest and fastest speed), so that one
    poor cycle does not narrow it; the speeds between are those of the curve nearest to it.

    Parameters
    ----------
    curves : sequence of CycleCurve
        At least one.
    low_rad_s : float, optional
        Where the low-speed part ends.

    Raises
    ------
    ValueError
        The curves have fewer than three speeds, or the bound lies outside of them.
    """
    ends = np.array([(c.speed_rad_s[0], c.speed_rad_s[-1]) for c in curves])
    slowest, fastest = np.median(ends, axis=0)
    nearest = curves[int(np.argmin(np.sum(np.abs(np.log(ends / (slowest, fastest))), axis=1)))]
    speed = nearest.speed_rad_s
    inside = speed[(speed > slowest * (1.0 + _BEYOND)) & (speed < fastest * (1.0 - _BEYOND))]
    grid = np.concatenate(([slowest], inside, [fastest]))
    return SpeedGrid(grid, LOW_SHARE * float(fastest) if low_rad_s is None else low_rad_s)


def features_of(curve: CycleCurve, grid: SpeedGrid) -> CycleFeatures:
    """Return the features of one cycle.

    Raises
    ------
    ValueError
        The curve does not cover the grid.
    """
    if not grid.covered_by(curve):
        raise ValueError(
            f"the curve reaches from {curve.speed_rad_s[0]:.3g} to {curve.speed_rad_s[-1]:.3g} "
            f"rad/s, the grid from {grid.speed_rad_s[0]:.3g} to {grid.speed_rad_s[-1]:.3g}"
        )
    onto = _interpolation(curve.speed_rad_s, grid.speed_rad_s)
    rows = grid.rows() @ onto
    variance = curve.deviation_nm**2
    values, deviations = rows @ curve.friction_nm, np.sqrt(rows**2 @ variance)
    return CycleFeatures(
        dict(zip(FEATURES, values.tolist(), strict=True)),
        dict(zip(FEATURES, deviations.tolist(), strict=True)),
        onto @ curve.friction_nm,
        np.sqrt(onto**2 @ variance),
    )


def _interpolation(at: Floats, wanted: Floats) -> Floats:
    """Return the matrix, shape (m, n), that reads straight lines between n points at m others.

    Beyond the ends the outermost line is led on.
    """
    left = np.clip(np.searchsorted(at, wanted, side="right") - 1, 0, at.size - 2)
    share = (wanted - at[left]) / (at[left + 1] - at[left])
    out = np.zeros((wanted.size, at.size))
    rows = np.arange(wanted.size)
    out[rows, left] = 1.0 - share
    out[rows, left + 1] += share
    return out


def _trapezoid(speed: Floats, upto: float) -> Floats:
    """Return the weights of the trapezoidal rule from the first speed to `upto`, shape (m,)."""
    nodes = np.append(speed[speed < upto], upto)
    widths = np.diff(nodes)
    weights = np.zeros(nodes.size)
    weights[:-1] += 0.5 * widths
    weights[1:] += 0.5 * widths
    return np.asarray(weights @ _interpolation(speed, nodes))
