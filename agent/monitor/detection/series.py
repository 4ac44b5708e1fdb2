"""What a detector is given and what it answers: features of one joint over its cycles, and states.

A series is one joint under one baseline: a swap or an oil change starts a new one. Its values are
already at the reference temperature and load (`compensation`); what a detector makes of them is
its own affair.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.monitor.compensation.kind import Kinds

FEATURES: Mapping[str, str] = {
    "coulomb_nm": "Coulomb friction",
    "viscous_nm_s_per_rad": "viscous friction",
    "integral_w": "integral of the friction curve over velocity",
    "low_integral_w": "the low-speed part of that integral",
}


class State(Enum):
    """The behavioural modes of thesis section 6.2.3."""

    NO_FAULT = "NF"
    INCREASED = "H0"
    HIGH = "H1"


@dataclass(frozen=True)
class FeatureSeries:
    """The features of one joint's cycles, in order of time.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Rising; counted from the first cycle.
    values, deviations : mapping of str to ndarray, shape (n,)
        Each feature of `FEATURES` (those that the cycles carry) and its standard deviation, that
        of compensation included. NaN where a cycle does not carry it.
    shared : mapping of str to ndarray, shape (n,)
        The part of each deviation that all cycles under the same conditions have in common,
        because the compensation may be off there: it does not average away. Features that are
        not in it have what their deviations grow beyond the baseline's usual one.
    healthy : int
        How many of the first cycles are the baseline, held to be without fault.
    kinds : mapping of str to Kind
        What grown joints of the same kind show of each feature, if any are known.

    Raises
    ------
    ValueError
        Shapes that do not belong together, time that does not rise, a baseline of no cycles or of
        more than there are.
    """

    time_s: Floats
    values: Mapping[str, Floats]
    deviations: Mapping[str, Floats]
    healthy: int
    shared: Mapping[str, Floats] = field(default_factory=dict)
    kinds: Kinds = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = self.time_s.size
        parts = (self.values, self.deviations, self.shared)
        shapes = {a.shape for m in parts for a in m.values()}
        names = self.values.keys()
        if shapes - {(n,)} or names != self.deviations.keys() or self.shared.keys() - names:
            raise ValueError(f"expected a value and a deviation for each of {n} cycles")
        if np.any(np.diff(self.time_s) <= 0.0):
            raise ValueError("expected the cycles in order of time, each later than the last")
        if not 1 <= self.healthy <= n:
            raise ValueError(f"expected 1 to {n} healthy cycles, got {self.healthy}")


@dataclass(frozen=True)
class Trace:
    """A test statistic and its threshold at each cycle, both of shape (n,)."""

    statistic: Floats
    threshold: Floats


@dataclass(frozen=True)
class Judgement:
    """What a detector says at each cycle, knowing nothing of later ones.

    `states` has one entry a cycle; `traces` the statistic of each feature that was tested; `clear`,
    shape (n,), marks the cycles at which nothing that was seen speaks for a rise, and is None for a
    detector that has no such mark. `rising`, shape (n,), marks those at which the alarm is that of
    friction which rises from the first cycle on (`first_cycles`); None where that was not asked.
    `fallen`, shape (n,), marks those at which friction has clearly fallen below the baseline: no
    alarm, but no cycle to learn from; None for a detector that does not look. `learned_enough`
    tells whether a longer baseline would hardly find a rise sooner.
    """

    detector: str
    states: tuple[State, ...]
    traces: Mapping[str, Trace]
    clear: NDArray[np.bool_] | None = None
    rising: NDArray[np.bool_] | None = None
    learned_enough: bool = True
    fallen: NDArray[np.bool_] | None = None

    def first(self, state: State) -> int | None:
        """Return the index of the first cycle in a state, or None."""
        return next((i for i, s in enumerate(self.states) if s is state), None)


class Detector(Protocol):
    """A stopping rule and its decision: causal, deterministic, without memory between calls."""

    @property
    def name(self) -> str:
        """Return the word for it in reports and JSON."""

    def judge(self, series: FeatureSeries) -> Judgement:
        """Return the state at each cycle, each from that cycle and the ones before it."""
