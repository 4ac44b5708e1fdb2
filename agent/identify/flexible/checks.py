"""Why recordings cannot carry a flexible joint, and what to record instead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agent.identify.flexible.preparation import Track
from agent.identify.signals import Signals

SLOWEST_HZ = 50.0
SHORTEST_S = 1.0  # a slow gear's antiresonance, 2 Hz, twice
_SLOW = 0.02  # of the fastest speed: slower than this is ringing, not going
_ONE_WAY = 0.05  # of the moving samples
_FLAT_S = 0.03
_FLAT_SIGMAS = 5.0
_TOP = 0.97  # of the largest torque
_MOVED = 0.1  # of the fastest speed, while the torque is flat
_FLAT_SHARE = 0.02


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
    names = [s.name for s in recordings if _saturated(s, [t for t in tracks if t.name == s.name])]
    if names:
        out.append(
            f"the torque is saturated in {', '.join(names)}: its top is flat while the velocity "
            "goes on changing; record with lower acceleration"
        )
    return out


def _saturated(signals: Signals, tracks: Sequence[Track]) -> bool:
    """Return whether the torque has flat tops while the speed changes."""
    command = signals.velocity_command_rad_s
    flat = total = 0
    for track in tracks:
        count = max(int(_FLAT_S / track.period_s), 5)
        if track.torque_nm.shape[0] < 4 * count:
            continue
        flat += _flat_samples(track, count)
        total += track.torque_nm.shape[0]
    if total == 0 or flat < _FLAT_SHARE * total:
        return False
    if command is None or signals.velocity_rad_s is None:
        return True
    # A set-point that is kept everywhere says that the drive had torque enough.
    short = np.abs(command - signals.velocity_rad_s)[signals.valid]
    fastest = float(np.max(np.abs(command[signals.valid]), initial=0.0))
    return bool(np.quantile(short, 0.98) > 0.05 * fastest)


def _flat_samples(track: Track, count: int) -> int:
    """Return how many samples lie on a flat top during which the velocity changes."""
    torque, speed = track.torque_nm, track.velocity_rad_s
    noise = float(np.median(np.abs(np.diff(torque, n=2)))) / (0.6745 * np.sqrt(6.0))
    smooth = np.convolve(torque, np.ones(count) / count, mode="same")
    out = 0
    for sign in (1.0, -1.0):
        top = float(np.max(sign * smooth))
        if top <= 0.0:
            continue
        margin = max(_FLAT_SIGMAS * noise / np.sqrt(count), 1e-9 * top, 0.003 * top)
        high = sign * smooth > max(top - 2.0 * margin, _TOP * top)
        for begin, end in _runs(high):
            moved = abs(float(speed[end - 1] - speed[begin]))
            if end - begin >= count and moved > _MOVED * float(np.max(np.abs(speed))):
                out += end - begin
    return out


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the beginnings and ends of the runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
