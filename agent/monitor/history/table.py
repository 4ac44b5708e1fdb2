"""The features of many cycles side by side, with what the cycles were run under."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from agent.identify.result import Floats
from agent.monitor.compensation.compensation import Conditions, Index
from agent.monitor.compensation.kind import Kinds
from agent.monitor.detection.series import FEATURES
from agent.monitor.history.cycle import Cycle
from agent.monitor.history.features import CycleFeatures

_NONE: Kinds = MappingProxyType({})


@dataclass(frozen=True)
class Features:
    """Features of n cycles as arrays, each of shape (n,), with what they were run under.

    `kinds` is what grown joints of the same kind show, if any are known.
    """

    values: Mapping[str, Floats]
    deviations: Mapping[str, Floats]
    conditions: Conditions
    kinds: Kinds = field(default_factory=dict)

    def take(self, which: slice | Index) -> Features:
        """Return some of the cycles."""
        return Features(
            {k: v[which] for k, v in self.values.items()},
            {k: v[which] for k, v in self.deviations.items()},
            self.conditions.take(which),
            self.kinds,
        )

    @property
    def count(self) -> int:
        """Return how many cycles there are."""
        return int(self.conditions.temperature_degc.size)


def features_table(
    cycles: Sequence[Cycle], features: Sequence[CycleFeatures], kinds: Kinds = _NONE
) -> Features:
    """Return features and conditions of cycles, side by side, and what joints alike show."""
    return Features(
        {name: np.array([f.values[name] for f in features]) for name in FEATURES},
        {name: np.array([f.deviations[name] for f in features]) for name in FEATURES},
        conditions_of(cycles),
        kinds,
    )


def conditions_of(cycles: Sequence[Cycle]) -> Conditions:
    """Return what cycles were run under."""
    return Conditions(
        np.array([c.temperature_degc for c in cycles], dtype=np.float64),
        np.array([c.payload_kg for c in cycles], dtype=np.float64),
        np.array([c.load_nm for c in cycles], dtype=np.float64),
    )
