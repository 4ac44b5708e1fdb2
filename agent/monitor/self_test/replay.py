"""Replays of a joint's own healthy cycles, with a known rise that must be caught from a cycle on.

Each replay is a joint as the healthy history allows it to be. The law of the conditions is learned
from all healthy cycles once; what they leave comes back in blocks of neighbours (circular block
bootstrap, Politis and Romano 1992), under conditions drawn in blocks of their own, so that no night
is both learned from and judged. So few cycles know their scatter only roughly: each replay's is
drawn from what they leave open (chi-squared). The replay then goes through the chain that judges a
history: a baseline as long as the joint's is now, the compensation learned from it, the detector.
The features are linear in friction, so that a rise adds its own features to each later cycle's;
that is checked by estimating injected recordings anew (`injection.responses`).

Each replay has a smallest rise that it catches in time. As each stands for what the joint may be,
the rise that 95 % of them catch is caught with 95 % the next time: it is read off a curve of the
share that is caught over the rise (`intervals.catching`), and its interval is widened by
what so many healthy cycles leave open of their scatter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import (
    PARAMETERS,
    Baseline,
    baseline_of,
    compensated,
    series_of,
)
from agent.monitor.baseline.growth import LAG, watched
from agent.monitor.compensation.compensation import Compensated, Law
from agent.monitor.detection.series import FEATURES, Detector, Judgement, State
from agent.monitor.history.table import Features
from agent.monitor.self_test.injection import SHAPES, rise_of
from agent.monitor.self_test.intervals import apart, catching, wilson
from agent.monitor.self_test.result import CAUGHT, Catch, FalseAlarms, Healthy, SelfTest

FEWEST = 12  # healthy cycles: fewer replay nothing but themselves
_LARGEST = 2.0  # of the low-speed friction: a rise beyond is no small one
_SMALLEST = 0.001
_RESOLUTION = 1.2  # between a rise that is caught and one that is missed
_AFTER = 60  # cycles after the baseline on which false alarms are counted
_YEAR_S = 365.25 * 86_400.0


def self_test(
    healthy: Healthy,
    detector: Detector,
    *,
    stated: float = 0.10,
    within: int = 20,
    replays: int = 120,
    seed: int = 1,
    asked: int | None = None,
    gains: Mapping[str, Mapping[str, float]] | None = None,
) -> SelfTest:
    """Inject rises into replays and count which are caught.

    Parameters
    ----------
    healthy : Healthy
    detector : Detector
        The one that judges the history.
    stated : float
        The rise that must be caught, as a share of low-speed friction.
    within : int
        Cycles after the rise in which it counts as caught in time.
    replays, seed : int
        How many, and what they are drawn by.
    asked : int, optional
        The baseline's length, where the user gives it.
    gains : mapping of shape to (mapping of feature to float), optional
        What re-estimated recordings showed of the features' response, as a share of the
        computed one; 1 without it.

    Raises
    ------
    ValueError
        A stated rise, a number of cycles or of replays that makes no sense.
    """
    if not (0.0 < stated <= _LARGEST and within >= 1 and replays >= 20):
        raise ValueError(
            f"expected a rise up to {_LARGEST:g}, at least one cycle and 20 replays, got {stated}, "
            f"{within} and {replays}"
        )
    count = healthy.features.count
    baseline = baseline_of(healthy.features, asked)
    block = max(2, round(count ** (1.0 / 3.0)))
    if count < FEWEST or not baseline.enough:
        needed = max(FEWEST, baseline.needed)
        reason = f"{count} of {needed} healthy cycles"
        return SelfTest(reason, count, baseline.cycles, 0, within, block)
    length = watched(healthy.features, healthy.time_s, baseline, detector)[0].cycles
    source, rng = _source(healthy, block), np.random.default_rng(seed)
    usable = [_replay(source, length, within, rng) for _ in range(replays)]
    # A replay that has an alarm before the rise is a false alarm's, and catches nothing.
    quiet = [r for r in usable if r.alarm(detector, {}, r.onset) is None]
    reason = _unable(usable, quiet, detector, within)
    if reason:
        return SelfTest(reason, count, length, len(usable), within, block)
    catches = tuple(
        _catch(
            shape,
            quiet,
            healthy,
            _Trial(_added(shape, healthy, (gains or {}).get(shape, {})), detector, within),
            stated,
        )
        for shape in SHAPES
    )
    alarms = _false_alarms(usable, healthy, detector)
    return SelfTest("", count, length, len(quiet), within, block, catches, alarms)


def _unable(
    usable: Sequence[_Replay],
    quiet: Sequence[_Replay],
    detector: Detector,
    within: int,
) -> str:
    """Return why the replays show nothing; empty where they do."""
    if not any(r.judged(detector, {}, r.onset + within).traces for r in usable[:5]):
        return "the detector has no threshold for cycles that scatter as these do"
    if len(quiet) < len(usable) // 2:
        return f"{len(usable) - len(quiet)} of {len(usable)} replays have an alarm before any rise"
    return ""


@dataclass(frozen=True)
class _Replay:
    """One drawn history of n cycles at reference conditions; a rise begins at cycle `onset`.

    `without` is the history without it: features are linear, and a rise adds its own.
    """

    time_s: Floats
    without: Mapping[str, Compensated]
    baseline: Baseline
    onset: int

    def judged(self, detector: Detector, added: Mapping[str, float], stop: int) -> Judgement:
        """Return what the chain says of the first `stop` cycles with a rise's features added."""
        late = np.arange(stop) >= self.onset
        found = {
            name: Compensated(
                one.value[:stop] + added.get(name, 0.0) * late,
                one.own_deviation[:stop],
                one.shared_deviation[:stop],
                one.extrapolated[:stop],
            )
            for name, one in self.without.items()
        }
        return detector.judge(series_of(self.time_s[:stop], found, self.baseline))

    def alarm(self, detector: Detector, added: Mapping[str, float], stop: int) -> int | None:
        """Return the first cycle after the baseline, before `stop`, that has an alarm."""
        states = self.judged(detector, added, stop).states
        after = range(self.baseline.cycles, stop)
        return next((i for i in after if states[i] is not State.NO_FAULT), None)


