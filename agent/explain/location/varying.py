"""What would have to vary: a number of the twin along an axis, where no law of the library carries.

A drag that comes and goes is as large in every direction and, refitted, nowhere nothing: a size of
what is left tells of no place. The number that varies does: it is usually one, and another one
where the mismatch is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.located import Region, Varying
from agent.identify.result import Floats

BINS = 30
FEWEST = 8
OF_GREATEST = 0.2
"""Of the greatest excess: what lies everywhere is still greatest somewhere."""

LEAST_SHARE = 0.15
_SIGMAS, _NORMAL = 3.0, 1.96
_FELT = 0.03  # of the greatest mean square torque that one of the number makes in a bin
_NEARLY_ALL = 0.9  # of what a number makes of the torque
_CARRIES = 0.3  # of what is left above the noise: else no number that varies says what it is
_BY_QUANTILES = (
    "velocity_rad_s",
    "acceleration_rad_s2",
    "after_reversal_s",
    "after_reversal_rad",
)


@dataclass(frozen=True)
class Bins:
    """An axis cut into bins: which each value lies in, (m,), and how many lie in each, (b,)."""

    variable: str
    edges: Floats
    index: NDArray[np.int64]
    count: Floats

    @classmethod
    def of(cls, variable: str, values: Floats) -> Bins | None:
        """Cut an axis; None where it has no length.

        Parameters
        ----------
        variable : str
            A word of contract section 6.
        values : ndarray, shape (m,)
            Finite.
        """
        edges = _edges(values, variable)
        if edges.shape[0] < 2:
            return None
        index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.shape[0] - 2)
        count = np.bincount(index, minlength=edges.shape[0] - 1).astype(np.float64)
        return cls(variable, edges, index, count)

    @property
    def middles(self) -> Floats:
        """Return the middle of each bin, shape (b,)."""
        return np.asarray(0.5 * (self.edges[:-1] + self.edges[1:]))

    def total(self, values: Floats) -> Floats:
        """Return the sum of values, shape (m,), in each bin, shape (b,)."""
        return np.asarray(np.bincount(self.index, values, self.count.shape[0]), dtype=np.float64)

    def regions(self, high: NDArray[np.bool_], excess: Floats, row_s: float) -> tuple[Region, ...]:
        """Return the connected bins that are high, single holes closed, the strongest first.

        Parameters
        ----------
        high : ndarray of bool, shape (b,)
        excess : ndarray, shape (b,)
            Energy above the noise.
        row_s : float
            How much time one row stands for.
        """
        whole = max(float(excess.sum()), 1e-300)
        ends = np.flatnonzero(np.diff(_joined(high).astype(np.int8), prepend=0, append=0))
        out = []
        for begin, end in zip(ends[::2], ends[1::2], strict=True):
            share = float(excess[begin:end].sum()) / whole
            if share < LEAST_SHARE:
                continue
            seconds = row_s * float(self.count[begin:end].sum())
            low, up = float(self.edges[begin]), float(self.edges[end])
            if self.variable == "recording":
                low, up = low + 0.5, up - 0.5
            out.append(Region(self.variable, low, up, seconds, share))
        return tuple(sorted(out, key=lambda region: -region.share))


def varying(
    bins: Bins,
    number: str,
    column: Floats,
    left_nm: Floats,
    floor_nm: float,
    independent: float,
    row_s: float,
) -> Varying | None:
    """Return by how much a number would differ along an axis; None where that carries too little.

    Parameters
    ----------
    bins : Bins
        Of the axis.
    number : str
        As the deficiency map names it.
    column : ndarray, shape (m,)
        What one of the number adds to the torque.
    left_nm : ndarray, shape (m,)
        What the model leaves.
    floor_nm : float
    independent : float
        Share of the rows that counts as independent.
    row_s : float
        How much time one row stands for.
    """
    weight, moment = bins.total(column**2), bins.total(column * left_nm)
    known = (bins.count >= FEWEST) & (weight > 1e-6 * float(weight.max(initial=0.0)))
    above = float(left_nm @ left_nm) - left_nm.shape[0] * floor_nm**2
    if np.count_nonzero(known) < 2 or not above > 0.0:
        return None
    own = np.where(known, moment / np.where(known, weight, 1.0), 0.0)
    by_chance = np.count_nonzero(known) * floor_nm**2 / independent
    carried = float(np.sum(own[known] ** 2 * weight[known])) - by_chance
    if carried < _CARRIES * above:
        return None
    # Where a number hardly makes a torque, as an inertia at a steady speed, it is nowhere usual.
    torque = weight / np.maximum(bins.count, 1.0)
    felt = known & (torque >= _FELT * float(torque[known].max()))
    usual = _median(own[felt], bins.count[felt])
    more = np.where(known, own - usual, 0.0)
    error = floor_nm / np.sqrt(np.maximum(weight * independent, 1e-300))
    excess = more**2 * weight
    density = excess / np.maximum(bins.count, 1.0)
    high = known & (np.abs(more) > _SIGMAS * error)
    high &= density >= OF_GREATEST * float(density[high].max(initial=0.0))
    regions = [
        region
        for side in (more > 0.0, more < 0.0)
        for region in bins.regions(high & side, excess, row_s)
    ]
    inside = np.any([_inside(region, bins) for region in regions], axis=0) & known
    if not regions or float(weight[inside].sum()) > _NEARLY_ALL * float(weight.sum()):
        return None  # where all of it is otherwise, nothing is usual
    regions.sort(key=lambda region: -region.share)
    return Varying(
        number=number,
        variable=bins.variable,
        share=min(carried / above, 1.0),
        at=bins.middles[known],
        more=more[known],
        half=_NORMAL * error[known],
        regions=tuple(regions),
        amounts=tuple(_mean_in(region, bins, more, weight) for region in regions),
    )


def _mean_in(region: Region, bins: Bins, more: Floats, weight: Floats) -> float:
    """Return by how much a number differs in a region, every bin by what it weighs."""
    inside = _inside(region, bins)
    return float(np.average(more[inside], weights=weight[inside]))


def _inside(region: Region, bins: Bins) -> NDArray[np.bool_]:
    """Return which bins lie in a region, shape (b,)."""
    return (bins.middles >= region.lower) & (bins.middles <= region.upper)


def _median(values: Floats, weight: Floats) -> float:
    order = np.argsort(values)
    half = np.searchsorted(np.cumsum(weight[order]), 0.5 * float(weight.sum()))
    return float(values[order][half])


def _joined(high: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return flags with single holes closed: one quiet bin does not make two places of one."""
    out = high.copy()
    out[1:-1] |= high[:-2] & high[2:]
    return out


def _edges(values: Floats, variable: str) -> Floats:
    if variable == "recording":
        return np.append(np.unique(values) - 0.5, float(values.max()) + 0.5)
    points = np.linspace(0.0, 1.0, BINS + 1)
    if variable in _BY_QUANTILES:
        return np.unique(np.quantile(values, points))
    low, high = (float(x) for x in np.quantile(values, [0.001, 0.999]))
    return low + (high - low) * points if high > low else np.zeros(0)
