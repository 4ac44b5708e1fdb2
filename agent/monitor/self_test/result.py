"""What a self-test is given, and what it says of caught rises and false alarms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.history.features import SpeedGrid
from agent.monitor.history.table import Features

CAUGHT = 0.95
"""Of the replays: what counts as caught."""


@dataclass(frozen=True)
class Healthy:
    """A joint's healthy cycles in order of time.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    features : Features
        Of the n cycles.
    grid : SpeedGrid
    """

    time_s: Floats
    features: Features
    grid: SpeedGrid

    @property
    def low_mean_nm(self) -> float:
        """Return the healthy friction, averaged over the low-speed part of the curve."""
        width = float(self.grid.low_row().sum())
        return float(np.mean(self.features.values["low_integral_w"])) / width

    @property
    def interval_s(self) -> float:
        """Return the usual time from cycle to cycle."""
        return float(np.median(np.diff(self.time_s)))


@dataclass(frozen=True)
class Catch:
    """What is caught of one shape of rise.

    Parameters
    ----------
    shape : str
    smallest_percent : float
        Of low-speed friction, caught with 95 %; NaN where no rise up to 200 % is.
    ci95_percent : tuple of float
        Its interval; an end is infinite where the replays do not bound it.
    smallest_nm : float
        The same, as torque averaged over the low speeds.
    stated_percent : float
        The rise that was asked about.
    caught_share : float
        Of the replays that catch it in time.
    ci95_share : tuple of float
        Wilson's interval of that share.
    delay_cycles : float
        Median from the rise to the alarm among those that catch it; NaN without any.
    """

    shape: str
    smallest_percent: float
    ci95_percent: tuple[float, float]
    smallest_nm: float
    stated_percent: float
    caught_share: float
    ci95_share: tuple[float, float]
    delay_cycles: float

    @property
    def caught(self) -> bool:
        """Tell whether the stated rise is caught with 95 %."""
        return self.caught_share >= CAUGHT


@dataclass(frozen=True)
class FalseAlarms:
    """Alarms of the replays without any rise.

    `per_year` at the history's own rate of cycles, with the exact interval of a Poisson count.
    """

    alarms: int
    cycles: int
    per_year: float
    ci95_per_year: tuple[float, float]


@dataclass(frozen=True)
class SelfTest:
    """What the monitor's chain catches of one joint, on replays of its own cycles.

    `reason` says why nothing is decidable; empty where something is.
    """

    reason: str
    cycles: int
    baseline: int
    replays: int
    within: int
    block: int
    catches: tuple[Catch, ...] = ()
    false_alarms: FalseAlarms | None = None

    @property
    def passed(self) -> bool:
        """Tell whether every shape of the stated rise is caught; False where not decidable."""
        return not self.reason and all(c.caught for c in self.catches)
