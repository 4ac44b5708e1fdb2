"""The product's detector: Page's CUSUM on compensated features, tuned from the robot's own cycles.

    g_t = max(0, g_{t-1} + min(z_t - d_t, h / 2)),   d_t^2 = k^2 + (c s_t)^2,
    H0 from g_t > h until g_t = 0

z_t is the cycle's distance from the baseline in its own deviation, s_t the deviation of the error
that the compensation shares among like cycles (`standing`); k, h and c come from `tuning`. Noise
and the law's error are independent, so what is allowed for them adds as squares. The likelihood
ratio of a known rise is this sum up to a factor, which makes it optimal in Lorden's sense
(Moustakides 1986) where level and scatter are known.

What is added, and what it costs: one cycle adds at most half of the threshold, so a single bad
cycle is never an alarm and even a jump takes two cycles; a cycle that is missing changes nothing;
the sum is kept from growing so far that recovery would not show. All-clear is the zero of a second
sum, whose drift is half of the rise at most: after a short baseline k is larger, and a sum that
falls to zero so soon would let a rise that has begun into the baseline. The same sum of -z marks
where friction has fallen: no alarm, but another joint than the one that was learned. H1 is one more
sum of the low-speed friction, tuned to its own false-alarm rate and to half of `high_rise`, after
an H0, while the median of three cycles' rise, less what the shared error may be, is beyond
`high_rise`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from agent.identify.result import Floats
from agent.monitor.detection.decision import Marks
from agent.monitor.detection.series import FeatureSeries, Judgement, State, Trace
from agent.monitor.detection.standing import Standing, standing
from agent.monitor.detection.tuning import (
    NEAR_OPTIMUM,
    SOONEST_CYCLES,
    Target,
    Tuning,
    cycles_per_year,
    cycles_within,
    tune,
)

DECIDING = "low_integral_w"

_SHARES: Mapping[str, float] = {DECIDING: 0.75, "integral_w": 0.25}

_ONE_CYCLE = 0.501  # of the threshold: two cycles are enough, one never is
_RECENT = 3  # cycles whose median is the rise now
_HARDLY = 1.1  # times the least delay: a longer baseline would gain no more than that
_KEPT = 1.5  # of the threshold: the sum grows no further


@dataclass(frozen=True)
class Cusum:
    """A CUSUM for each of the tested features.

    Parameters
    ----------
    target : Target
        The rise worth finding and the false alarms accepted, shared among the features.
    features : mapping of str to float
        Tested for H0, each with its share of the accepted false alarms; those that a series does
        not carry are left out. Wear shows at low speed, which so has the greater share; the whole
        integral is there for what rises at high speed alone, such as a wrong oil.
    robust : bool
        Let no single cycle add more than half of the threshold.
    """

    target: Target = field(default_factory=Target)
    features: Mapping[str, float] = field(default_factory=lambda: dict(_SHARES))
    robust: bool = True

    @property
    def name(self) -> str:
        """Return the word for it."""
        return "cusum"

    def tunings(self, series: FeatureSeries) -> dict[str, Tuning]:
        """Return what each tested feature's CUSUM is tuned to, and what it promises."""
        return {name: tuning for name, (_, tuning) in self._tuned(series).items()}

    def promise(self, series: FeatureSeries) -> str:
        """Return what is found after this baseline, how soon, and when it will be sooner."""
        found, tuning = self._tuned(series)[DECIDING]
        if found is None or not tuning.decidable:
            return tuning.sentence
        if tuning.delay_cycles <= SOONEST_CYCLES:
            return f"{tuning.sentence}; sooner is not possible, for no single cycle decides"
        ratio = tuning.delay_cycles / tuning.known_delay_cycles
        said = f"{tuning.sentence}; the delay is {ratio:.2f} times the least possible"
        if ratio <= NEAR_OPTIMUM:
            return said
        enough = cycles_within(found, tuning, cycles_per_year(series))
        if enough is None:
            return f"{said}, and no baseline brings it to {NEAR_OPTIMUM:g} times"
        enough += found.left_out
        return f"{said}; from {enough} healthy cycles on at most {NEAR_OPTIMUM:g} times"

    def judge(self, series: FeatureSeries) -> Judgement:
        """Return the state at each cycle; where tuning is not decidable, no fault throughout."""
        traces: dict[str, Trace] = {}
        increased = np.zeros(series.time_s.size, dtype=np.bool_)
        high = np.zeros_like(increased)
        clear = np.ones_like(increased)
        fallen = np.zeros_like(increased)
        enough = True
        for name, (found, tuning) in self._tuned(series).items():
            if found is None or not tuning.decidable:
                continue
            sums = self._sums(
                found, tuning.drift, tuning.allowance, tuning.increased, series.healthy
            )
            traces[name] = Trace(sums, np.full_like(sums, tuning.increased))
            increased |= until_zero(sums, tuning.increased)
            half = min(tuning.drift, 0.5 * tuning.rise * found.level / found.scatter)
            strict = self._sums(found, half, tuning.allowance, tuning.increased, series.healthy)
            clear &= strict <= 0.0
            falls = self._sums(
                replace(found, z=-found.z),
                tuning.drift,
                tuning.allowance,
                tuning.increased,
                series.healthy,
            )
            fallen |= until_zero(falls, tuning.increased)
            if name == DECIDING:
                enough = tuning.delay_cycles <= _HARDLY * tuning.known_delay_cycles
                rise = recent_median(found.rise(tuning.high_allowance))
                far = self._sums(
                    found, tuning.high_drift, tuning.high_allowance, tuning.high, series.healthy
                )
                high = (far > tuning.high) & (rise > self.target.high_rise)
        states = warned_states(increased, high)
        return Judgement(
            self.name,
            states,
            traces,
            clear if traces else None,
            learned_enough=enough,
            fallen=fallen if traces else None,
        )

    def _tuned(self, series: FeatureSeries) -> dict[str, tuple[Standing | None, Tuning]]:
        tested = {name: s for name, s in self.features.items() if name in series.values}
        per_year, whole = cycles_per_year(series), sum(tested.values())
        out = {}
        for name, share in tested.items():
            found = standing(series, name)
            out[name] = (found, tune(found, self.target, per_year, share / whole))
        return out

    def _sums(
        self, found: Standing, drift: float, allowance: float, threshold: float, healthy: int
    ) -> Floats:
        """Return g at each cycle; it starts after the baseline, whose cycles set the level."""
        steps = found.z - np.hypot(drift, allowance * found.shared)
        steps[:healthy] = -np.inf
        if self.robust:
            steps = np.minimum(steps, _ONE_CYCLE * threshold)
        kept = _KEPT * threshold
        out = np.empty_like(steps)
        g = 0.0
        for i, step in enumerate(np.where(np.isnan(steps), 0.0, steps).tolist()):
            g = min(max(0.0, g + step), kept)
            out[i] = g
        return out


