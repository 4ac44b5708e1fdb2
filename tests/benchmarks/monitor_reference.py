"""The best that is possible for a detector that knows no more than the product does.

The optimum of `monitor_delay` knows a joint's level and scatter, which no detector with a short
baseline can. This one knows what the product is told: which nights were healthy at first, and the
size of the rise. Level and scatter are integrated out over all nights, under Jeffreys's prior
(normal-inverse-gamma without any weight of its own). The likelihood of a rise from night v on
against none is then, with S the nights' squared deviations from their own mean, the rise taken out
again in S_v,

    L_v = (S / S_v)^((t - 1) / 2)

and Shiryaev and Roberts's statistic is the sum of L_v over the nights that v may be (Pollak, Ann.
Statist. 13 (1985) 206: it is as quick as any rule on average, but for o(1), where the laws are
known). Its threshold is that at which as many healthy robots alarm as under the product, on the
same nights.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from agent.identify.result import Floats


def log_odds(values: Floats, rise: float, healthy: int) -> Floats:
    """Return the logarithm of the statistic at each night, shape (n,); -inf while healthy.

    Parameters
    ----------
    values : ndarray, shape (n,)
    rise : float
        In the unit of the values.
    healthy : int
        First nights that are told to be so.
    """
    x = values - np.mean(values[:healthy])
    sums = np.concatenate(([0.0], np.cumsum(x)))
    squares = np.concatenate(([0.0], np.cumsum(x**2)))
    out = np.full(x.size, -np.inf)
    for t in range(healthy + 1, x.size + 1):
        risen = t - np.arange(healthy, t)  # nights with the rise, for each first one
        tail = sums[t] - sums[healthy:t]
        none = squares[t] - sums[t] ** 2 / t
        without = squares[t] - 2.0 * rise * tail + rise**2 * risen
        without -= (sums[t] - rise * risen) ** 2 / t
        out[t - 1] = np.logaddexp.reduce(0.5 * (t - 1) * np.log(none / without))
    return out


def line_for(healthy_years: Iterable[Floats], alarms: int, rise: float, healthy: int) -> float:
    """Return the threshold at which so many (at least one) of the healthy robots alarm."""
    highest = [float(np.max(log_odds(values, rise, healthy))) for values in healthy_years]
    return sorted(highest)[-max(alarms, 1)]


def delay_of(values: Floats, rise: float, healthy: int, line: float, night: int) -> float | None:
    """Return the nights from the first risen one to the alarm; None where it alarms before."""
    crossed = np.flatnonzero(log_odds(values, rise, healthy) >= line)
    if not crossed.size:
        return float(values.size - night)
    return None if crossed[0] < night else float(crossed[0] - night + 1)


def known_scatter_odds(z: Floats, rise: float, healthy: int) -> Floats:
    """Return the same of one that is told the scatter, as siblings show it, and learns the level.

    The likelihood of a rise of `rise` scatters from night v on against none, the level integrated
    out of t nights of which s are risen, is exp(rise (sum of the risen ones less s times the mean)
    - rise^2 s (t - s) / (2 t)).

    Parameters
    ----------
    z : ndarray, shape (n,)
        Nights in units of the scatter.
    rise : float
        In that unit.
    healthy : int
        First nights that are told to be so.
    """
    sums = np.concatenate(([0.0], np.cumsum(z)))
    out = np.full(z.size, -np.inf)
    for t in range(healthy + 1, z.size + 1):
        risen = t - np.arange(healthy, t)
        tail = sums[t] - sums[healthy:t] - risen * sums[t] / t
        out[t - 1] = np.logaddexp.reduce(rise * tail - 0.5 * rise**2 * risen * (t - risen) / t)
    return out
