"""How warm the hall and the gearbox are when the night's cycle is run."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fakes.checks import require_finite, require_not_negative, require_positive

DAY_S = 86_400.0
YEAR_S = 365.25 * DAY_S
COLDEST_DAY = 20.0  # of the year, in late January


@dataclass(frozen=True)
class Climate:
    """A hall over the seasons, and a gearbox that still carries some of its day's heat.

    Parameters
    ----------
    mean_degc, season_degc : float
        The hall's yearly mean at the hour of the cycle, and half of its swing over the year.
    weather_degc, weather_days : float
        Standard deviation of what the weather adds, and how long it remembers.
    work_degc : float
        How far above the hall the gearbox is when work ends.
    rest_h, rest_spread_h : float
        Hours from the end of work to the cycle, and their standard deviation: the night's chance.
    cooling_rate_per_s : float
        Newton's r; 6.2e-5 1/s is the mean of three oils (thesis, appendix A.1).
    """

    mean_degc: float = 24.0
    season_degc: float = 6.0
    weather_degc: float = 1.5
    weather_days: float = 3.0
    work_degc: float = 12.0
    rest_h: float = 4.0
    rest_spread_h: float = 1.0
    cooling_rate_per_s: float = 6.2e-5

    def __post_init__(self) -> None:
        require_finite(self)
        require_not_negative(self, "season_degc", "weather_degc", "work_degc", "rest_spread_h")
        require_positive(self, "weather_days", "rest_h", "cooling_rate_per_s")

    def ambient_degc(
        self, day: NDArray[np.float64], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return the hall's temperature at each time, shape (n,).

        Parameters
        ----------
        day : ndarray, shape (n,)
            Days since the first of January, rising.
        rng : Generator
            Draws the weather.
        """
        angle = 2.0 * math.pi * (day - COLDEST_DAY) * DAY_S / YEAR_S
        season = self.mean_degc - self.season_degc * np.cos(angle)
        weather = np.empty(day.size)
        chance = rng.standard_normal(day.size)
        held = 0.0
        for k in range(day.size):
            keep = 0.0 if k == 0 else math.exp(-(day[k] - day[k - 1]) / self.weather_days)
            held = keep * held + math.sqrt(1.0 - keep * keep) * chance[k]
            weather[k] = held
        return np.asarray(season + self.weather_degc * weather, dtype=np.float64)

    def gearbox_degc(
        self, ambient_degc: NDArray[np.float64], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return the gearbox's temperature when the cycle begins, shape (n,)."""
        chance = rng.standard_normal(ambient_degc.size)
        rest_s = 3600.0 * np.maximum(self.rest_h + self.rest_spread_h * chance, 0.25)
        warmth = self.work_degc * np.exp(-self.cooling_rate_per_s * rest_s)
        return np.asarray(ambient_degc + warmth, dtype=np.float64)
