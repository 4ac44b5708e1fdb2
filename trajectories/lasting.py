"""How long something takes, as people say it."""

from __future__ import annotations

import math


def lasting(seconds: float) -> str:
    """Write a length of time: "12.3 s", from two minutes on "2.5 min", from two hours on "2.1 h".

    Three digits are enough to plan a shift by; what has to be exact stays in seconds. A dash where
    there is no number.
    """
    if not math.isfinite(seconds):
        return "–"
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    if seconds < 7200.0:
        minutes = seconds / 60.0
        return f"{round(minutes, 1) if minutes < 10.0 else round(minutes):g} min"
    return f"{round(seconds / 3600.0, 1):g} h"