@dataclass(frozen=True)
class _Source:
    """What replays are drawn from: the healthy cycles, and what the law leaves of each."""

    healthy: Healthy
    laws: Mapping[str, Law]
    left: Mapping[str, Floats]
    block: int

    def drawn(self, length: int, rng: np.random.Generator) -> Features:
        """Return so many cycles of a joint like this one."""
        given, under = self.healthy.features, self._blocks(length, rng)
        nights, free = self._blocks(length, rng), given.count - PARAMETERS
        wider = math.sqrt(given.count / rng.chisquare(free))
        conditions = given.conditions.take(under)
        values = {
            name: law.level + law.effect(conditions)[0] + wider * self.left[name][nights]
            for name, law in self.laws.items()
        }
        stated = {name: deviation[nights] for name, deviation in given.deviations.items()}
        return Features(values, stated, conditions)

    def _blocks(self, length: int, rng: np.random.Generator) -> NDArray[np.int64]:
        count = self.healthy.features.count
        starts = rng.integers(0, count, math.ceil(length / self.block))
        return ((starts[:, np.newaxis] + np.arange(self.block)) % count).ravel()[:length]


def _source(healthy: Healthy, block: int) -> _Source:
    """Learn the law of the conditions from all healthy cycles."""
    given = healthy.features
    laws = baseline_of(given, given.count).laws
    left = {
        name: given.values[name] - law.level - law.effect(given.conditions)[0]
        for name, law in laws.items()
    }
    return _Source(healthy, laws, left, block)


def _replay(source: _Source, baseline: int, within: int, rng: np.random.Generator) -> _Replay:
    """Draw a history whose rise begins some cycles after its baseline."""
    # The rise may begin at once or later: what the detector has summed up by then is its own.
    onset = baseline + LAG + int(rng.integers(1, 2 * source.block + 1))
    drawn = source.drawn(max(onset + within, baseline + _AFTER), rng)
    time_s = source.healthy.interval_s * np.arange(drawn.count, dtype=np.float64)
    learned = baseline_of(drawn, baseline)
    return _Replay(time_s, compensated(drawn, learned), learned, onset)


