"""How many healthy cycles it takes, what they teach, and the series that detectors are given."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

from agent.identify.result import Floats
from agent.monitor.compensation.compensation import PRIORS, Compensated, Law
from agent.monitor.compensation.fit import learn
from agent.monitor.compensation.kind import Kinds
from agent.monitor.detection.series import FEATURES, FeatureSeries
from agent.monitor.history.features import SpeedGrid
from agent.monitor.history.table import Features

LEAST, MOST = 8, 60
FEWEST_ASKED = 3
SHARE = 0.005
PARAMETERS = 3
_NORMAL_95 = 1.6448536269514722
_RULING = ("coulomb_nm", "integral_w", "low_integral_w")


@dataclass(frozen=True)
class Baseline:
    """The healthy cycles and what they teach.

    Parameters
    ----------
    cycles : int
        How many of the first cycles are taken to be healthy; while nothing is suspected it grows
        beyond what is needed (`agent.monitor.baseline.growth`).
    needed : int
        How many it takes to begin with.
    laws : mapping of str to Law
        Of each feature; empty where there are fewer cycles than needed.
    asked : bool
        Whether the number was given instead of chosen.
    standard_error : float
        Of the healthy mean, as a share, at its upper end, for the least sure deciding feature.
    kinds : mapping of str to Kind
        What grown joints of the same kind show, if any are known.
    """

    cycles: int
    needed: int
    laws: Mapping[str, Law]
    asked: bool
    standard_error: float = math.nan
    kinds: Kinds = field(default_factory=dict)

    @property
    def enough(self) -> bool:
        """Return whether there are as many as needed."""
        return self.cycles >= self.needed


def baseline_of(features: Features, asked: int | None = None) -> Baseline:
    """Choose the baseline's length and learn from it.

    The rule: the first n >= 8 cycles of which every deciding feature's mean has a standard error
    of at most 0.5 % of it, even where the cycles scatter more than they have shown yet; and 60
    where that is never so. Later cycles have no say in it.

    Parameters
    ----------
    features : Features
        Of one segment's cycles, in order of time.
    asked : int, optional
        A length given by the user, in place of the rule.

    Raises
    ------
    ValueError
        Fewer than three cycles are asked for.
    """
    if asked is not None and asked < FEWEST_ASKED:
        raise ValueError(f"a baseline needs at least {FEWEST_ASKED} cycles, got {asked}")
    have = features.count
    length = LEAST if asked is None else asked
    while True:
        if have < length:
            return Baseline(have, length, {}, asked is not None, kinds=features.kinds)
        healthy = features.take(slice(0, length))
        laws = _laws(healthy)
        error = _standard_error(laws)
        if asked is not None or error <= SHARE or length >= MOST:
            return Baseline(length, length, laws, asked is not None, error, features.kinds)
        wanted = math.ceil(length * (error / SHARE) ** 2)
        length = min(MOST, max(length + 1, min(wanted, 2 * length)))


def lengthened(
    baseline: Baseline, features: Features, cycles: int, names: Collection[str]
) -> Baseline:
    """Return a baseline that has learned these features from so many of the first cycles."""
    if cycles == baseline.cycles:
        return baseline
    laws = _laws(features.take(slice(0, cycles)), names)
    return replace(baseline, cycles=cycles, laws=laws, standard_error=_standard_error(laws))


def _laws(healthy: Features, names: Collection[str] = FEATURES) -> dict[str, Law]:
    return {
        name: learn(
            healthy.conditions,
            healthy.values[name],
            healthy.deviations[name],
            PRIORS[name],
            healthy.kinds.get(name),
        )
        for name in names
    }


def _standard_error(laws: Mapping[str, Law]) -> float:
    """Return the least sure deciding mean's standard error as a share, as large as it may well be.

    A few cycles may agree by luck, and a rule that stops at the first luck would stop too early:
    the scatter is taken at the upper end of its one-sided 95 % interval.
    """
    ruling = [law for name, law in laws.items() if name in _RULING]
    free = max(ruling[0].cycles - PARAMETERS, 2)
    third = 2.0 / (9.0 * free)  # Wilson and Hilferty's chi square, PNAS 17 (1931) 684
    luck = (1.0 - third - _NORMAL_95 * math.sqrt(third)) ** 3
    share = max(law.level_deviation / max(abs(law.level), 1e-300) for law in ruling)
    return share / math.sqrt(luck)


def compensated(features: Features, baseline: Baseline) -> dict[str, Compensated]:
    """Bring every feature to the baseline's reference conditions."""
    return {
        name: law.compensate(features.conditions, features.values[name], features.deviations[name])
        for name, law in baseline.laws.items()
    }


def series_of(
    time_s: Floats, found: Mapping[str, Compensated], baseline: Baseline
) -> FeatureSeries:
    """Return what a detector is given: values at the reference, each with all that is unsure of it.

    A law that is off makes every cycle under the same conditions wrong by the same amount, which
    no averaging takes away: that part is said apart (`FeatureSeries.shared`).
    """
    return FeatureSeries(
        time_s - time_s[0],
        {name: one.value for name, one in found.items()},
        {name: one.deviation for name, one in found.items()},
        baseline.cycles,
        {name: one.shared_deviation for name, one in found.items()},
        baseline.kinds,
    )


def mean_rows(grid: SpeedGrid) -> dict[str, Floats]:
    """Return what makes the mean friction torque at low and at high speed of a curve, each (m,)."""
    low, high = grid.low_row(), grid.high_row()
    whole = low + high
    return {
        "low": low / low.sum(),
        "high": high / high.sum(),
        "whole": whole / whole.sum(),
    }
