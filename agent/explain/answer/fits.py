"""How far predictions are from recordings, the noise that none can pass, and what that proves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.result import Floats

UNSEEN = "recordings that it had not seen"
"""The source of a proof on recordings that were held out."""

_STANDS_OUT = 0.3  # of the noise's square: less above it is hardly seen
_NEXT_TO_NOTHING = 0.25  # of what stands out above the noise
_FAR_ABOVE = 1.5  # times the noise floor: there is more to explain than noise


@dataclass(frozen=True)
class Fit:
    """How far a prediction is from a recording; both NaN where nothing was compared.

    `fit_percent` is ``100 (1 - |y - yhat| / |y - mean(y)|)`` (contract section 6).
    """

    rmse_nm: float = math.nan
    fit_percent: float = math.nan

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON; empty where nothing was compared."""
        if math.isnan(self.rmse_nm):
            return {}
        return {"rmse_nm": self.rmse_nm, "fit_percent": number(self.fit_percent)}


@dataclass(frozen=True)
class Floor:
    """The noise floor by three routes, N m rms in the band of the comparison; NaN: not there.

    `value_nm` is the one that the verdict uses.
    """

    value_nm: float
    repeats_nm: float
    neighbours_nm: float
    standstill_nm: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "value_nm": number(self.value_nm),
            "repeated_passes_nm": number(self.repeats_nm),
            "neighbours_nm": number(self.neighbours_nm),
            "standstill_nm": number(self.standstill_nm),
        }


@dataclass(frozen=True)
class Edges:
    """Right after starts and reversals nothing is compared: how much that is, and how far off.

    Parameters
    ----------
    share : float
        Of the motion.
    rms_nm : float
        What the simulation misses there.
    """

    share: float
    rms_nm: float


@dataclass(frozen=True)
class Holdout:
    """The proof on data that neither choice nor fit had seen.

    `source` says which data: the hold-out recordings, or folds that stand in for them.
    `placebo_percent` is the improvement that the same search reaches on axes that were shifted;
    `wins` of `blocks` were predicted better; `white` is whether what is left looks like noise.
    `denied` says why recordings that were held out cannot be as what was found has them.
    """

    source: str
    baseline: Fit
    refitted: Fit
    extended: Fit
    improvement_percent: float
    improvement_ci95_percent: tuple[float, float] | None
    floor_ratio: float
    wins: int
    blocks: int
    placebo_percent: float
    white: bool
    denied: str = ""

    @property
    def unsure(self) -> bool:
        """Return whether unseen data may not be as what was found has them.

        Their error may not fall at all, and stays far above noise, or what was found takes next to
        nothing of what recordings have above it; or they cannot be so.
        """
        if self.denied:
            return True
        interval = self.improvement_ci95_percent
        if interval is None or interval[0] > 0.0:
            return False
        takes_little = self.source == UNSEEN and self.taken_share() < _NEXT_TO_NOTHING
        return takes_little or self.floor_ratio > _FAR_ABOVE

    def taken_share(self, floors: float = 1.0) -> float:
        """Return which share of what the refitted twin leaves above noise is gone; NaN for none.

        Parameters
        ----------
        floors : float
            How many times the floor the noise is.
        """
        before, after = self.refitted.rmse_nm**2, self.extended.rmse_nm**2
        noise = after * (floors / self.floor_ratio) ** 2 if self.floor_ratio > 0.0 else math.nan
        above = before - noise
        return (before - after) / above if above > _STANDS_OUT * noise else math.nan

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        interval = self.improvement_ci95_percent
        return {
            "source": self.source,
            "baseline": self.baseline.to_json(),
            "refitted": self.refitted.to_json(),
            "extended": self.extended.to_json(),
            "improvement_percent": number(self.improvement_percent),
            "improvement_ci95_percent": None if interval is None else list(interval),
            "floor_ratio": number(self.floor_ratio),
            "wins": self.wins,
            "blocks": self.blocks,
            "placebo_improvement_percent": number(self.placebo_percent),
            "residual_white": self.white,
        }


@dataclass(frozen=True)
class Trace:
    """One recording before and after, arrays of shape (n,), for pictures.

    `given_nm`, `refitted_nm` and `extended_nm` are measured less predicted torque.
    """

    recording: str
    held_out: bool
    time_s: Floats
    velocity_rad_s: Floats
    measured_nm: Floats
    given_nm: Floats
    refitted_nm: Floats
    extended_nm: Floats


def fit_of(measured_nm: Floats, residual_nm: Floats) -> Fit:
    """Return root mean square and fit percent of a residual against what was measured."""
    if not measured_nm.size:
        return Fit()
    spread = float(np.linalg.norm(measured_nm - measured_nm.mean()))
    left = float(np.linalg.norm(residual_nm))
    percent = 100.0 * (1.0 - left / spread) if spread > 0.0 else math.nan
    return Fit(left / math.sqrt(measured_nm.size), percent)


def number(value: float) -> float | None:
    """Return a finite number as it is, and None for any other."""
    return float(value) if math.isfinite(value) else None
