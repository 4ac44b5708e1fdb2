"""What does not set a cycle aside, and yet is to be known of a history."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from agent.monitor.history.cycle import Cycle, Joint

SET_CLOCK_S = 946_684_800.0
"""2000-01-01: a clock that shows less was never set."""

_GAP = 10.0  # times the usual interval
_DAY_S = 86_400.0
_LEAST_GAP_S = 2.0 * _DAY_S


def usual(cycles: Sequence[Cycle], key: Callable[[Cycle], str]) -> str:
    """Return the most frequent value; the earliest one of several."""
    return Counter(key(c) for c in cycles).most_common(1)[0][0]


def notes_on(given: Sequence[Cycle], kept: Sequence[Cycle]) -> list[str]:
    """Say what does not set a cycle aside, and yet is to be known."""
    notes = []
    if kept and not any(math.isfinite(c.temperature_degc) for c in kept):
        notes.append(
            "no cycle has a gearbox temperature: friction is compared uncompensated, and a warmer "
            "or colder joint looks like a change"
        )
    unknown = sum(math.isnan(c.payload_kg) for c in kept)
    if 0 < unknown < len(kept):
        notes.append(f"{unknown} of {len(kept)} cycles do not say their payload")
    common = usual(kept, lambda c: c.trajectory) if kept else ""
    others = sum(c.trajectory != common for c in kept)
    if others:
        notes.append(
            f"{others} of {len(kept)} cycles ran another trajectory; they are compared over the "
            "common speeds, by straight lines between their own"
        )
    return [*notes, *_gaps(kept), *_backwards(given)]


def other_gears(joint: Joint, counts: Mapping[Joint, int]) -> list[str]:
    """Say of a joint's few cycles that most of the same robot and axis have another gear ratio.

    `counts` is how many cycles each joint has.
    """
    alike = [j for j in counts if (j.robot, j.axis) == (joint.robot, joint.axis)]
    most = max(alike, key=lambda j: (counts[j], -j.gear_ratio))
    if most == joint:
        return []
    return [
        f"{counts[most]} other cycles of {joint.robot} axis {joint.axis} have a gear ratio of "
        f"{most.gear_ratio:g}, {counts[joint]} have this one: if it is the same gearbox, correct "
        "gear_ratio in the recordings; friction is not compared across another ratio"
    ]


def _gaps(cycles: Sequence[Cycle]) -> list[str]:
    """Say where the history has holes."""
    apart = np.diff([c.started_s for c in cycles])
    if apart.size < 3:
        return []
    limit = max(_GAP * float(np.median(apart)), _LEAST_GAP_S)
    holes = np.flatnonzero(apart > limit)
    if not holes.size:
        return []
    longest = int(holes[np.argmax(apart[holes])])
    return [
        f"the history has {holes.size} gap{'s' * (holes.size > 1)} of more than "
        f"{limit / _DAY_S:.0f} days; the longest, {apart[longest] / _DAY_S:.0f} days, follows "
        f"{cycles[longest].started_at[:10]}"
    ]


def _backwards(cycles: Sequence[Cycle]) -> list[str]:
    """Say where the names of the recordings run on while their clock runs back."""
    dated = [c for c in cycles if c.started_s >= SET_CLOCK_S]
    names = sorted(dated, key=lambda c: natural(c.name))
    back = [(a, b) for a, b in pairwise(names) if b.started_s < a.started_s]
    # Names that say nothing about time run back about every second time.
    if not back or len(back) > max(1, len(names) // 10):
        return []
    before, after = back[0]
    return [
        f"the clock ran back: by name {after.name} follows {before.name}, by started_at it came "
        "before; the order of started_at is kept"
    ]


def natural(name: str) -> list[tuple[int, int, str]]:
    """Return a sort key under which numbers in names count as numbers."""
    out: list[tuple[int, int, str]] = []
    digits = text = ""
    for letter in f"{name.casefold()}\0":
        if letter.isdecimal():
            out += [(1, 0, text)] if text else []
            digits, text = digits + letter, ""
        else:
            out += [(0, int(digits), "")] if digits else []
            digits, text = "", text + letter
    return out
