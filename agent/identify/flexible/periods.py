"""Averaging a periodic recording over its periods (thesis 4.2.1).

The noise falls with the root of the number of periods; what the periods do not share is measured
by the way. The mean period stands once: laid end to end with a copy of itself it would count its
noise twice, and every interval would come out too narrow by the root of two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals

LAID = 1
"""How often the mean period stands in what `average_periods` returns."""


@dataclass(frozen=True)
class PeriodScatter:
    """What the periods do not share.

    Parameters
    ----------
    periods : int
        How many were averaged.
    torque_nm : float
        Standard deviation of one period's torque about the mean period.
    """

    periods: int
    torque_nm: float


def average_periods(
    signals: Signals, *, period_s: float, first_s: float
) -> tuple[Signals, PeriodScatter]:
    """Return the mean period of a recording, and the scatter about it.

    Parameters
    ----------
    signals : Signals
    period_s : float
        Length of a period, above zero.
    first_s : float
        When the first whole period begins; the one after the lead-in has not settled yet and is
        better left out.

    Raises
    ------
    ValueError
        Fewer than two whole, valid periods are there.
    """
    if not (math.isfinite(period_s) and period_s > 0.0 and math.isfinite(first_s)):
        raise ValueError(f"expected a period above zero and its start, got {period_s}, {first_s}")
    valid = signals.valid
    time_s = signals.time_s[valid]
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else math.inf
    points = round(period_s / step_s) if math.isfinite(step_s) else 0
    count = math.floor((time_s[-1] - first_s) / period_s + 1e-9) if time_s.size else 0
    if count < 2 or points < 10 or first_s < time_s[0]:
        raise ValueError(
            f"{signals.name}: expected two whole periods of {period_s:g} s after {first_s:g} s, "
            f"found {max(count, 0)}"
        )
    grid_s = first_s + np.arange(count * points) * (period_s / points)

    from scipy.interpolate import CubicSpline

    def folded(values: Floats) -> Floats:
        # Straight lines between samples of the position would be blows in its acceleration.
        return np.asarray(CubicSpline(time_s, values[valid])(grid_s)).reshape(count, points)

    torque = folded(signals.torque_nm)
    mean = torque.mean(axis=0)
    spread = math.sqrt(float(np.sum((torque - mean) ** 2)) / ((count - 1) * points))

    def averaged(values: Floats | None) -> Floats | None:
        return None if values is None else np.tile(folded(values).mean(axis=0), LAID)

    position = None
    if signals.position_rad is not None:
        runs = folded(signals.position_rad)
        advance = float(np.mean(runs[1:, 0] - runs[:-1, 0]))
        runs = runs - advance * np.arange(count)[:, np.newaxis]
        position = np.concatenate([runs.mean(axis=0) + k * advance for k in range(LAID)])
    out = replace(
        signals,
        time_s=np.arange(LAID * points, dtype=np.float64) * float(period_s / points),
        torque_nm=np.tile(mean, LAID),
        position_rad=position,
        velocity_rad_s=averaged(signals.velocity_rad_s),
        valid=np.ones(LAID * points, dtype=np.bool_),
        gearbox_temperature_degc=averaged(signals.gearbox_temperature_degc),
        velocity_command_rad_s=averaged(signals.velocity_command_rad_s),
        position_command_rad=None,
        phase=None,
    )
    return out, PeriodScatter(count, spread)
