"""What a finished cycle says to a technician: one kind, one comparison, one next step.

A verdict that stands in the recording's own file (`stribeck.verdict/1`) is taken as it is: an alarm
is its word alone. Without one the page says what was measured and how it lies against the baseline.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from agent.web.against import Against, against, curve_of
from agent.web.shelf import Shelved

COMPARABLE_K = 2.0
"""Gearbox temperatures closer than this are called equal; beyond, the page says so."""
MATERIAL_PERCENT = 5.0
"""Less than this is called as before, however sure it is.

Friction changes by a per cent or two with each kelvin of the gearbox, which the interval of a
single cycle does not count: what is smaller than that of `COMPARABLE_K` says nothing of wear.
"""


@dataclass(frozen=True)
class Finding:
    """What one cycle says.

    Parameters
    ----------
    kind : str
        "alarm", "undecidable", "stopped", "unestimated", "baseline", "changed", "as_before",
        "unclear" (its interval holds a change and none) or "measured" (nothing to compare with).
    cycle : Shelved
    baseline : Shelved or None
        What it is held against.
    change : Against or None
        How it lies against that.
    """

    kind: str
    cycle: Shelved
    baseline: Shelved | None = None
    change: Against | None = None

    @property
    def sign(self) -> str:
        """Return the shape that goes with the kind: "good", "bad", "more", "less", "unknown"."""
        if self.kind == "changed" and self.change is not None:
            return "more" if self.change.whole.percent > 0.0 else "less"
        return {
            "alarm": "bad",
            "as_before": "good",
            "baseline": "good",
            "measured": "good",
        }.get(self.kind, "unknown")

    @property
    def warmer_k(self) -> float | None:
        """Return how much warmer the gearbox was than in the baseline; None where unknown."""
        if self.baseline is None:
            return None
        now, then = self.cycle.temperature_degc, self.baseline.temperature_degc
        return None if now is None or then is None else now - then

    @property
    def comparable(self) -> bool:
        """Return whether both gearboxes were equally warm, as far as it was measured."""
        return self.warmer_k is not None and abs(self.warmer_k) <= COMPARABLE_K


def finding(cycle: Shelved, own: Sequence[Shelved], chosen: str) -> Finding:
    """Return what a cycle says.

    Parameters
    ----------
    cycle : Shelved
        Which.
    own : sequence of Shelved
        Every cycle of its axis, newest first.
    chosen : str
        Name of the recording that somebody chose as baseline; else the first of this gearbox.
    """
    baseline = baseline_of(cycle, own, chosen)
    if cycle.stopped_because:
        return Finding("stopped", cycle)
    if cycle.estimate is None:
        return Finding("unestimated", cycle)
    if not cycle.decidable:
        return Finding("undecidable", cycle)
    now = curve_of(cycle.estimate)
    then = None if baseline is None else curve_of(baseline.estimate)
    change = None if now is None or then is None else against(now, then)
    if cycle.verdict is not None and cycle.verdict.alarm:
        return Finding("alarm", cycle, baseline, change)
    if baseline is None or change is None:
        return Finding("measured", cycle, baseline)
    if baseline.name == cycle.name:
        return Finding("baseline", cycle, baseline)
    if abs(change.whole.percent) <= MATERIAL_PERCENT:
        return Finding("as_before", cycle, baseline, change)
    return Finding("changed" if change.whole.clear else "unclear", cycle, baseline, change)


def baseline_of(cycle: Shelved, own: Sequence[Shelved], chosen: str) -> Shelved | None:
    """Return what a cycle is held against: as chosen, else the first of the same gearbox."""
    usable = [c for c in own if c.decidable and not c.stopped_because]
    for other in usable:
        if other.name == chosen:
            return other
    same = [c for c in usable if _gearbox(c) == _gearbox(cycle)]
    return same[-1] if same else None


def _gearbox(cycle: Shelved) -> tuple[float, str]:
    return cycle.metadata.gear_ratio, str(cycle.metadata.extra.get("gearbox_serial", ""))
