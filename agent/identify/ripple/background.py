"""The noise's power at an order, from its neighbours: what stands out does so against this.

The median of the neighbours is not moved by single orders that stand out, but it is that of the
order itself only where noise is as strong on either side. Noise with a memory falls with the
order: it is made even first by the spectrum of such noise that fits best, and uneven again
afterwards (prewhitening: Blackman & Tukey, The Measurement of Power Spectra, 1958). Orders that
were taken out took the noise about them along, and are no neighbours.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats

BACKGROUND_DOF = 46.0  # of the median of 2 x 24 exponentials, as a chi-square, two per order
_NEIGHBOURS = 24  # independent orders on either side
_MEDIAN_OF_EXPONENTIAL = math.log(2.0)
_CORNERS = 16  # orders at which noise with a memory may begin to fall
_FLOORS = (0.0, 0.01, 0.05, 0.2)  # of its power at rest: noise without memory beside it
_HIDES = 5.0  # times the mean: more is an order that stands out, and does not shape the noise
_BETTER = 6.0  # of the deviance: chance makes even noise fall by as much in one of twenty


def background(power: Floats, order: Floats, per_order: int, taken: NDArray[np.bool_]) -> Floats:
    """Return the local mean power of the noise, shape (k,).

    Parameters
    ----------
    power : ndarray, shape (k,)
        Of one pass.
    order : ndarray, shape (k,)
        Rising, above zero.
    per_order : int
        Grid points between two orders that the pass can tell apart.
    taken : ndarray of bool, shape (k,)
        Where orders were taken out.
    """
    free = np.flatnonzero(~taken)
    if free.size < per_order:
        free = np.arange(power.size)
    floor = 1e-18 * max(float(power.max(initial=0.0)), 1e-300)
    noise = np.maximum(power[free], floor)
    shape = _with_memory(noise, order[free], per_order)
    even = _local_median(noise / shape, per_order) / _MEDIAN_OF_EXPONENTIAL
    return np.maximum(np.interp(np.arange(power.size), free, even * shape), floor)


def _with_memory(power: Floats, order: Floats, per_order: int) -> Floats:
    """Return the shape ``1/(1 + (k/k0)^2) + floor`` that fits best, or an even one, shape (k,).

    By Whittle's likelihood at independent orders, high ones cut off.
    """
    corners = np.geomspace(0.5 * order[0], order[-1], _CORNERS)
    falls = 1.0 / (1.0 + (order / corners[:, np.newaxis]) ** 2)
    falls /= falls[:, :1]
    shapes = np.concatenate([np.ones((1, order.size)), *(falls + part for part in _FLOORS)])
    chosen = shapes[:, ::per_order]
    ratio = power[::per_order] / chosen
    level = np.median(ratio, axis=1, keepdims=True) / _MEDIAN_OF_EXPONENTIAL
    misfit = np.log(chosen * level) + np.minimum(ratio / level, _HIDES)
    deviance = 2.0 * np.sum(misfit, axis=1)
    best = int(np.argmin(deviance))
    return np.asarray(shapes[best if deviance[0] - deviance[best] > _BETTER else 0])


def _local_median(power: Floats, per_order: int) -> Floats:
    """Return the median over the neighbours of every order, shape (k,)."""
    reach = _NEIGHBOURS * per_order
    padded = np.pad(power, reach, mode="reflect" if power.size > reach else "symmetric")
    views = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    stride = max(per_order // 2, 1)
    coarse = np.arange(0, power.size, stride)
    medians = np.median(views[coarse][:, ::stride], axis=1)
    return np.interp(np.arange(power.size), coarse, medians)
