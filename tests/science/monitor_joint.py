"""A joint whose friction curve is known at every temperature, payload and wear; written apart.

Nothing here comes from the monitor's compensation: the oil's viscosity bends with temperature
(Vogel), the boundary friction grows with the payload, and wear adds where the joint is slow
(thesis Figures 5.8 and 5.9). The numbers are the thesis robot's where it has them: Coulomb
0.6042 N m, viscous 0.0107 N m s/rad, speeds to 300 rad/s, motor side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.detection.series import FEATURES, FeatureSeries
from agent.monitor.history.features import SpeedGrid

SPEEDS = np.array(
    [2.0, 5.0, 10.0, 20.0, 35.0, 50.0, 70.0, 100.0, 130.0, 165.0, 200.0, 250.0, 300.0]
)
GRID = SpeedGrid(SPEEDS, 100.0)
DAY_S = 86400.0


@dataclass(frozen=True)
class Joint:
    """The friction of one joint.

    Parameters
    ----------
    coulomb_nm, viscous_nm_s_per_rad : float
        At 30 degC without payload.
    static_extra_nm, stribeck_rad_s : float
    vogel_k, vogel_degc : float
        Of the oil: viscosity ~ exp(vogel_k / (T + vogel_degc)).
    load_share : float
        By how much the payload's full mass raises the boundary friction.
    wear_speed_rad_s : float
        Above this speed wear hardly shows.
    """

    coulomb_nm: float = 0.6042
    viscous_nm_s_per_rad: float = 0.0107
    static_extra_nm: float = 0.12
    stribeck_rad_s: float = 7.0
    vogel_k: float = 900.0
    vogel_degc: float = 105.0
    load_share: float = 0.12
    wear_speed_rad_s: float = 60.0

    def curves(self, temperature_degc: Floats, payload: Floats, wear: Floats) -> Floats:
        """Return friction, shape (n, speeds).

        Parameters
        ----------
        temperature_degc, payload : ndarray, shape (n,)
            Payload as a share of the largest.
        wear : ndarray, shape (n,)
            Friction added at standstill, as a share of the Coulomb friction.
        """
        warm, load, worn = (a[:, None] for a in (temperature_degc, payload, wear))
        thin = np.exp(
            self.vogel_k * (1.0 / (warm + self.vogel_degc) - 1.0 / (30.0 + self.vogel_degc))
        )
        boundary = self.coulomb_nm * (1.0 + self.load_share * load) + self.static_extra_nm * np.exp(
            -SPEEDS / (self.stribeck_rad_s * thin**-0.5)
        )
        worn_nm = self.coulomb_nm * worn * np.exp(-((SPEEDS / self.wear_speed_rad_s) ** 1.5))
        out: Floats = boundary + self.viscous_nm_s_per_rad * thin**0.8 * SPEEDS + worn_nm
        return out


def seen(curves: Floats, noise: float, points: float, rng: np.random.Generator) -> Floats:
    """Return curves as an experiment sees them.

    Parameters
    ----------
    curves : ndarray, shape (n, speeds)
    noise : float
        How much the whole curve differs from cycle to cycle, as a share.
    points : float
        How much each point of it does besides.
    rng : Generator
    """
    level = 1.0 + noise * rng.standard_normal((curves.shape[0], 1))
    return curves * level * (1.0 + points * rng.standard_normal(curves.shape))


def series_of(curves: Floats, healthy: int, days: Floats | None = None) -> FeatureSeries:
    """Return the features of curves, each stated to be as sure as its points' scatter allows."""
    features = curves @ GRID.rows().T
    time_s = DAY_S * (np.arange(len(curves), dtype=float) if days is None else days)
    values = dict(zip(FEATURES, features.T, strict=True))
    return FeatureSeries(time_s, values, {k: 0.005 * np.abs(v) for k, v in values.items()}, healthy)
