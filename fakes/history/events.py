"""What happens to a joint over the months: wear, an oil change, a gearbox swap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fakes.checks import require_finite, require_not_negative, require_positive


@dataclass(frozen=True)
class Wear:
    """Friction that grows with use, above all at low speed (thesis, Figures 5.8 and 5.9).

    At speed v, `age` days after the onset, friction has risen by
    ``(age / days)^power (low_speed_nm exp(-(v / speed_rad_s)^2) + everywhere_nm)``.

    Parameters
    ----------
    onset_day, days : float
        When it begins, in days from the first cycle, and how long until it has grown to its size.
    low_speed_nm, everywhere_nm : float
        Rise at low speed alone, and at every speed.
    speed_rad_s : float
        Where the low-speed part has fallen to 1/e; 60 leaves 6 % of it at 100 rad/s, the speed
        below which the thesis saw its gearbox wear.
    power : float
        1 grows evenly; more begins gently and ends fast.
    """

    onset_day: float
    days: float = 60.0
    low_speed_nm: float = 0.3
    everywhere_nm: float = 0.0
    speed_rad_s: float = 60.0
    power: float = 1.0

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(self, "days", "speed_rad_s", "power")
        require_not_negative(self, "low_speed_nm", "everywhere_nm")

    def rise_nm(self, day: float, speed_rad_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rise at each speed (0 or more), shape (n,), on a day; it goes on growing."""
        grown = (max(day - self.onset_day, 0.0) / self.days) ** self.power
        low = self.low_speed_nm * np.exp(-((speed_rad_s / self.speed_rad_s) ** 2))
        return np.asarray(grown * (low + self.everywhere_nm), dtype=np.float64)


@dataclass(frozen=True)
class OilChange:
    """Fresh oil from a day on, with `viscous_factor` times the viscous friction of the first."""

    day: float
    viscous_factor: float = 1.2
    oil: str = "oil-2"

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(self, "viscous_factor")


@dataclass(frozen=True)
class Swap:
    """Another gearbox from a day on: other friction, no wear, another serial number."""

    day: float
    coulomb_factor: float = 0.9
    viscous_factor: float = 1.1
    gearbox_serial: str = "G-0002"

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(self, "coulomb_factor", "viscous_factor")
