"""The thesis's decision: which tests make which state (section 6.2.3).

- H1 (T2): the integral beyond its threshold at the last three cycles, and the low integral and
  Coulomb friction beyond theirs now;
- H0 (T1): the low integral beyond its threshold at the last two cycles;
- NF (T0): all else.

The test of several cycles in a row is what makes one bad cycle harmless, and what puts H0 one
cycle before H1 where all three cross at once.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.monitor.detection.series import FeatureSeries, State

DECIDING = ("coulomb_nm", "integral_w", "low_integral_w")

Marks = NDArray[np.bool_]


def in_a_row(marks: Marks, count: int) -> Marks:
    """Return where `count` marks in a row end; both arrays have shape (n,)."""
    out = marks.copy()
    for back in range(1, count):
        out[back:] &= marks[:-back]
        out[:back] = False
    return out


def decide(exceeds: Mapping[str, Marks]) -> tuple[State, ...]:
    """Return the state at each cycle from where each feature is beyond its threshold.

    Parameters
    ----------
    exceeds : mapping of str to ndarray of bool, shape (n,)
        For each feature of `DECIDING`.
    """
    low, whole, coulomb = (exceeds[name] for name in ("low_integral_w", "integral_w", "coulomb_nm"))
    high = in_a_row(whole, 3) & low & coulomb
    increased = in_a_row(low, 2)
    return tuple(
        State.HIGH if h else State.INCREASED if i else State.NO_FAULT
        for h, i in zip(high, increased, strict=True)
    )


def whole_cycles(series: FeatureSeries) -> Marks:
    """Return which cycles carry every deciding feature, shape (n,).

    Raises
    ------
    ValueError
        If the series does not carry a deciding feature at all.
    """
    missing = [name for name in DECIDING if name not in series.values]
    if missing:
        raise ValueError(
            f"expected the features {', '.join(DECIDING)}; {', '.join(missing)} missing"
        )
    carried: Marks = np.all(np.isfinite([series.values[name] for name in DECIDING]), axis=0)
    return carried


def held(values: Floats, present: Marks) -> Floats:
    """Spread what was found at the present cycles over all: a missing cycle changes nothing.

    Parameters
    ----------
    values : ndarray, shape (m,)
        At the cycles that are present.
    present : ndarray of bool, shape (n,)
        True m times.

    Returns
    -------
    ndarray, shape (n,)
        Before the first present cycle, NaN.
    """
    last = np.cumsum(present) - 1
    padded = np.append(values, np.nan)
    return np.where(last >= 0, padded[last], np.nan)


def held_states(states: tuple[State, ...], present: Marks) -> tuple[State, ...]:
    """Spread the states of the present cycles over all; before the first there is no fault."""
    last = (np.cumsum(present) - 1).tolist()
    return tuple(states[i] if i >= 0 else State.NO_FAULT for i in last)