@dataclass(frozen=True)
class _Trial:
    """What a rise of a share of low-speed friction adds to the features, and how it is caught."""

    unit: Mapping[str, float]
    detector: Detector
    within: int

    def delay(self, replay: _Replay, share: float) -> int | None:
        """Return the cycles from the rise to its alarm; None where it comes late or too early."""
        added = {name: share * value for name, value in self.unit.items()}
        alarm = replay.alarm(self.detector, added, replay.onset + self.within)
        return alarm - replay.onset if alarm is not None and alarm >= replay.onset else None

    def bracket(self, replay: _Replay, guess: float) -> tuple[float, float]:
        """Return the largest share that is missed and the smallest that is caught, a fifth apart.

        Nothing is missed below `_SMALLEST` (0), nor caught beyond `_LARGEST` (infinite). Widened
        by half from a guess, then halved on a scale of ratios.
        """
        missed, caught = 0.0, math.inf
        share = guess
        while caught > _RESOLUTION * missed and _SMALLEST <= share <= _LARGEST:
            if self.delay(replay, share) is None:
                missed = share
                share = 1.5 * share if math.isinf(caught) else math.sqrt(missed * caught)
            else:
                caught = share
                share = share / 1.5 if missed == 0.0 else math.sqrt(missed * caught)
        return missed, caught


def _catch(
    shape: str,
    replays: Sequence[_Replay],
    healthy: Healthy,
    trial: _Trial,
    stated: float,
) -> Catch:
    """Find what is caught of one shape."""
    delays = [trial.delay(r, stated) for r in replays]
    known = [d for d in delays if d is not None]
    share = len(known) / len(replays)
    brackets: list[tuple[float, float]] = []
    for replay in replays:
        finite = [caught for _, caught in brackets if math.isfinite(caught)]
        brackets.append(trial.bracket(replay, float(np.median(finite)) if finite else stated))
    missed, caught = np.array(brackets).T
    found, low, high = catching(missed, caught, CAUGHT)
    if found > _LARGEST:
        found = low = high = math.inf
    # What n cycles scatter by is itself known to a share of 1 / sqrt(2 n) only.
    doubt = 1.96 / math.sqrt(2.0 * (healthy.features.count - 1.0))
    return Catch(
        shape,
        100.0 * found,
        (100.0 * apart(found, low, -doubt), 100.0 * apart(found, high, doubt)),
        found * healthy.low_mean_nm,
        100.0 * stated,
        share,
        wilson(len(known), len(replays)),
        float(np.median(known)) if known else math.nan,
    )


def _added(shape: str, healthy: Healthy, gains: Mapping[str, float]) -> dict[str, float]:
    """Return what a rise as large as the low-speed friction itself adds to each feature."""
    rise = rise_of(shape, healthy.low_mean_nm, healthy.grid)
    added = healthy.grid.rows() @ rise.torque_nm(healthy.grid.speed_rad_s)
    return {
        name: gains.get(name, 1.0) * value
        for name, value in zip(FEATURES, added.tolist(), strict=True)
    }


def _false_alarms(replays: Sequence[_Replay], healthy: Healthy, detector: Detector) -> FalseAlarms:
    """Count alarms without a rise, on the first cycles after each baseline."""
    from scipy.special import gammaincinv

    alarms = cycles = 0
    for replay in replays:
        stop = replay.baseline.cycles + _AFTER
        first = replay.alarm(detector, {}, stop)
        alarms += first is not None
        cycles += (stop if first is None else first + 1) - replay.baseline.cycles
    years = cycles * healthy.interval_s / _YEAR_S
    low = float(gammaincinv(alarms, 0.025)) if alarms else 0.0
    high = float(gammaincinv(alarms + 1, 0.975))
    return FalseAlarms(alarms, cycles, alarms / years, (low / years, high / years))