def until_zero(sums: Floats, threshold: float) -> Marks:
    """Return where a sum has crossed its threshold and not yet come back to zero, shape (n,)."""
    marks = np.zeros(sums.size, dtype=np.bool_)
    crossed = False
    for i, g in enumerate(sums.tolist()):
        crossed = g > threshold or (crossed and g > 0.0)
        marks[i] = crossed
    return marks


def recent_median(rise: Floats) -> Floats:
    """Return the median of each cycle and the two before it that carry the feature, shape (n,)."""
    out = np.full_like(rise, np.nan)
    carried = np.flatnonzero(np.isfinite(rise))
    if carried.size >= _RECENT:
        out[carried[_RECENT - 1 :]] = np.median(sliding_window_view(rise[carried], _RECENT), axis=1)
    last = np.maximum.accumulate(np.where(np.isfinite(out), np.arange(rise.size), 0))
    return out[last]


def warned_states(increased: Marks, high: Marks) -> tuple[State, ...]:
    """Return the states: H1 only where the cycle before it was no longer without fault."""
    states: list[State] = []
    for i, h in zip(increased.tolist(), high.tolist(), strict=True):
        warned = bool(states) and states[-1] is not State.NO_FAULT
        states.append(State.HIGH if h and warned else State.INCREASED if i or h else State.NO_FAULT)
    return tuple(states)
