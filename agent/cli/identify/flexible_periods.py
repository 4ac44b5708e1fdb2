"""Recordings as the flexible joint is fitted to them: averaged over their periods (thesis 4.2.1).

A mean laid end to end twice would count its noise twice, and its intervals would come out too
narrow by the root of two; a block of several distinct periods needs no second copy.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.conclude.outcome import signals_of
from agent.identify.flexible.periods import LAID, PeriodScatter, average_periods
from agent.identify.signals.arrays import Signals
from agent.record.recording import Recording

_BLOCK_S = 2.2  # of distinct periods that are fitted: the fit refuses less than two seconds
_REPEATS = 0.05  # of the velocity: what periods may differ by


@dataclass(frozen=True)
class Source:
    """One recording as it is fitted.

    Parameters
    ----------
    signals : Signals
        The recording, or the mean of its periods.
    period_s : float
        Of the recording; NaN where it is not periodic.
    scatter : PeriodScatter or None
        How many periods were averaged, and what they do not share.
    means : tuple of Signals
        Of a periodic recording: means of two periods each, laid end to end.
    """

    signals: Signals
    period_s: float = math.nan
    scatter: PeriodScatter | None = None
    means: tuple[Signals, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return how the recording was fitted, as plain JSON."""
        averaged = None
        if self.scatter is not None:
            averaged = {
                "periods": self.scatter.periods,
                "period_s": self.period_s,
                "torque_scatter_nm": self.scatter.torque_nm,
            }
        return {"recording": self.signals.name, "averaged": averaged}


def source_of(recording: Recording) -> Source:
    """Return a recording as it is fitted: averaged over its periods where it has some.

    The period is what the recording's own trajectory says; the motion must bear it out.
    """
    signals = signals_of(recording)
    parameters = recording.metadata.trajectory.get("parameters")
    named = parameters if isinstance(parameters, Mapping) else {}
    values = [named.get(key) for key in ("period_s", "first_period_s", "periods")]
    numbers = [float(v) for v in values if isinstance(v, int | float) and math.isfinite(v)]
    if len(numbers) < len(values) or numbers[0] <= 0.0 or not signals.time_s.size:
        return Source(signals)
    period_s, lead_s, periods = numbers
    # The first period is left out: the arm still rings from the way there.
    first_s = float(signals.time_s[0]) + lead_s + period_s
    whole = _between(signals, first_s - period_s, first_s + (periods - 0.99) * period_s)
    return _averaged(signals, whole, period_s, first_s)


def _averaged(signals: Signals, whole: Signals, period_s: float, first_s: float) -> Source:
    """Return the mean over blocks of several periods, once."""
    if whole.time_s.size < 2 or not _repeats(whole, period_s):
        return Source(signals)
    there = math.floor((float(whole.time_s[-1]) - first_s) / period_s + 1e-6)
    block = max(2, math.ceil(_BLOCK_S / period_s))
    if there < 2 * block:
        return Source(signals)
    laid, scatter = average_periods(whole, period_s=block * period_s, first_s=first_s)
    once = laid.time_s.size // LAID
    mean = _where(laid, np.arange(laid.time_s.size) < once)
    pairs = []
    for k in range(there // 2):
        start = first_s + 2 * k * period_s
        pair = _between(whole, start - 0.1 * period_s, start + 2.1 * period_s)
        pairs.append(average_periods(pair, period_s=period_s, first_s=start)[0])
    count = scatter.periods * block
    return Source(mean, period_s, PeriodScatter(count, scatter.torque_nm), tuple(pairs))


def _repeats(signals: Signals, period_s: float) -> bool:
    """Return whether the motion is the same a period later."""
    known = _where(signals, signals.valid)
    time_s, velocity = known.time_s, known.velocity_rad_s
    if velocity is None:
        assert known.position_rad is not None
        velocity = np.gradient(known.position_rad, time_s)
    early = time_s <= time_s[-1] - period_s
    if not early.any():
        return False
    later = np.interp(time_s[early] + period_s, time_s, velocity)
    size = float(np.sqrt(np.mean(velocity**2)))
    return float(np.sqrt(np.mean((later - velocity[early]) ** 2))) <= _REPEATS * size


def _between(signals: Signals, start_s: float, end_s: float) -> Signals:
    return _where(signals, (signals.time_s >= start_s) & (signals.time_s <= end_s))


def _where(signals: Signals, kept: NDArray[np.bool_]) -> Signals:
    """Return the signals at some of their samples."""
    changes: dict[str, Any] = {
        field.name: value[kept]
        for field in dataclasses.fields(signals)
        if isinstance(value := getattr(signals, field.name), np.ndarray)
    }
    return dataclasses.replace(signals, **changes)
