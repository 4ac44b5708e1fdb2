"""From cycles in any order to the history of each joint: what belongs to it, and what does not.

Nothing is left out in silence: every cycle that is set aside has its sentence.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from agent.monitor.compensation.kind import Siblings
from agent.monitor.history.cycle import Cycle, CycleCurve, Joint
from agent.monitor.history.events import Event, events_between, events_said, visitors
from agent.monitor.history.features import LOW_SHARE, CycleFeatures, SpeedGrid, features_of, grid_of
from agent.monitor.history.notes import SET_CLOCK_S, notes_on, other_gears, usual
from agent.monitor.history.table import Features, features_table
from trajectories import lasting

_SAME_START_S = 0.5
_OVERLAP_S = 1.0
_FIRST = 8  # cycles whose common range the grid is
_STRANGER = (
    "its serial numbers are those of other parts than before and after: another joint's cycle "
    "under this one's name"
)


@dataclass(frozen=True)
class SetAside:
    """A cycle that is not counted, and why, in one sentence."""

    name: str
    reason: str


@dataclass(frozen=True)
class Segment:
    """Cycles `start` to `stop` (exclusive) under one baseline, and what began it."""

    start: int
    stop: int
    events: tuple[Event, ...] = ()


@dataclass(frozen=True)
class JointHistory:
    """One joint's usable cycles in order of time.

    Parameters
    ----------
    joint : Joint
    cycles : tuple of Cycle
        Each has a curve that covers the grid, and starts after the one before has ended.
    features : tuple of CycleFeatures
        One for each cycle.
    grid : SpeedGrid or None
        None where no cycle is usable.
    segments : tuple of Segment
        All cycles, cut at the events.
    set_aside : tuple of SetAside
    notes : tuple of str
        What else is to be borne in mind.
    siblings : Siblings or None
        What other joints of the same kind show; None where none are known.
    """

    joint: Joint
    cycles: tuple[Cycle, ...]
    features: tuple[CycleFeatures, ...]
    grid: SpeedGrid | None
    segments: tuple[Segment, ...]
    set_aside: tuple[SetAside, ...]
    notes: tuple[str, ...]
    siblings: Siblings | None = None

    @property
    def model(self) -> str:
        """Return the robot's model as the latest cycle that names one does; else empty."""
        return next((c.model for c in reversed(self.cycles) if c.model), "")

    def table(self, start: int, stop: int) -> Features:
        """Return features and conditions of some cycles, and what joints of the kind show."""
        kinds = {} if self.siblings is None else self.siblings.kinds
        return features_table(self.cycles[start:stop], self.features[start:stop], kinds)

    @property
    def time_s(self) -> list[float]:
        """Return when each cycle started, seconds since 1970."""
        return [c.started_s for c in self.cycles]


def histories(
    cycles: Iterable[Cycle], events: Sequence[Event] = (), low_rad_s: float | None = None
) -> tuple[JointHistory, ...]:
    """Tell the joints apart and order each one's cycles; the order of `cycles` does not matter.

    Parameters
    ----------
    cycles : iterable of Cycle
        Of any joints.
    events : sequence of Event
        What people wrote down.
    low_rad_s : float, optional
        Where the low-speed part of the curve ends (`features.SpeedGrid`).

    Raises
    ------
    ValueError
        `low_rad_s` lies outside of a joint's speeds.
    """
    by_joint: dict[Joint, list[Cycle]] = {}
    for cycle in cycles:
        by_joint.setdefault(cycle.joint, []).append(cycle)
    counts = {joint: len(own) for joint, own in by_joint.items()}
    out = []
    for joint, own in sorted(by_joint.items()):
        one = _history(joint, own, [e for e in events if e.concerns(joint)], low_rad_s)
        out.append(replace(one, notes=(*one.notes, *other_gears(joint, counts))))
    return tuple(out)


def _history(
    joint: Joint, cycles: Sequence[Cycle], events: Sequence[Event], low_rad_s: float | None
) -> JointHistory:
    """Set aside what does not count, cut at the events, compute the features."""
    ordered = sorted(cycles, key=lambda c: (_order(c.started_s), c.name, c.fingerprint))
    aside: list[SetAside] = []
    kept = ordered
    for sieve in (_undated, _copies, _overlapping, _undecidable, _strangers, _coldless):
        reasons = sieve(kept)
        aside += [SetAside(kept[i].name, why) for i, why in sorted(reasons.items())]
        kept = [c for i, c in enumerate(kept) if i not in reasons]
    if low_rad_s is None:
        fast = {i: why for i, c in enumerate(kept) if c.curve and (why := _fast_only(c.curve))}
        aside += [SetAside(kept[i].name, why) for i, why in fast.items()]
        kept = [c for i, c in enumerate(kept) if i not in fast]
    grid = _grid(kept, low_rad_s)
    if grid is not None:
        narrow = {i for i, c in enumerate(kept) if c.curve and not grid.covered_by(c.curve)}
        aside += [SetAside(kept[i].name, _narrow(kept[i], grid)) for i in sorted(narrow)]
        kept = [c for i, c in enumerate(kept) if i not in narrow]
    features = tuple(
        features_of(c.curve, grid) for c in kept if c.curve is not None and grid is not None
    )
    return JointHistory(
        joint,
        tuple(kept),
        features,
        grid,
        _segments(kept, events),
        tuple(aside),
        tuple(notes_on(_once(cycles), kept)),
    )


