"""What grown joints of one kind show of a feature: what a young one like them may borrow.

A young joint's few cycles know neither what temperature and payload do, nor by how much cycles
scatter, nor how alike neighbouring ones are. Joints of the same type and axis that have grown past
their baselines show all of that (`siblings` learns it from them). They never show its level.

Nothing is believed for good. Beside what the kind shows stand the broad priors that are there
without it, with the share `UNLIKE` beforehand, and the joint's own cycles weigh the two: one that
is unlike its siblings loses what it borrowed, one like them moves to its own numbers as they come.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln
from scipy.stats import f as fisher
from scipy.stats import norm

from agent.identify.result import Floats
from agent.monitor.compensation.compensation import Basis, Conditions

FEWEST_SIBLINGS = 5
"""Grown joints below which nothing is learned of a kind: so few do not show how joints differ."""

UNLIKE = 0.2
"""Probability beforehand that a joint is not like its siblings."""

_LOG_SCATTERS = math.log(25.0)  # an unlike joint's variance: so far to either side of the kind's
_LOG_SIZES = math.log(3e3)  # of noise, 0.01 to 30 %: as likely anywhere where nothing is known


class Shape(NamedTuple):
    """One shape of the conditions' effect (`Basis.columns`) over joints of a kind.

    `share` of the joints have it; the coefficients' mean over joints is `middle`, shape (p,), and
    `covariance`, shape (p, p), that of one more joint about it. Shares of the level.
    """

    decay_k: float
    share: float
    middle: Floats
    covariance: Floats


@dataclass(frozen=True)
class Kind:
    """One feature of joints of one kind.

    Parameters
    ----------
    joints : int
        How many show it.
    basis : Basis
        The columns that the shapes' coefficients belong to.
    shapes : tuple of Shape
    scatter : float
        Of one cycle about its joint's law, as a share of the level.
    worth : float
        As many independent cycles know a joint's scatter as well as the kind does.
    tie : float
        Correlation of neighbouring cycles.
    tie_worth : float
        As many cycles know a joint's correlation as well as the kind does.
    """

    joints: int
    basis: Basis
    shapes: tuple[Shape, ...]
    scatter: float
    worth: float
    tie: float
    tie_worth: float

    def level_of(self, shape: Shape, conditions: Conditions, values: Floats) -> float:
        """Return the level at the kind's reference that n values of a joint come to."""
        columns = self.basis.columns(conditions, shape.decay_k)
        return float(np.median(values / np.maximum(1.0 + columns @ shape.middle, 0.1)))

    def borrowed(self, scatter: float, free: float) -> float:
        """Return as how many cycles the kind's scatter counts beside the joint's own.

        Parameters
        ----------
        scatter : float
            The joint's own, as a share of its level.
        free : float
            Degrees of freedom that it is known by.
        """
        ratio = (scatter / self.scatter) ** 2
        if free < 1.0 or ratio <= 0.0:
            return self.worth
        like = (1.0 - UNLIKE) * ratio * float(fisher.pdf(ratio, free, self.worth))
        return self.worth * like / (like + 0.5 * UNLIKE / _LOG_SCATTERS)

    def tie_borrowed(self, tie: float, cycles: int) -> float:
        """Return as how many cycles the kind's correlation counts beside what `cycles` show."""
        deviation = math.sqrt(1.0 / max(cycles, 1) + 1.0 / self.tie_worth)
        like = (1.0 - UNLIKE) * float(norm.pdf(tie, self.tie, deviation))
        return self.tie_worth * like / (like + 0.5 * UNLIKE)

    def log_size(self, sizes: Floats) -> Floats:
        """Return the logarithm of the density of the logarithm of a joint's noise, by size.

        A scaled inverse chi-squared law of the variance; `sizes` are shares of the level.
        """
        half = 0.5 * self.worth
        scale = half * self.scatter**2
        return np.asarray(
            math.log(2.0)
            + half * math.log(scale)
            - gammaln(half)
            - self.worth * np.log(sizes)
            - scale / sizes**2
        )

    def tie_shares(self, ties: Floats) -> Floats:
        """Return how likely each of some correlations is for a joint, summing to one."""
        like = norm.pdf(ties, self.tie, math.sqrt(1.0 / self.tie_worth)) + 1e-3
        return np.asarray(like / np.sum(like))


LOG_ANY_SIZE = -math.log(_LOG_SIZES)
"""The logarithm of that density where nothing is known."""

Kinds = Mapping[str, Kind]
"""What is shown of each feature; empty where no joints of the kind are known."""


@dataclass(frozen=True)
class Siblings:
    """Joints of one kind as one of them sees the others.

    Parameters
    ----------
    grown : tuple of str
        Those that have lived long enough to teach.
    known : int
        How many there are, young and worn ones as well.
    kinds : mapping of str to Kind
        What they show; empty where too few are grown.
    """

    grown: tuple[str, ...] = ()
    known: int = 0
    kinds: Kinds = field(default_factory=dict)
