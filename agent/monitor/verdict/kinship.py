"""Which joints are of one kind, and which of them have lived long enough to show anything.

Of one kind are joints of other robots with the same axis and gear ratio, whose recordings either
name the same robot model (`robot_model` of their metadata) or were handed in as siblings by the
user, who knows. A sibling teaches with its healthy cycles since its last event, on the young
joint's own grid of speeds, where it is without fault and has `GROWN` of them; never with its level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.growth import LAG
from agent.monitor.baseline.siblings import kinds_of
from agent.monitor.compensation.kind import Siblings
from agent.monitor.detection.series import State
from agent.monitor.history.features import SpeedGrid, features_of
from agent.monitor.history.history import JointHistory
from agent.monitor.history.table import Features, features_table
from agent.monitor.verdict.finding import Finding

GROWN = 60
"""Healthy cycles that a joint has to have before others learn from it."""

_SAME_GEAR = 1e-6


@dataclass(frozen=True)
class Pool:
    """Joints that were judged by themselves: `beside` in one call, `given` as siblings."""

    beside: Sequence[Finding]
    given: Sequence[Finding] = ()

    def siblings_of(self, history: JointHistory) -> Siblings | None:
        """Return what joints of a joint's kind show; None where none of them is known."""
        if history.grid is None:
            return None
        own = history.joint
        named = [f for f in self.beside if history.model and f.history.model == history.model]
        asked = [f for f in self.given if _may_be(history.model, f.history.model)]
        like = {
            f.history.joint: f
            for f in (*named, *asked)
            if f.history.joint.robot != own.robot
            and f.history.joint.axis == own.axis
            and abs(f.history.joint.gear_ratio / own.gear_ratio - 1.0) < _SAME_GEAR
        }
        seen = {joint: _healthy(f, history.grid) for joint, f in sorted(like.items())}
        grown = {joint: one for joint, one in seen.items() if one is not None}
        kinds = kinds_of(list(grown.values()))
        return Siblings(tuple(j.label for j in grown), len(like), kinds) if like else None


def _may_be(model: str, other: str) -> bool:
    """Return whether two robots may be of one model: nobody says otherwise."""
    return not model or not other or model == other


def _healthy(finding: Finding, grid: SpeedGrid) -> tuple[Features, Floats] | None:
    """Return a joint's healthy cycles and when they were run; None where it is not grown."""
    last, history = finding.current, finding.history
    if finding.status != State.NO_FAULT.value or last is None or last.judgement is None:
        return None
    fallen = last.judgement.fallen
    if finding.fallen is not None or (fallen is not None and fallen[-1]):
        return None
    stop = last.segment.stop - LAG
    cycles = [
        cycle
        for cycle, state in zip(
            history.cycles[last.segment.start : stop], last.judgement.states, strict=False
        )
        if state is State.NO_FAULT and cycle.curve is not None and grid.covered_by(cycle.curve)
    ]
    if len(cycles) < GROWN:
        return None
    features = [features_of(cycle.curve, grid) for cycle in cycles if cycle.curve is not None]
    return features_table(cycles, features), np.array([cycle.started_s for cycle in cycles])
