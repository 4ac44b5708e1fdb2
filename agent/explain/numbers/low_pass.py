"""A late torque's numbers, all columns late together: how late, and what a low-pass has of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.search import Library
from agent.explain.forms.signal import CLOSELY_S, nearest_delay
from agent.explain.numbers.noisier import inertia_at, noisier
from agent.explain.rows.evidence import solve
from agent.identify.result import Floats

_SHARES = (0.4, 0.8)  # of a delay, that a low-pass may have
_SHORTEST = 0.1  # of the one that was found first
_CLEARLY = 0.02  # of what is left: for less a delay is one
_BY_NOISE = 2.0  # times what the motion's noise alone makes of it: true ones gain far more


@dataclass(frozen=True)
class Late:
    """A model all of whose columns are as late as the torque.

    Parameters
    ----------
    library : Library
    raw : ndarray, shape (N, k)
        Its columns on time, at full rate; first of all those of the twin's own carried numbers.
    target : ndarray, shape (m,)
        Weighted.
    """

    library: Library
    raw: Floats
    target: Floats

    @cached_property
    def on_time(self) -> Floats:
        """Return the columns on time in the comparison's band, shape (n, k)."""
        return self.library.scene.table.band(self.raw)

    def weighted(self, late_s: float, lag_s: float = 0.0) -> Floats:
        """Return the columns as late as that, `lag_s` of it by a low-pass, weighted, (m, k)."""
        scene = replace(self.library.scene, late_s=late_s, lag_s=lag_s)
        return self.library.weighing.weighted(scene.table.band(scene.as_late(self.raw)))

    def fit(
        self, late_s: float, rows: NDArray[np.bool_], lag_s: float = 0.0
    ) -> tuple[float, Floats]:
        """Return what is left of some rows, shape (m,), and the columns' weights, shape (k,)."""
        return least(self.weighted(late_s, lag_s)[rows], self.target[rows])

    def left(self, late_s: float, rows: NDArray[np.bool_], lag_s: float = 0.0) -> float:
        """Return what is left of some rows."""
        return self.fit(late_s, rows, lag_s)[0]


def smoothed(
    late: Late, late_s: float, reach_s: float, rows: NDArray[np.bool_]
) -> tuple[float, float]:
    """Return a delay, and what a low-pass has of it: nothing where that leaves hardly less.

    Far below its corner a low-pass is a delay as long as its time constant; nearer to it what is
    fast is less late, and smaller. So is what a noisy motion's inertia is told to need: how much of
    that alone a low-pass would take is seen behind a motion that is noisier once more.

    Parameters
    ----------
    late : Late
    late_s : float
        The delay without a low-pass.
    reach_s : float
        How far from it others are looked for.
    rows : ndarray of bool, shape (m,)
        To be compared.
    """
    plain = late.left(late_s, rows)
    if late_s <= 0.0:  # the motion is late, and not what was filtered
        return late_s, 0.0
    best = plain, late_s, 0.0
    for share in _SHARES:
        found_s = nearest_delay(partial(_behind, late, rows, share), late_s, reach_s)
        if found_s > 0.0:
            best = min(best, (late.left(found_s, rows, share * found_s), found_s, share * found_s))
    left, found_s, lag_s = best
    if left >= (1.0 - _CLEARLY) * plain:
        return late_s, 0.0
    found_s, lag_s = _together(late, rows, found_s, lag_s)
    gain = plain - late.left(found_s, rows, lag_s)
    if gain < _BY_NOISE * _gain_by_noise(late, rows, late_s, (found_s, lag_s)):
        return late_s, 0.0
    return found_s, lag_s


def least(columns: Floats, target: Floats) -> tuple[float, Floats]:
    """Return the least sum of squares, and the weights of the columns that leave it."""
    theta = solve(columns.T @ columns, columns.T @ target)
    left = target - columns @ theta
    return float(left @ left), theta


def _behind(late: Late, rows: NDArray[np.bool_], share: float, late_s: float) -> float:
    # Where the torque is early nothing was filtered: a low-pass that foretells runs away.
    return late.left(late_s, rows, share * max(late_s, 0.0))


def _together(
    late: Late, rows: NDArray[np.bool_], late_s: float, lag_s: float
) -> tuple[float, float]:
    """Return where both lead together: one lengthens as the other gets shorter."""
    from scipy.optimize import minimize

    def error(parts: Floats) -> float:
        dead, lag = (float(part) for part in parts)
        return late.left(dead + lag, rows, lag)

    begun = np.array([late_s - lag_s, lag_s])
    found = minimize(
        error,
        begun,
        method="Nelder-Mead",
        bounds=[(-math.inf, math.inf), (_SHORTEST * lag_s, math.inf)],
        options={"xatol": CLOSELY_S, "fatol": 1e-4 * error(begun)},
    )
    dead, lag = (float(part) for part in found.x)
    return dead + lag, lag


def _gain_by_noise(
    late: Late, rows: NDArray[np.bool_], late_s: float, behind: tuple[float, float]
) -> float:
    """Return what a low-pass takes of a torque that is late alone, behind a noisier motion."""
    at, scene = inertia_at(late.library), late.library.scene
    if at < 0:
        return 0.0
    numbers = np.count_nonzero(scene.table.carried)
    theta = late.fit(late_s, rows)[1][:numbers]
    torque = late.weighted(late_s)[:, :numbers] @ theta
    gains = []
    for other in noisier(late.library):
        raw = late.raw.copy()
        raw[:, at] += other.library.scene.stiff_rad_s2 - scene.stiff_rad_s2
        noisy = Late(late.library, raw, torque)
        gains.append(noisy.left(late_s, rows) - noisy.left(behind[0], rows, behind[1]))
    return float(np.mean(gains))
