"""What was measured beside friction: gravity and inertia, which friction leaves alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.history.cycle import Cycle


@dataclass(frozen=True)
class Beside:
    """What was measured beside friction: changes of gravity and inertia, with deviations.

    Zero change with an infinite deviation where it is not known. `load_nm` and `inertia_kg_m2`
    are the healthy values; `payload_stated` tells whether now's payload is stated and the
    baseline's.
    """

    load_nm: float = math.nan
    load_change_nm: float = 0.0
    load_deviation_nm: float = math.inf
    inertia_kg_m2: float = math.nan
    inertia_change_kg_m2: float = 0.0
    inertia_deviation_kg_m2: float = math.inf
    payload_stated: bool = False


def beside_of(cycles: Sequence[Cycle], healthy: int, now: slice) -> Beside:
    """Return what gravity and inertia did from the healthy first cycles to those of now."""
    load = np.array([c.load_nm for c in cycles])
    inertia = np.array([c.inertia_kg_m2 for c in cycles])
    payload = np.array([c.payload_kg for c in cycles])
    before, latest = payload[:healthy], payload[now]
    stated = bool(
        np.all(np.isfinite(before))
        and np.all(latest >= before.min())
        and np.all(latest <= before.max())
    )
    load_level, load_change, load_deviation = _moved(load, healthy, now)
    level, change, deviation = _moved(inertia, healthy, now)
    return Beside(load_level, load_change, load_deviation, level, change, deviation, stated)


def _moved(values: Floats, healthy: int, now: slice) -> tuple[float, float, float]:
    """Return healthy mean, change since, and the change's deviation; infinite where unknown."""
    before, latest = values[:healthy], values[now]
    if not (np.all(np.isfinite(before)) and np.all(np.isfinite(latest))) or healthy < 3:
        return math.nan, 0.0, math.inf
    scatter = max(float(np.std(before, ddof=1)), 1e-3 * abs(float(before.mean())), 1e-12)
    deviation = scatter * math.sqrt(1.0 / latest.size + 1.0 / healthy)
    return float(before.mean()), float(latest.mean() - before.mean()), deviation
