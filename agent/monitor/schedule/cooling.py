"""Whether a cycle was run warm or cold against the healthy ones, and when a like one can be run.

Comparable means: at a gearbox temperature that the healthy cycles have, give or take little. A
gearbox that is too warm gets there by resting, after a time that Newton's law tells (thesis, A.1);
one that is too cold has to be warmed up by work.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.thermal.cooling import Cooling
from agent.physics.thermal import relaxation_time_s

USUAL_RATE_PER_S = 6.2e-5
"""Mean of three oils in one gearbox (thesis, A.1)."""

_USUAL_SPREAD = 2.0  # another gearbox may cool so many times faster or slower
_MARGIN, _LEAST_MARGIN_DEGC = 0.15, 1.0  # of the healthy span, beyond its ends
_FEWEST = 3
COMPARABLE, WARM, COLD, UNKNOWN = "comparable", "warm", "cold", "unknown"


@dataclass(frozen=True)
class Warmth:
    """One cycle's temperature against the healthy ones'.

    Parameters
    ----------
    word : str
        ``comparable``, ``warm``, ``cold`` or ``unknown``.
    temperature_degc : float
        NaN where it was not recorded.
    band_degc : tuple of float
        In which a cycle is comparable; NaN where the healthy cycles do not say.
    sentence : str
    """

    word: str
    temperature_degc: float
    band_degc: tuple[float, float]
    sentence: str


@dataclass(frozen=True)
class NextCycle:
    """When a comparable cycle can be run.

    `after_s` counts from the moment that was asked about; not identified where resting does not
    lead there, and `sentence` says what does.
    """

    after_s: Parameter
    sentence: str


def warmth(temperature_degc: float, healthy_degc: Floats) -> Warmth:
    """Say whether a cycle was run warm or cold.

    Parameters
    ----------
    temperature_degc : float
        The cycle's mean gearbox temperature; NaN where it was not recorded.
    healthy_degc : ndarray, shape (n,)
        The healthy cycles'; NaN where one was not recorded.
    """
    known = healthy_degc[np.isfinite(healthy_degc)]
    if known.size < _FEWEST:
        return Warmth(
            UNKNOWN,
            temperature_degc,
            (math.nan, math.nan),
            f"unknown: {known.size} healthy cycles have a temperature, {_FEWEST} are needed",
        )
    low, high = float(known.min()), float(known.max())
    margin = max(_MARGIN * (high - low), _LEAST_MARGIN_DEGC)
    band = (low - margin, high + margin)
    if not math.isfinite(temperature_degc):
        return Warmth(UNKNOWN, math.nan, band, "unknown: the cycle has no gearbox temperature")
    said = f"{temperature_degc:.1f} °C, the healthy cycles {low:.1f} to {high:.1f} °C"
    if temperature_degc > band[1]:
        return Warmth(WARM, temperature_degc, band, f"run warm: {said}")
    if temperature_degc < band[0]:
        return Warmth(COLD, temperature_degc, band, f"run cold: {said}")
    return Warmth(COMPARABLE, temperature_degc, band, f"comparable: {said}")


def next_comparable(
    found: Warmth, ambient_degc: float = math.nan, cooling: Cooling | None = None
) -> NextCycle:
    """Say when a cycle that is comparable with the healthy ones can be run.

    Parameters
    ----------
    found : Warmth
        Of the gearbox now.
    ambient_degc : float
        Of the hall; NaN where it is not known. Not used where `cooling` is given.
    cooling : Cooling, optional
        The joint's own cooling law, identified from its first sample to now; its times are
        counted on from there. Without it, the usual rate with a factor of two either way.
    """
    low, high = found.band_degc
    if found.word == COMPARABLE:
        return NextCycle(Parameter(0.0, (0.0, 0.0)), "a comparable cycle can be run now")
    if found.word == UNKNOWN:
        return _never(found.sentence)
    if found.word == COLD:
        return _never(
            f"resting does not warm it: warm it up by {low - found.temperature_degc:.1f} °C with "
            "work or a warm-up cycle first"
        )
    if cooling is not None and cooling.identified:
        return _said(_from_now(cooling, high), "the joint's own cooling law")
    if not math.isfinite(ambient_degc):
        return _never(
            f"let it cool to {high:.1f} °C; how long that takes cannot be said without the hall's "
            "temperature"
        )
    if ambient_degc >= high:
        return _never(
            f"it does not cool below the hall's {ambient_degc:.1f} °C; the healthy cycles end at "
            f"{high:.1f} °C: wait for a cooler day"
        )
    usual = float(relaxation_time_s(USUAL_RATE_PER_S, ambient_degc, found.temperature_degc, high))
    after = Parameter(usual, (usual / _USUAL_SPREAD, usual * _USUAL_SPREAD))
    return _said(after, "the usual cooling rate, not this joint's own")


def _from_now(cooling: Cooling, target_degc: float) -> Parameter:
    """Return the time from the curve's end, not its start, until a temperature is reached."""
    found = cooling.time_to(target_degc)
    if not found.identified or found.ci95 is None:
        return found
    low, high = (max(end - cooling.duration_s, 0.0) for end in found.ci95)
    return Parameter(max(found.value - cooling.duration_s, 0.0), (low, high))


def _said(after: Parameter, by: str) -> NextCycle:
    if not after.identified or after.ci95 is None:
        return NextCycle(after, after.reason)
    value, low, high = (x / 3600.0 for x in (after.value, *after.ci95))
    span = f"{value:.1f} h ({low:.1f} to {high:.1f} h) of rest"
    return NextCycle(after, f"a comparable cycle can be run in {span}, by {by}")


def _never(why: str) -> NextCycle:
    return NextCycle(Parameter.not_identified(why), why)
