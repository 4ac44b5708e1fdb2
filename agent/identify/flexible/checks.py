"""Why recordings cannot carry a flexible joint, and what to record instead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.preparation import Track
from agent.identify.preprocess import read_motion
from agent.identify.saturation import limited_share
from agent.identify.signals import Signals

SLOWEST_HZ = 50.0
SHORTEST_S = 1.0  # a slow gear's antiresonance, 2 Hz, twice
_SLOW = 0.02  # of the fastest speed: slower than this is ringing, not going
_ONE_WAY = 0.05  # of the moving samples
_MEAN_S = 0.01  # an average that a limit outlasts


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
    names = [s.name for s in recordings if _saturated(s)]
    if names:
        out.append(
            f"the torque is saturated in {', '.join(names)}: it stays at its highest value while "
            "the speed changes; record with lower acceleration"
        )
    return out


def _saturated(signals: Signals) -> bool:
    """Return whether a drive's limit cuts the torque off: see `agent.identify.saturation`.

    Noise that is added behind the limit blurs it; means over a hundredth of a second see it again.
    """
    return any(limited_share(read_motion(s)) > 0.0 for s in (signals, _averaged(signals)))


def _averaged(signals: Signals) -> Signals:
    """Return means over `_MEAN_S` of the samples, at least over one each."""
    step_s = float(np.median(np.diff(signals.time_s))) if signals.time_s.size > 1 else _MEAN_S
    count = max(round(_MEAN_S / step_s), 1)
    whole = signals.time_s.size // count * count
    columns = {
        "time_s": signals.time_s,
        "torque_nm": signals.torque_nm,
        "position_rad": signals.position_rad,
        "velocity_rad_s": signals.velocity_rad_s,
    }
    means: dict[str, NDArray[np.generic]] = {
        name: values[:whole].reshape(-1, count).mean(axis=1)
        for name, values in columns.items()
        if values is not None
    }
    return Signals.from_columns(means, signals.gear_ratio, name=signals.name)
