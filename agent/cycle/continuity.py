"""Whether a joint can have come from one measured position to the next.

The following error sees an encoder that jumps while a set-point moves. At a standstill there is
none: the next move would be planned from the wrong place, and end there. A controller that moves
the joint by itself tells no set-points at all: there position and velocity bear each other out, or
one of them is not the joint's.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from itertools import pairwise

from agent.cycle.gate import GateLimits
from drivers.ports import Sample

_SPAN_S = 1.0
_SPEED_S = 0.2
"""Over which positions and velocities are compared, and a speed is taken from positions."""


def jump(limits: GateLimits, samples: Iterable[Sample]) -> str:
    """Return why consecutive samples cannot belong to one motion, or "".

    Between two samples the joint moves by at most ``max(|v1|, |v2|) dt`` (rad, motor side); the
    following error's limit is allowed on top, for what the speed does in between and for SYNCs
    that a busy computer sends unevenly. A number that is not finite is left to the gate.

    Parameters
    ----------
    limits : GateLimits
        The axis's limits.
    samples : iterable of Sample
        Oldest first.
    """
    for before, after in pairwise(samples):
        step_rad = abs(after.position_rad - before.position_rad)
        speed_rad_s = max(abs(before.velocity_rad_s), abs(after.velocity_rad_s))
        moved_rad = speed_rad_s * (after.time_s - before.time_s)
        allowed_rad = moved_rad + limits.following_error_max_rad
        if math.isfinite(step_rad + allowed_rad) and step_rad > allowed_rad:
            return (
                f"the measured position jumped by {step_rad:.2f} rad between two samples; at "
                f"{speed_rad_s:.2f} rad/s the joint moves {moved_rad:.2f} rad in that time, and "
                f"{limits.following_error_max_rad:.2f} rad more are allowed"
            )
    return ""


class Course:
    """The latest second of a motion of which nothing but samples is known; motor side.

    Parameters
    ----------
    limits : GateLimits
        The axis's limits: position and velocity may differ by its following error over the span.
    """

    def __init__(self, limits: GateLimits) -> None:
        self._limits = limits
        self._seen: deque[tuple[Sample, float]] = deque()

    def take(self, sample: Sample) -> None:
        """Take in the next sample, or one that was taken before."""
        summed_rad = 0.0
        if self._seen:
            before, summed_rad = self._seen[-1]
            step_s = sample.time_s - before.time_s
            if step_s <= 0.0:
                return
            summed_rad += 0.5 * (before.velocity_rad_s + sample.velocity_rad_s) * step_s
        self._seen.append((sample, summed_rad))
        while self._seen[-1][0].time_s - self._seen[0][0].time_s > _SPAN_S:
            self._seen.popleft()

    @property
    def speed_rad_s(self) -> float:
        """Return the velocity that the latest positions show; 0 where they show no motion."""
        if not self._seen:
            return 0.0
        newest = self._seen[-1][0]
        before = next(s for s, _ in self._seen if newest.time_s - s.time_s <= _SPEED_S)
        moved_rad = newest.position_rad - before.position_rad
        if not abs(moved_rad) > 0.1 * self._limits.following_error_max_rad:
            return 0.0
        return moved_rad / (newest.time_s - before.time_s)

    def contradiction(self) -> str:
        """Return why positions and velocities cannot be those of one joint, or ""."""
        if not self._seen:
            return ""
        (first, begun_rad), (last, ended_rad) = self._seen[0], self._seen[-1]
        moved_rad, summed_rad = last.position_rad - first.position_rad, ended_rad - begun_rad
        # Between two samples the speed may have bent by as much as the acceleration allows.
        gaps_s = [b.time_s - a.time_s for (a, _), (b, _) in pairwise(self._seen)]
        bent_rad = sum(self._limits.acceleration_max_rad_s2 * gap_s**2 / 8.0 for gap_s in gaps_s)
        if not abs(moved_rad - summed_rad) > self._limits.following_error_max_rad + bent_rad:
            return ""
        return (
            f"within {last.time_s - first.time_s:.1f} s the measured position changed by "
            f"{moved_rad:.2f} rad and the measured velocity amounts to {summed_rad:.2f} rad: one "
            "of them is not the joint's"
        )
