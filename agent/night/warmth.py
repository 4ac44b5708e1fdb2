"""When the gearbox will be as warm as it was for the cycles that tonight's is compared with.

Tonight's own readings are fitted with the cooling law (`agent.identify.thermal.cooling`); its
forecast says when to look again and what to tell. Whoever waited in vain runs at the last moment,
where the difference is smallest, and the difference is recorded: the monitor compensates for it.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.thermal.cooling import estimate_cooling
from agent.night.description import AxisNight

LOOK = datetime.timedelta(minutes=5)
_READINGS_A_FORECAST = 12  # the law needs as many, and a fit takes half a second: once an hour
_SOONEST = datetime.timedelta(minutes=1)


@dataclass(frozen=True)
class Reading:
    """A gearbox temperature, and when it was read."""

    at: datetime.datetime
    degc: float


@dataclass(frozen=True)
class Warmth:
    """What the temperature says about starting now.

    Parameters
    ----------
    go : bool
        Whether to start.
    look_at : datetime.datetime
        When to look again, where not.
    sentence : str
        What is waited for, or why it is not waited any longer; empty where nothing is to be said.
    difference_k : float or None
        How much warmer than comparable; None where nobody can tell before the run.
    forecast : bool
        Whether the sentence says when it will be comparable.
    """

    go: bool
    look_at: datetime.datetime
    sentence: str = ""
    difference_k: float | None = None
    forecast: bool = False


def judge_warmth(
    axis: AxisNight,
    readings: Sequence[Reading],
    now: datetime.datetime,
    latest_start: datetime.datetime,
) -> Warmth:
    """Say whether the gearbox is comparable, or when it will be.

    Parameters
    ----------
    axis : AxisNight
        With the temperature that its cycles are compared at; without one there is no waiting.
    readings : sequence of Reading
        Tonight's, oldest first; empty where nobody can read it while the drive is off.
    now, latest_start : datetime.datetime
        The latest moment at which a cycle still ends inside its window.
    """
    target, tolerance = axis.temperature_degc, axis.temperature_tolerance_k
    if target is None:
        return Warmth(True, now)
    if not readings or not math.isfinite(readings[-1].degc):
        return Warmth(
            True, now, "the gearbox temperature is not known before the run; the recording has it"
        )
    degc = readings[-1].degc
    difference = degc - target
    if abs(difference) <= tolerance:
        return Warmth(True, now, difference_k=difference)
    compared = f"the gearbox is at {degc:.1f} degC, comparable at {target:g} ± {tolerance:g} degC"
    if now >= latest_start:
        return Warmth(True, now, f"{compared}; the window leaves no more time to wait", difference)
    if difference < 0.0:
        return Warmth(True, now, f"{compared}; it does not get warmer by waiting", difference)
    expected, words = None, "waiting"
    if len(readings) % _READINGS_A_FORECAST == 0:
        expected, words = _expected(readings, now, target + tolerance)
    look_at = now + LOOK if expected is None else max(now + _SOONEST, min(expected, now + LOOK))
    sentence = f"{compared}; {words}"
    return Warmth(False, min(look_at, latest_start), sentence, difference, expected is not None)


def _expected(
    readings: Sequence[Reading], now: datetime.datetime, degc: float
) -> tuple[datetime.datetime | None, str]:
    """Return when the cooling law expects a temperature at the earliest, and that in words."""
    first = readings[0].at
    known = [r for r in readings if math.isfinite(r.degc)]
    time_s = np.array([(r.at - first).total_seconds() for r in known])
    rising = np.flatnonzero(np.diff(time_s, prepend=-np.inf) > 0.0)  # the clock may have been set
    when = estimate_cooling(time_s[rising], np.array([r.degc for r in known])[rising]).time_to(degc)
    if not when.identified or when.ci95 is None:
        return None, "waiting"
    low, middle, high = (
        first + datetime.timedelta(seconds=s) for s in (when.ci95[0], when.value, when.ci95[1])
    )
    words = f"expected at {middle:%H:%M} UTC ({low:%H:%M} to {high:%H:%M}), by its cooling"
    return max(low, now), words
