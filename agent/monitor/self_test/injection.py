"""A known friction rise, put into a recording's torque: what the monitor must catch.

Friction opposes motion, so a rise r(|v|) adds ``sign(v) r(|v|)`` to the torque that the drive
reports. Two shapes: a Coulomb rise, the same at every speed, and the rise that wear makes, which is
concentrated at low speed (thesis, Figure 5.9: below 100 of some 300 rad/s).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import mean_rows
from agent.monitor.detection.series import FEATURES
from agent.monitor.history.features import CycleFeatures, SpeedGrid
from agent.physics.friction import boundary_share

COULOMB, LOW_SPEED = "coulomb", "low-speed"
SHAPES: Mapping[str, str] = MappingProxyType(
    {
        COULOMB: "a rise at every speed alike",
        LOW_SPEED: "a rise concentrated at low speed, as wear makes it",
    }
)
_FADED = 1.67  # the low-speed shape has fallen to 6 % where the low-speed part of the curve ends
_HARDLY = 0.01  # of a feature: smaller answers are drowned in rounding and noise


@dataclass(frozen=True)
class FrictionRise:
    """A rise of friction, 0 or more at every speed.

    Parameters
    ----------
    shape : str
        One of `SHAPES`.
    size_nm : float
        At standstill.
    fades_rad_s : float
        Where the low-speed shape ``exp(-(v / fades)^2)`` has fallen to 1/e.

    Raises
    ------
    ValueError
        Another shape, a size below zero or a speed that is not above it.
    """

    shape: str
    size_nm: float
    fades_rad_s: float

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise ValueError(f"expected one of {', '.join(SHAPES)}, got {self.shape!r}")
        if not (self.size_nm >= 0.0 and self.fades_rad_s > 0.0):
            raise ValueError(
                f"expected a size of 0 or more that fades at a speed above 0, got {self.size_nm} "
                f"and {self.fades_rad_s}"
            )

    def torque_nm(self, speed_rad_s: Floats) -> Floats:
        """Return the rise at speeds of 0 or more, shape (n,)."""
        if self.shape == COULOMB:
            return np.full(speed_rad_s.shape, self.size_nm)
        return self.size_nm * boundary_share(speed_rad_s, self.fades_rad_s, 2.0)


def rise_of(shape: str, low_mean_nm: float, grid: SpeedGrid) -> FrictionRise:
    """Return the rise whose mean over the low-speed part of the grid is `low_mean_nm`.

    Both shapes are measured alike in this way: as a share of low-speed friction.
    """
    unit = FrictionRise(shape, 1.0, grid.low_rad_s / _FADED)
    mean = float(mean_rows(grid)["low"] @ unit.torque_nm(grid.speed_rad_s))
    return replace(unit, size_nm=low_mean_nm / mean)


def added_torque_nm(
    rise: FrictionRise,
    time_s: Floats,
    velocity_rad_s: Floats | None,
    position_rad: Floats | None = None,
) -> Floats:
    """Return what a rise adds to the torque of a recording, shape (n,); 0 where nothing is known.

    Parameters
    ----------
    rise : FrictionRise
    time_s : ndarray, shape (n,)
    velocity_rad_s : ndarray, shape (n,), optional
        As recorded; without it, the position's difference.
    position_rad : ndarray, shape (n,), optional

    Raises
    ------
    ValueError
        Neither velocity nor position is given.
    """
    velocity = velocity_rad_s
    if velocity is None:
        if position_rad is None:
            raise ValueError("expected a velocity or a position, got neither")
        velocity = np.gradient(position_rad, time_s)
    added = np.sign(velocity) * rise.torque_nm(np.abs(velocity))
    return np.where(np.isfinite(added), added, 0.0)


def responses(
    before: Sequence[CycleFeatures],
    after: Sequence[CycleFeatures],
    rise: FrictionRise,
    grid: SpeedGrid,
) -> dict[str, float]:
    """Return how features really answered to an injected rise, as a share of the computed answer.

    Features are linear in the curve's friction, so that a rise should add its own features; what
    estimating the injected recordings anew makes of it says whether it does. The least of the
    shares, so that nothing is promised that one of the recordings did not show; a feature that
    the rise hardly touches counts as answering fully.

    Parameters
    ----------
    before, after : sequence of CycleFeatures
        Of the recordings as they are and with the rise in their torque.
    rise : FrictionRise
    grid : SpeedGrid
    """
    added = grid.rows() @ rise.torque_nm(grid.speed_rad_s)
    out = {}
    for name, computed in zip(FEATURES, added.tolist(), strict=True):
        pairs = list(zip(before, after, strict=True))
        level = float(np.mean([abs(b.values[name]) for b in before]))
        if abs(computed) < _HARDLY * level:
            out[name] = 1.0
            continue
        out[name] = min((a.values[name] - b.values[name]) / computed for b, a in pairs)
    return out
