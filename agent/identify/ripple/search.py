"""Which orders stand out: one after another, each taken out before the next is looked for.

The strongest order that stands out of its local background is found, refined and taken out of the
passes, until none is left (CLEAN; Högbom, Astron. Astrophys. Suppl. 15 (1974) 417). Its chance
counts every order that was looked at, and that a peak may lie between those that are independent
(Baluev, MNRAS 385 (2008) 1279, eq. 5).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.ripple.background import BACKGROUND_DOF
from agent.identify.ripple.order_spectrum import (
    TREND,
    AnglePass,
    Grid,
    Spectrum,
    spectrum_of,
)

_ALPHA = 0.01  # chance of one false order in the whole scan
_MASKED = 0.8  # of the distance at which two orders can be told apart
_MOST_LINES = 20
_REPELLED = 0.7  # of it, in refinement
_REFINED_BY = 0.1  # of it, in one step
_REFINEMENTS = 3
_LEAST_KNOWN = 0.1  # of what a pass seems to tell of an order: noise never takes all of it
_BETWEEN = math.sqrt(math.pi / 3.0)  # of samples that lie evenly along the pass


@dataclass(frozen=True)
class Found:
    """Orders that stand out, the chance of each, and the spectra before and after.

    `first` has all orders in it, `rest` none that was found; `information` is the reciprocal of
    each order's variance.
    """

    orders: tuple[float, ...]
    chances: tuple[float, ...]
    information: tuple[float, ...]
    first: Spectrum
    rest: Spectrum

    def level(self, independent: float) -> Floats:
        """Return the amplitude from which a single order of one pass counts, shape (k,)."""
        height = -math.log(_ALPHA / independent)
        height += math.log(_BETWEEN * math.sqrt(height))
        return np.asarray(np.sqrt(2.0 * height * np.mean(self.rest.variance, axis=0)))


def in_phase(passes: Sequence[AnglePass]) -> list[list[int]]:
    """Return which passes share a phase: those of one direction with a recorded angle."""
    groups: list[list[int]] = [[i] for i, p in enumerate(passes) if not p.absolute]
    for forward in (True, False):
        same = [i for i, p in enumerate(passes) if p.absolute and (p.velocity_rad_s > 0) == forward]
        if same:
            groups.append(same)
    return groups


def search(passes: Sequence[AnglePass], grid: Grid) -> Found:
    """Take out order after order until none stands out.

    Parameters
    ----------
    passes : sequence of AnglePass
        At least one.
    grid : Grid
        The orders to look at.
    """
    groups = in_phase(passes)
    orders: list[float] = []
    chances: list[float] = []
    first: Spectrum | None = None
    while True:
        spectrum = spectrum_of(passes, grid, orders)
        first = spectrum if first is None else first
        statistic = _evidence(spectrum, groups)
        # Closer to an order that is out already, its own change along the pass would be found.
        for order in orders:
            statistic[np.abs(spectrum.order - order) < _MASKED * grid.apart] = 0.0
        best = int(np.argmax(statistic))
        chance = _chance(float(statistic[best]), len(groups), grid.independent)
        if chance > _ALPHA or len(orders) == _MOST_LINES:
            information = _information(passes, orders, _weights(orders, spectrum))
            return Found(
                tuple(orders), tuple(chances), tuple(information.tolist()), first, spectrum
            )
        orders.append(float(spectrum.order[best]))
        chances.append(min(chance, 1.0))
        orders = _refined(passes, orders, grid, spectrum)


def with_settled_heads(
    found: Found, passes: Sequence[AnglePass], grid: Grid
) -> tuple[list[AnglePass], Found]:
    """Return the passes with the heads that have settled, and the orders refined on them.

    An order's error falls with the length of the passes to the power of 3/2: a tenth is a sixth.
    """
    longer = [p.settled(found.orders) for p in passes]
    if all(a is b for a, b in zip(longer, passes, strict=True)):
        return longer, found
    orders = list(found.orders)
    spectrum = spectrum_of(longer, grid, orders)
    orders = _refined(longer, orders, grid, spectrum)
    rest = spectrum_of(longer, grid, orders)
    information = _information(longer, orders, _weights(orders, rest))
    first = spectrum_of(longer, grid)
    return longer, Found(tuple(orders), found.chances, tuple(information.tolist()), first, rest)


def _chance(statistic: float, groups: int, independent: float) -> float:
    """Return the chance that noise alone reaches the statistic at any order of the scan.

    The sum over groups of ``|c|^2 / (2 var)`` has an F distribution with 2 g and g x
    `BACKGROUND_DOF` degrees of freedom, because the background is itself an estimate. The peak of
    a smooth spectrum is higher than that of its independent orders, by a factor that grows with
    the root of the height.
    """
    from scipy.special import fdtrc

    tail = float(fdtrc(2.0 * groups, groups * BACKGROUND_DOF, statistic / groups))
    return tail * independent * max(1.0, _BETWEEN * math.sqrt(statistic))


def _evidence(spectrum: Spectrum, groups: Sequence[Sequence[int]]) -> Floats:
    """Return the statistic of every order, passes of a group added in phase, shape (k,)."""
    total = np.zeros(spectrum.order.size)
    for group in groups:
        weight = 1.0 / spectrum.variance[list(group)]
        summed = np.sum(weight * spectrum.amplitude[list(group)], axis=0)
        total += np.abs(summed) ** 2 / (2.0 * weight.sum(axis=0))
    return total


def _refined(
    passes: Sequence[AnglePass], orders: list[float], grid: Grid, background: Spectrum
) -> list[float]:
    """Return the orders after some Gauss-Newton steps, amplitudes and phases free in each pass.

    Passes count by the noise at the order, which coloured noise makes a matter of their speed.
    """
    orders = list(orders)
    weight = _weights(orders, background)
    reach = _REFINED_BY * grid.apart
    for _ in range(_REFINEMENTS):
        gain, information = _gradient(passes, orders, weight)
        step = gain / np.maximum(information, 1e-300)
        for i, change in enumerate(np.clip(step, -reach, reach)):
            moved = orders[i] + float(change)
            # Two orders must not run into each other: their amplitudes would grow without bound.
            others = [k for j, k in enumerate(orders) if j != i]
            if all(abs(moved - k) >= _REPELLED * grid.apart for k in others):
                orders[i] = moved
    return orders


def _weights(orders: Sequence[float], background: Spectrum) -> Floats:
    """Return the reciprocal variance of an amplitude at each order in each pass, shape (p, m)."""
    at = [int(np.argmin(np.abs(background.order - order))) for order in orders]
    return np.asarray(1.0 / background.variance[:, at])


def _information(passes: Sequence[AnglePass], orders: Sequence[float], weight: Floats) -> Floats:
    """Return what is known of each order, without what noise adds to the amplitudes, shape (m,).

    An amplitude's square is too large by twice its variance on the average, and so would be what
    it tells of its order.
    """
    total = np.zeros(len(orders))
    for p, own in zip(passes, weight, strict=True):
        _, information, power = _gradient_of(p, orders, own)
        total += information * np.maximum(1.0 - 2.0 / np.maximum(own * power, 1e-300), _LEAST_KNOWN)
    return total


def _gradient(
    passes: Sequence[AnglePass], orders: Sequence[float], weight: Floats
) -> tuple[Floats, Floats]:
    """Return the log likelihood's slope by each order, and its information; shape (m,)."""
    each = [_gradient_of(p, orders, own) for p, own in zip(passes, weight, strict=True)]
    return np.sum([gain for gain, _, _ in each], axis=0), np.sum([i for _, i, _ in each], axis=0)


def _gradient_of(
    p: AnglePass, orders: Sequence[float], own: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return one pass's slope and information by each order, and its amplitudes' squares."""
    columns = p.columns(orders)
    basis, upper = np.linalg.qr(columns)
    share = basis.T @ p.signal
    theta = np.linalg.solve(upper, share)
    rest = p.signal - basis @ share
    cos, sin = columns[:, TREND::2], columns[:, TREND + 1 :: 2]
    slopes = p.angle_rad[:, np.newaxis] * (theta[TREND + 1 :: 2] * cos - theta[TREND::2] * sin)
    slopes -= basis @ (basis.T @ slopes)
    # The variance of an amplitude is that of a sample times 2/n.
    scale = 2.0 * own / rest.size
    power = theta[TREND::2] ** 2 + theta[TREND + 1 :: 2] ** 2
    return (
        np.asarray(scale * (slopes.T @ rest)),
        np.asarray(scale * np.einsum("ij,ij->j", slopes, slopes)),
        np.asarray(power),
    )
