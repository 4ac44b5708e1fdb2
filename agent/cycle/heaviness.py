"""Where a joint is heavier: friction over the arm's position, from a contour check's two passes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PLACES = 60
"""Into so many the travel is divided."""

LEAST_SAMPLES = 3
SPREADS = 4.0
LEAST_SHARE = 0.1
"""A place counts as heavier by so many spreads of the others, and by this share of the usual."""


@dataclass(frozen=True)
class HeavyPlace:
    """A stretch of the arm's travel on which the joint needs more than elsewhere.

    Parameters
    ----------
    from_deg, to_deg : float
        Arm position.
    extra_nm : float
        The most that it needs above the usual, on the motor.
    """

    from_deg: float
    to_deg: float
    extra_nm: float


@dataclass(frozen=True)
class Heaviness:
    """Friction over the travel.

    Parameters
    ----------
    arm_deg, friction_nm : numpy.ndarray, shape (p,)
        Middle of each place that both passes crossed, and half the difference of their torques:
        gravity and springs, which do not follow the direction, cancel (thesis eq. 4.21).
    usual_nm, spread_nm : float
        Median over the places, and 1.4826 times the median distance from it.
    heavy : tuple of HeavyPlace
        In the order of the travel.
    """

    arm_deg: Floats
    friction_nm: Floats
    usual_nm: float
    spread_nm: float
    heavy: tuple[HeavyPlace, ...]

    @property
    def sentence(self) -> str:
        """Say it."""
        low, high = self.arm_deg[0], self.arm_deg[-1]
        usual = (
            f"From {low:.1f} to {high:.1f} degrees of the arm the joint needs {self.usual_nm:.3f} "
            "N m (motor side, median) to creep"
        )
        if not self.heavy:
            most = int(np.argmax(self.friction_nm))
            return (
                f"{usual}, and nowhere plainly more: the most is {self.friction_nm[most]:.3f} N m "
                f"at {self.arm_deg[most]:.1f} degrees."
            )
        share = 100.0 / self.usual_nm if self.usual_nm > 0.0 else np.nan
        places = "; ".join(
            f"{place.from_deg:.1f} to {place.to_deg:.1f} degrees, up to {place.extra_nm:.3f} N m "
            f"({share * place.extra_nm:.0f} %) more"
            for place in self.heavy
        )
        return f"{usual}. It is heavier at {places}."

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "schema": "stribeck.contour/1",
            "usual_nm": self.usual_nm,
            "spread_nm": self.spread_nm,
            "arm_deg": self.arm_deg.tolist(),
            "friction_nm": self.friction_nm.tolist(),
            "heavy": [vars(place) for place in self.heavy],
        }


def heaviness(columns: Mapping[str, NDArray[Any]], gear_ratio: float) -> Heaviness | None:
    """Return where a joint is heavier; None where no place was passed in both directions.

    Parameters
    ----------
    columns : mapping of str to numpy.ndarray, each of shape (n,)
        `position_rad`, `velocity_command_rad_s`, `torque_nm` and `phase` of a contour check, motor
        side.
    gear_ratio : float
        Motor turns per arm turn.
    """
    steady = (np.asarray(columns["phase"]) == "steady") & np.isfinite(columns["torque_nm"])
    arm_deg = np.rad2deg(np.asarray(columns["position_rad"])[steady]) / gear_ratio
    torque = np.asarray(columns["torque_nm"])[steady]
    forward = np.asarray(columns["velocity_command_rad_s"])[steady] > 0.0
    if not forward.any() or forward.all():
        return None
    edges = np.linspace(arm_deg.min(), arm_deg.max(), PLACES + 1)
    place = np.clip(np.searchsorted(edges, arm_deg, side="right") - 1, 0, PLACES - 1)
    middles, friction = [], []
    for index in range(PLACES):
        out, back = torque[(place == index) & forward], torque[(place == index) & ~forward]
        if min(len(out), len(back)) >= LEAST_SAMPLES:
            middles.append(0.5 * (edges[index] + edges[index + 1]))
            friction.append(0.5 * (np.median(out) - np.median(back)))
    if not friction:
        return None
    return _judged(np.array(middles), np.array(friction), 0.5 * float(edges[1] - edges[0]))


def _judged(arm_deg: Floats, friction_nm: Floats, half_deg: float) -> Heaviness:
    """Find the stretches that stand out of all the others."""
    usual = float(np.median(friction_nm))
    spread = 1.4826 * float(np.median(np.abs(friction_nm - usual)))
    above = friction_nm - usual > max(SPREADS * spread, LEAST_SHARE * abs(usual))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], above.astype(int), [0]])))
    heavy = tuple(
        HeavyPlace(
            float(arm_deg[first] - half_deg),
            float(arm_deg[after - 1] + half_deg),
            float(friction_nm[first:after].max() - usual),
        )
        for first, after in zip(edges[::2], edges[1::2], strict=True)
    )
    return Heaviness(arm_deg, friction_nm, usual, spread, heavy)
