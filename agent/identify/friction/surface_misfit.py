"""What a friction law over velocity and temperature misses alike at all temperatures.

Leaving temperatures out shows what differs between them. A law that is bent otherwise than the
joint, or a loop that still settles at the fastest speeds, errs by the same at every temperature:
the residuals of a speed then have a mean that their scatter does not explain. Where the speeds'
means together are beyond chance, a misfit of the law stands beside the points' errors, as it does
at one temperature (decision 0043), and every speed may draw the parameters by it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agent.identify.friction.surface_law import SurfaceLaw, SurfacePoints
from agent.identify.friction.weights import misfit
from agent.identify.result import Floats
from agent.identify.uncertainty import student_975

_SAME_SPEED = 0.02  # relative
_STEP = 1e-4  # of a logarithm
_TOLD = 0.05  # of the largest direction: less of it is not told by the speeds' means
_CHANCE = 0.05


def missed_by_speed(
    points: SurfacePoints, law: SurfaceLaw, reference_degc: float, theta: Floats, nonlinear: Floats
) -> Floats:
    """Return by how much each speed's misfit may draw the parameters.

    Parameters
    ----------
    points : SurfacePoints
    law : SurfaceLaw
    reference_degc : float
    theta, nonlinear : ndarray, shapes (m,) and (k,)
        The fit to all points.

    Returns
    -------
    ndarray, shape (s, m + k)
        One row a speed; of searched parameters the logarithm's. Its root sum of squares is half of
        a 95 % interval: Student's quantile is in it. Zeros where chance explains the means.
    """
    from scipy.special import fdtrc

    error = points.error_nm
    columns = law.columns(
        points.speed_rad_s, points.temperature_degc, reference_degc, nonlinear.tolist()
    )
    rest = points.friction_nm - columns @ theta
    slopes = _slopes(points, law, reference_degc, theta, nonlinear) / error[:, np.newaxis]
    own = _speeds(points.speed_rad_s)
    member = (own == np.arange(int(own.max()) + 1)[:, np.newaxis]) / error
    weight = np.sum(member**2, axis=1)
    mean, count = member @ (rest / error) / weight, weight.size
    size = np.linalg.norm(slopes, axis=0)
    scaled = slopes / np.where(size > 0.0, size, 1.0)
    told = np.linalg.svd(member @ scaled / np.sqrt(weight)[:, np.newaxis], compute_uv=False)
    rank = int(np.count_nonzero(told > _TOLD * told[0]))
    between, within = count - rank, rest.size - count - (slopes.shape[1] - rank)
    scatter = float(np.sum(((rest - mean[own]) / error) ** 2)) / max(within, 1)
    none = np.zeros((count, slopes.shape[1]))
    if between < 1 or within < 1 or not scatter > 0.0:
        return none
    spread = np.sqrt(scatter / weight)
    ratio = float(np.sum((mean / spread) ** 2)) / between
    if fdtrc(between, within, ratio) > _CHANCE:
        return none
    pulled = (np.linalg.pinv(scaled) / np.where(size > 0.0, size, 1.0)[:, np.newaxis]) @ member.T
    half = student_975(float(between)) * misfit(mean, spread, between)
    return np.asarray(half * pulled.T, dtype=np.float64)


def _speeds(speed_rad_s: Floats) -> NDArray[np.int64]:
    """Return the number of the speed that each point was passed at, rising, shape (n,)."""
    order = np.argsort(speed_rad_s, kind="stable")
    steps = np.diff(np.log(speed_rad_s[order]), prepend=np.log(speed_rad_s[order[0]]))
    out = np.empty(order.size, dtype=np.int64)
    out[order] = np.cumsum(steps > _SAME_SPEED)
    return out


def _slopes(
    points: SurfacePoints, law: SurfaceLaw, reference_degc: float, theta: Floats, nonlinear: Floats
) -> Floats:
    """Return how friction follows the torques and the searched logarithms, shape (n, m + k)."""

    def columns(log_nonlinear: Floats) -> Floats:
        return law.columns(
            points.speed_rad_s,
            points.temperature_degc,
            reference_degc,
            np.exp(log_nonlinear).tolist(),
        )

    at = np.log(nonlinear)
    steps = _STEP * np.eye(at.size)
    searched = [(columns(at + h) - columns(at - h)) @ theta / (2.0 * _STEP) for h in steps]
    return np.column_stack((columns(at), *searched))
