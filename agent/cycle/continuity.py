"""Whether a joint can have come from one measured position to the next.

The following error sees an encoder that jumps while a set-point moves. At a standstill there is
none: the next move would be planned from the wrong place, and end there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

from agent.cycle.gate import GateLimits
from drivers.ports import Sample


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
