"""How much friction there is over all speeds, against temperature (thesis Appendix A, Figure A.1).

One number for each recording: its friction curve integrated over the speeds that all recordings
share. Oil that thins makes it fall; how steeply is a straight line's slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.friction.surface_law import SurfacePoints
from agent.identify.result import Floats, Parameter
from agent.identify.uncertainty import student_975
from agent.physics.thermal import friction_integral, integral_slope

_FEWEST = 3  # temperatures
_LEAST_K = 2.0  # between the coldest and the warmest
_SPEEDS = 200


@dataclass(frozen=True)
class IntegralOverTemperature:
    """The friction integral of every recording.

    Parameters
    ----------
    temperature_degc, integral_w : ndarray, shape (k,)
        N m rad/s is a watt.
    speeds_rad_s : tuple of float
        From where to where was integrated.
    slope_w_per_k : Parameter
        Of the straight line through them.
    """

    temperature_degc: Floats
    integral_w: Floats
    speeds_rad_s: tuple[float, float]
    slope_w_per_k: Parameter

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "temperature_degc": self.temperature_degc.tolist(),
            "integral_w": self.integral_w.tolist(),
            "speeds_rad_s": list(self.speeds_rad_s),
            "slope_w_per_k": self.slope_w_per_k.to_json(),
        }


def integral_over_temperature(points: SurfacePoints) -> IntegralOverTemperature | None:
    """Return the friction integral against temperature; None where no two recordings compare.

    Parameters
    ----------
    points : SurfacePoints
        With the recording of every point.
    """
    if points.recording is None:
        return None
    curves = [points.take(points.recording == k) for k in np.unique(points.recording)]
    curves = [curve for curve in curves if np.unique(curve.speed_rad_s).size > 1]
    if len(curves) < 2:
        return None
    slowest = max(float(curve.speed_rad_s.min()) for curve in curves)
    fastest = min(float(curve.speed_rad_s.max()) for curve in curves)
    if not slowest < fastest:
        return None
    grid = np.linspace(slowest, fastest, _SPEEDS)
    rows = []
    for curve in curves:
        order = np.argsort(curve.speed_rad_s)
        rows.append(np.interp(grid, curve.speed_rad_s[order], curve.friction_nm[order]))
    degc = np.array([float(np.mean(curve.temperature_degc)) for curve in curves])
    integral = friction_integral(grid, np.array(rows))
    return IntegralOverTemperature(degc, integral, (slowest, fastest), _slope(degc, integral))


def _slope(degc: Floats, integral_w: Floats) -> Parameter:
    span_k = float(np.ptp(degc))
    if degc.size < _FEWEST or span_k < _LEAST_K:
        return Parameter.not_identified(
            f"{degc.size} recordings within {span_k:.1f} K; record the same speeds at three "
            "temperatures or more, ten kelvin apart"
        )
    slope = integral_slope(degc, integral_w)
    away = degc - degc.mean()
    left = integral_w - integral_w.mean() - slope * away
    freedom = degc.size - 2
    error = math.sqrt(float(left @ left) / freedom / float(away @ away))
    half = student_975(float(freedom)) * error
    return Parameter(slope, (slope - half, slope + half))
