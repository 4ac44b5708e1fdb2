"""Why recordings cannot carry a flexible joint, and what to record instead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.identify.diagnosis import no_joint_records
from agent.identify.flexible.preparation import Track
from agent.identify.signals.arrays import Signals
from agent.identify.signals.saturation import is_limited

SLOWEST_HZ = 50.0
SHORTEST_S = 1.0  # a slow gear's antiresonance, 2 Hz, twice
_SLOW = 0.02  # of the fastest speed: slower than this is ringing, not going
_ONE_WAY = 0.05  # of the moving samples


def why_not(recordings: Sequence[Signals], tracks: Sequence[Track]) -> list[str]:
    """Return everything that forbids a fit before it is tried, in plain words."""
    if not tracks:
        return ["no stretch of valid samples is long enough; record without gaps at 250 Hz or more"]
    rate = 1.0 / float(np.median([t.period_s for t in tracks]))
    if rate < SLOWEST_HZ:
        return [
            f"sampled at {rate:.3g} Hz: a gear's resonance lies at some to some tens of Hz and is "
            "not seen; record torque and position at 250 Hz or more"
        ]
    moving_s = sum(t.torque_nm.shape[0] * t.period_s for t in tracks)
    if moving_s < SHORTEST_S:
        return [f"only {moving_s:.2g} s were recorded; record ten periods of a triangle wave"]
    out = []
    speeds = np.concatenate([t.velocity_rad_s for t in tracks])
    fastest = float(np.max(np.abs(speeds), initial=0.0))
    if fastest == 0.0:
        return ["the joint stands still; record a triangle wave of velocity in both directions"]
    ways = [int(np.sum(way * speeds > _SLOW * fastest)) for way in (1.0, -1.0)]
    if min(ways) < _ONE_WAY * sum(ways):
        out.append(
            "motion in one direction only: Coulomb friction cannot be told from a torque offset; "
            "record a triangle wave of velocity in both directions"
        )
    names = [s.name for s in recordings if is_limited(s)]
    if names:
        out.append(
            f"the torque is saturated in {', '.join(names)}: it stays at its highest value while "
            "the speed changes; record with lower acceleration"
        )
    impossible = no_joint_records(recordings)
    return [*out, impossible] if impossible else out
