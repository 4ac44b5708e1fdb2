"""What a small share hides: how large the error would be without the effect."""

from __future__ import annotations

import math
from dataclasses import replace

from agent.explain.answer.fits import Holdout
from agent.explain.answer.located import Finding
from agent.explain.answer.names import COSTS_NO_TORQUE, OWN_NUMBER
from agent.numbers import fixed

_SMALL = 0.10  # of the mismatch: one reads it as of no account
_MATTERS = 1.5  # times the error: far beyond what chance makes of it
_PLAIN = 3.0  # times: from there on tenths say nothing


def times_without(finding: Finding, holdout: Holdout | None, floor_nm: float) -> float:
    """Return how many times as large the error would be without a finding; NaN if not to be told.

    A share says how much of the first error an effect carries. Beside an effect that carries nearly
    all of it a share is small, though the error that is left in the end may be many times as large
    without it. This is told where the share is below a tenth and the error half as large again. It
    is compared with the greater of the error on unseen data and the noise, below which no error of
    other recordings is.
    """
    if holdout is None or holdout.unsure or finding.energy_share >= _SMALL:
        return math.nan
    if finding.form == OWN_NUMBER or finding.effect in COSTS_NO_TORQUE:
        return math.nan
    known = [v for v in (holdout.extended.rmse_nm, floor_nm) if math.isfinite(v)]
    error_nm = max(known, default=0.0)
    times = finding.holdout_rmse_without_nm / error_nm if error_nm > 0.0 else math.nan
    return times if times >= _MATTERS else math.nan


def as_large(times: float) -> str:
    """Return how many times as large an error is: whole, unless it is little more than once."""
    return f"{fixed(times, 0 if times >= _PLAIN else 1)} times as large"


def without_it(times: float) -> str:
    """Return how large the error would be, as it ends a sentence."""
    return f"without it the error would be {as_large(times)}"


def weighed(finding: Finding, holdout: Holdout | None, floor_nm: float) -> Finding:
    """Return a finding whose sentence says what its small share hides."""
    times = times_without(finding, holdout, floor_nm)
    if not math.isfinite(times):
        return finding
    return replace(finding, said=finding.said.going_on(f", but {without_it(times)}"))