def _once(cycles: Sequence[Cycle]) -> list[Cycle]:
    """Leave out what is there twice, both of it: a copy's name says nothing of its time."""
    times = Counter(c.fingerprint for c in cycles if c.fingerprint)
    return [c for c in cycles if times[c.fingerprint] < 2]


def _order(started_s: float) -> float:
    return started_s if math.isfinite(started_s) else -math.inf


def _undated(cycles: Sequence[Cycle]) -> dict[int, str]:
    """Give no place in a history to what has no time."""
    out = {}
    for i, cycle in enumerate(cycles):
        if not math.isfinite(cycle.started_s):
            out[i] = "it does not say when it started (started_at)"
        elif cycle.started_s < SET_CLOCK_S:
            out[i] = f"its clock was not set: started_at is {cycle.started_at}"
    return out


def _copies(cycles: Sequence[Cycle]) -> dict[int, str]:
    """Count one cycle once."""
    out: dict[int, str] = {}
    seen: dict[str, Cycle] = {}
    last: Cycle | None = None
    for i, cycle in enumerate(cycles):
        first = seen.get(cycle.fingerprint) if cycle.fingerprint else None
        if first is not None:
            out[i] = f"it holds the same samples as {first.name}: one cycle counts once"
        elif last is not None and cycle.started_s - last.started_s < _SAME_START_S:
            out[i] = (
                f"it started at the same time as {last.name}, with other samples: a joint runs one "
                "cycle at a time, so one of the two has a wrong clock or another joint's name"
            )
        else:
            last = cycle
            seen[cycle.fingerprint] = cycle
    return out


def _overlapping(cycles: Sequence[Cycle]) -> dict[int, str]:
    """Take one cycle at a time: a joint cannot run two at once."""
    out: dict[int, str] = {}
    last: Cycle | None = None
    for i, cycle in enumerate(cycles):
        if last is not None and cycle.started_s < last.started_s + last.duration_s - _OVERLAP_S:
            early_s = last.started_s + last.duration_s - cycle.started_s
            out[i] = (
                f"it started {lasting(early_s)} before {last.name} had ended: a clock was changed, "
                "or it is of another joint"
            )
        else:
            last = cycle
    return out


def _undecidable(cycles: Sequence[Cycle]) -> dict[int, str]:
    return {
        i: f"its friction is not decidable: {'; '.join(c.reasons)}"
        for i, c in enumerate(cycles)
        if c.curve is None
    }


def _strangers(cycles: Sequence[Cycle]) -> dict[int, str]:
    return dict.fromkeys(visitors(cycles), _STRANGER)


def _coldless(cycles: Sequence[Cycle]) -> dict[int, str]:
    """Take no cycle without temperature beside those that have one."""
    known = sum(math.isfinite(c.temperature_degc) for c in cycles)
    if not known:
        return {}
    return {
        i: f"it has no gearbox temperature, which {known} of {len(cycles)} cycles have"
        for i, c in enumerate(cycles)
        if not math.isfinite(c.temperature_degc)
    }


def _grid(cycles: Sequence[Cycle], low_rad_s: float | None) -> SpeedGrid | None:
    """Return the common speeds of the first cycles of the usual trajectory."""
    if not cycles:
        return None
    common = usual(cycles, lambda c: c.trajectory)
    first = [c.curve for c in cycles if c.trajectory == common and c.curve is not None][:_FIRST]
    return grid_of(first, low_rad_s)


def _fast_only(curve: CycleCurve) -> str:
    """Return why a curve has no low-speed part; empty where it has one."""
    slowest, fastest = float(curve.speed_rad_s[0]), float(curve.speed_rad_s[-1])
    low = LOW_SHARE * fastest
    if slowest < low:
        return ""
    return (
        f"its friction curve begins at {slowest:.3g} rad/s, above a third of its fastest speed "
        f"({low:.3g} rad/s): it has no low-speed part, where wear shows; is it of ordinary work "
        "instead of the stair?"
    )


def _narrow(cycle: Cycle, grid: SpeedGrid) -> str:
    assert cycle.curve is not None
    speed = cycle.curve.speed_rad_s
    return (
        f"its friction curve reaches from {speed[0]:.3g} to {speed[-1]:.3g} rad/s only, and does "
        f"not cover the {grid.speed_rad_s[0]:.3g} to {grid.speed_rad_s[-1]:.3g} rad/s on which "
        "cycles are compared"
    )


def _segments(cycles: Sequence[Cycle], events: Sequence[Event]) -> tuple[Segment, ...]:
    """Cut the cycles where something was done to the joint."""
    begins: dict[int, list[Event]] = {}
    for i, (before, after) in enumerate(pairwise(cycles), start=1):
        found = events_between(before, after)
        if found:
            begins.setdefault(i, []).extend(found)
    if cycles:
        begins.setdefault(0, []).extend(events_said(cycles[0]))
    for event in events:
        first = next((i for i, c in enumerate(cycles) if c.started_s >= event.at_s), None)
        if first is not None:
            begins.setdefault(first, []).append(event)
    cuts = sorted(begins.keys() | ({0} if cycles else set()))
    return tuple(
        Segment(start, stop, tuple(begins.get(start, ())))
        for start, stop in pairwise([*cuts, len(cycles)])
    )
