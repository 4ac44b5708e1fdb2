"""Whether a joint can have come from one measured position to the next.

The following error sees an encoder that jumps while a set-point moves. At a standstill there is
none: the next move would be planned from the wrong place, and end there. A controller that moves
the joint by itself tells no set-points at all, and a joint that is held to velocities alone is as
fast as they say: position and velocity bear each other out, or one of them is not the joint's.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

from agent.cycle.gate import GateLimits
from drivers.ports import Sample

_SPAN_S = 1.0
_SPEED_S = 0.2
"""Over which positions and velocities are compared, and a speed is taken from positions."""

_LATE_S = 0.05  # of a velocity that is filtered, behind its position
_COARSE_RAD_S = 0.2  # two revolutions a minute: drives count speeds in whole ones, and cut them off
_SCALE = 0.05  # of the way: what scale a velocity has wrong is told when its recording is read
_ANOTHER_SCALE = 3.0  # times what velocities amount to: no noise and no late SYNC


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
    """The latest second of a motion, by its samples alone; motor side.

    Parameters
    ----------
    limits : GateLimits
        The axis's limits: position and velocity may differ by its following error over the span.
    """

    def __init__(self, limits: GateLimits) -> None:
        self._limits = limits
        self._seen: deque[_Seen] = deque()

    def take(self, sample: Sample) -> None:
        """Take in the next sample, or one that was taken before."""
        summed_rad, bent_rad = 0.0, 0.0
        if self._seen:
            last = self._seen[-1]
            step_s = sample.time_s - last.sample.time_s
            if step_s <= 0.0:
                return
            mean_rad_s = 0.5 * (last.sample.velocity_rad_s + sample.velocity_rad_s)
            summed_rad = last.summed_rad + mean_rad_s * step_s
            # Between two samples the speed may have bent by as much as the acceleration allows.
            bent_rad = last.bent_rad + self._limits.acceleration_max_rad_s2 * step_s**2 / 8.0
        self._seen.append(_Seen(sample, summed_rad, bent_rad))
        while sample.time_s - self._seen[0].sample.time_s > _SPAN_S:
            self._seen.popleft()

    @property
    def speed_rad_s(self) -> float:
        """Return the velocity that the latest positions show; 0 where they show no motion."""
        lasted_s, moved_rad, _ = self._lately()
        return moved_rad / lasted_s if moved_rad else 0.0

    @property
    def unlike_rad_s(self) -> tuple[float, float] | None:
        """Return the latest velocity by positions, and as reported, where that shows no part of it.

        None where the positions show no motion.
        """
        lasted_s, moved_rad, summed_rad = self._lately()
        if not abs(moved_rad) > _ANOTHER_SCALE * abs(summed_rad):
            return None
        return moved_rad / lasted_s, summed_rad / lasted_s

    def _lately(self) -> tuple[float, float, float]:
        """Return how long, and how far by positions, 0 for no motion, and by velocities, rad."""
        if not self._seen:
            return 0.0, 0.0, 0.0
        newest = self._seen[-1]
        after_s = newest.sample.time_s - _SPEED_S
        before = next(seen for seen in self._seen if seen.sample.time_s >= after_s)
        moved_rad = newest.sample.position_rad - before.sample.position_rad
        if not abs(moved_rad) > 0.1 * self._limits.following_error_max_rad:
            moved_rad = 0.0
        lasted_s = newest.sample.time_s - before.sample.time_s
        return lasted_s, moved_rad, newest.summed_rad - before.summed_rad

    def contradiction(self) -> str:
        """Return why positions and velocities cannot be those of one joint, or ""."""
        if not self._seen:
            return ""
        first, last = self._seen[0], self._seen[-1]
        lasted_s = last.sample.time_s - first.sample.time_s
        moved_rad = last.sample.position_rad - first.sample.position_rad
        summed_rad = last.summed_rad - first.summed_rad
        late_rad = _LATE_S * abs(last.sample.velocity_rad_s - first.sample.velocity_rad_s)
        coarse_rad = _COARSE_RAD_S * lasted_s + _SCALE * abs(moved_rad)
        allowed_rad = self._limits.following_error_max_rad + late_rad + coarse_rad
        if not abs(moved_rad - summed_rad) > allowed_rad + last.bent_rad - first.bent_rad:
            return ""
        return (
            f"within {lasted_s:.1f} s the measured position changed by {moved_rad:.2f} rad and the "
            f"measured velocity amounts to {summed_rad:.2f} rad: one of them is not the joint's"
        )


class _Seen(NamedTuple):
    """A sample, and since the first one what velocities amount to and how far they may be off."""

    sample: Sample
    summed_rad: float
    bent_rad: float
