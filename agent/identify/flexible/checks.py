"""Why recordings cannot carry a flexible joint, and what to record instead."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agent.identify.diagnosis import no_joint_records
from agent.identify.flexible.preparation import Track
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.saturation import limited_share

SLOWEST_HZ = 50.0
SHORTEST_S = 1.0  # a slow gear's antiresonance, 2 Hz, twice
_SLOW = 0.02  # of the fastest speed: slower than this is ringing, not going
_ONE_WAY = 0.05  # of the moving samples
_MEANS = (1, 2, 4, 8, 16)  # samples
_STILL_NOISE = 1.6  # times what noise would be: more is motion


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
    impossible = no_joint_records(recordings)
    return [*out, impossible] if impossible else out


def _saturated(signals: Signals) -> bool:
    """Return whether a drive's limit cuts the torque off: see `agent.identify.signals.saturation`.

    Noise that was added behind the limit blurs it; means over some samples see it again, as long as
    their scatter is that of noise and not of the motion.
    """
    noise = _scatter(signals.torque_nm[signals.valid], 2)
    for count in _MEANS:
        means = _averaged(signals, count)
        if count > 1 and _scatter(means.torque_nm, 1) > _STILL_NOISE * noise / math.sqrt(count):
            break
        if limited_share(read_motion(means)) > 0.0:
            return True
    return False


def _scatter(values: Floats, order: int) -> float:
    """Return the standard deviation of white noise, from the differences of some order."""
    steps = np.abs(np.diff(values, n=order))
    return float(np.median(steps)) / (0.6745 * math.sqrt(math.comb(2 * order, order)))


def _averaged(signals: Signals, count: int) -> Signals:
    """Return means over so many valid samples, one after the other."""
    columns = {
        "time_s": signals.time_s,
        "torque_nm": signals.torque_nm,
        "position_rad": signals.position_rad,
        "velocity_rad_s": signals.velocity_rad_s,
    }
    whole = int(signals.valid.sum()) // count * count
    means: dict[str, NDArray[np.generic]] = {
        name: values[signals.valid][:whole].reshape(-1, count).mean(axis=1)
        for name, values in columns.items()
        if values is not None
    }
    return Signals.from_columns(means, signals.gear_ratio, name=signals.name)
