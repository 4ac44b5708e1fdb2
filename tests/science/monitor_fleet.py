"""Simulated robots for the monitor: nights, seasons, payloads, noise, and what its chain says.

The features are those of `monitor_joint`'s curves; temperature follows season and weather between
15 and 45 degC, the payload is one of three tools. The chain is the product's own: features,
compensation learned from the healthy nights, detectors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import baseline_of, compensated, series_of
from agent.monitor.baseline.growth import watched
from agent.monitor.compensation.compensation import Conditions
from agent.monitor.detection.series import FEATURES, Detector, FeatureSeries, Judgement
from agent.monitor.history.table import Features
from tests.science.monitor_joint import DAY_S, GRID, Joint

PAYLOADS_KG = np.array([0.0, 40.0, 175.0])
STATED = 0.004
"""Deviation that a cycle states for its features, as a share: less than they really scatter."""


@dataclass(frozen=True)
class Life:
    """How one robot lives.

    Parameters
    ----------
    healthy, nights : int
        Of the baseline, and of all.
    noise : float
        By how much a night's whole curve differs from the last, as a share (one deviation).
    tilt : float
        By how much its low speeds do against its high ones.
    memory : float
        Correlation of neighbouring nights.
    bad : float
        Share of nights whose curve is off by tens of percent.
    missing : float
        Share of nights without a cycle.
    """

    healthy: int = 60
    nights: int = 425
    noise: float = 0.01
    tilt: float = 0.005
    memory: float = 0.2
    bad: float = 1.0 / 300.0
    missing: float = 0.05
    joint: Joint = field(default_factory=Joint)


@dataclass(frozen=True)
class Nights:
    """What one robot's nights brought: times in days, conditions, features (n, 4)."""

    day: Floats
    temperature_degc: Floats
    payload_kg: Floats
    features: Floats

    def raw(self, healthy: int) -> FeatureSeries:
        """Return the features as they came, without compensation."""
        values = dict(zip(FEATURES, self.features.T, strict=True))
        stated = {name: STATED * np.abs(v) for name, v in values.items()}
        return FeatureSeries(self.time_s, values, stated, healthy)

    def table(self) -> Features:
        """Return the features with their conditions."""
        raw, unknown = self.raw(1), np.full(self.day.size, np.nan)
        given = Conditions(self.temperature_degc, self.payload_kg, unknown)
        return Features(raw.values, raw.deviations, given)

    def compensated(self, healthy: int | None) -> FeatureSeries:
        """Return the features as the product gives them to its detectors.

        Parameters
        ----------
        healthy : int or None
            The baseline's length; None lets the product's rule choose.
        """
        table = self.table()
        baseline = baseline_of(table, healthy)
        return series_of(self.time_s, compensated(table, baseline), baseline)

    def judged(self, detector: Detector, healthy: int | None = None) -> tuple[int, Judgement]:
        """Return the baseline's last length and what the product says of each night.

        Parameters
        ----------
        detector : Detector
        healthy : int or None
            A baseline that is asked for; None: the product's own, which grows.
        """
        table = self.table()
        baseline, _, judged = watched(table, self.time_s, baseline_of(table, healthy), detector)
        return baseline.cycles, judged

    @property
    def time_s(self) -> Floats:
        """Return the nights on the series' clock, shape (n,)."""
        return np.asarray(DAY_S * (self.day - self.day[0]))


def temperatures(nights: int, rng: np.random.Generator) -> Floats:
    """Return the gearbox's temperature each night, 15 to 45 degC, shape (nights,)."""
    season = 30.0 + 10.0 * np.cos(2.0 * np.pi * (np.arange(nights) / 365.25 + rng.uniform()))
    return np.clip(season + 2.5 * correlated(nights, 0.7, rng), 15.0, 45.0)


def correlated(count: int, memory: float, rng: np.random.Generator) -> Floats:
    """Return normal numbers of deviation one whose neighbours are correlated, shape (count,)."""
    out = rng.standard_normal(count)
    for i in range(1, count):
        out[i] = memory * out[i - 1] + np.sqrt(1.0 - memory**2) * out[i]
    return out


def live(life: Life, seed: int, wear: Floats | None = None) -> Nights:
    """Return a robot's nights.

    Parameters
    ----------
    life : Life
    seed : int
    wear : ndarray, shape (nights,), optional
        As `Joint.curves` takes it; none for a healthy robot.
    """
    rng = np.random.default_rng(seed)
    n = life.nights
    temperature = temperatures(n, rng)
    payload = PAYLOADS_KG[rng.integers(0, PAYLOADS_KG.size, n)]
    curves = life.joint.curves(
        temperature, payload / PAYLOADS_KG[-1], np.zeros(n) if wear is None else wear
    )
    tilt = np.linspace(1.0, -1.0, curves.shape[1])
    curves = curves * (
        1.0
        + life.noise * correlated(n, life.memory, rng)[:, None]
        + life.tilt * correlated(n, life.memory, rng)[:, None] * tilt
        + 0.005 * rng.standard_normal(curves.shape)
    )
    off = rng.uniform(size=n) < life.bad
    curves[off] *= 1.0 + rng.choice((-1.0, 1.0), off.sum())[:, None] * rng.uniform(
        0.1, 0.4, (off.sum(), 1)
    )
    kept = rng.uniform(size=n) >= life.missing
    kept[: life.healthy] = True
    seen_degc = np.round(temperature + rng.normal(0.0, 0.3, n), 1)
    return Nights(
        np.flatnonzero(kept).astype(float),
        seen_degc[kept],
        payload[kept],
        (curves @ GRID.rows().T)[kept],
    )


def low_speed_share(joint: Joint) -> float:
    """Return the rise of the low-speed integral, as a share, for a wear of one at 30 degC."""
    at, none = np.array([30.0]), np.zeros(1)
    low = joint.curves(at, none, none) @ GRID.low_row()
    worn = joint.curves(at, none, np.ones(1)) @ GRID.low_row()
    return float(worn[0] / low[0] - 1.0)


def episodes(states: Sequence[object], state: object) -> int:
    """Return how many times a state was entered."""
    marks = np.array([s is state for s in states])
    return int(np.count_nonzero(np.diff(np.concatenate(([0], marks.astype(int)))) == 1))
