"""Whether steady windows are the levels of a stair, or moments of a velocity that never settles.

A velocity that creeps, or hunts about its set-point, is steady for moments too. Such moments follow
each other and drift towards each other, or come back to a level that they have just left. A stair's
windows do neither: they are level, however small the step to the next one is, or a stop or a
reversal lies between them. A triangle or
ramp creeps all the way: it is no stair, and is not judged as one. Nor is a sum of sines, as robots'
rigid bodies are identified with: from one turn to the next it has no level that it could settle at.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.windows import SteadyWindow

_CREEP = 0.15  # step between windows that a creeping velocity makes, as a share of the faster one
_CREEP_GAP = 0.5  # of the shorter window
_DRIFT = 0.15  # of the step to the next window: a level drifts less
_RETURN = 0.05  # levels that are the same
_RETURN_GAP = 6.0  # of the longer window: a stop and a new start take longer
_REST = 0.05  # of the speed before: slower is a stop,
_RESTS = 3  # and no single sample
_SHARE = 0.15  # of the windows
_FEWEST = 5
_SLOW = 0.02  # of the fastest: slower, the joint stands or turns round
_NEAR = 0.25  # of a pass's median velocity: what settles is as near to its level
_LEVEL = (
    0.5  # of the motion: a loop that hunts or creeps is near a level always, a sine for a third
)
_MOSTLY = 0.5  # of all change of velocity from window to window: more is a ramp


def never_settles(motion: Motion, windows: Sequence[SteadyWindow]) -> bool:
    """Tell whether a recording's windows are moments of a velocity that never settles.

    Windows between which samples are missing are not judged: there the velocity was not seen.

    Parameters
    ----------
    motion : Motion
        The recording.
    windows : sequence of SteadyWindow
        Its windows, in order of time.
    """
    if len(windows) < _FEWEST or not _has_levels(motion):
        return False
    ends = np.array([stretch.index[-1] for stretch in motion.timing.stretches])
    piece = np.searchsorted(ends, [w.start for w in windows])
    speed = np.array([w.velocity_rad_s for w in windows])
    drift, velocity = _drifts(motion, windows), motion.own_velocity_rad_s()
    restless, crept = 0, 0.0
    for k, window in enumerate(windows):
        for later in range(k + 1, min(k + 3, len(windows))):
            same_way = window.velocity_rad_s * windows[later].velocity_rad_s > 0.0
            if not same_way or piece[later] != piece[k]:
                break
            if _stops(velocity[window.stop : windows[later].start], window.velocity_rad_s):
                break
            if _belong_together(window, windows[later], max(drift[k], drift[later])):
                restless += 1
                crept += abs(speed[later] - speed[k])
                break
    if crept > _MOSTLY * float(np.abs(np.diff(speed)).sum()):
        return False
    return restless >= _SHARE * len(windows)


def _has_levels(motion: Motion) -> bool:
    """Tell whether most of a motion is near the level of its pass, from stop to stop."""
    near = moving = 0
    velocities = [v for v in motion.velocity_rad_s if v.size]
    fastest = max((float(np.quantile(np.abs(v), 0.98)) for v in velocities), default=0.0)
    for velocity in velocities:
        way = np.where(np.abs(velocity) > _SLOW * fastest, np.sign(velocity), 0.0)
        for one in np.split(velocity, np.flatnonzero(np.diff(way)) + 1):
            level = float(np.median(one))
            if abs(level) > _SLOW * fastest:
                moving += one.size
                near += int(np.count_nonzero(np.abs(one - level) < _NEAR * abs(level)))
    return near > _LEVEL * moving


def _drifts(motion: Motion, windows: Sequence[SteadyWindow]) -> list[float]:
    """Return how far the velocity moves from the first to the last third of each window, rad/s."""
    velocity = motion.own_velocity_rad_s()
    out = []
    for window in windows:
        inside = velocity[window.start : window.stop]
        third = max(inside.shape[0] // 3, 1)
        out.append(abs(float(np.nanmean(inside[-third:]) - np.nanmean(inside[:third]))))
    return out


def _stops(between: Floats, speed_rad_s: float) -> bool:
    """Tell whether a joint comes to rest between two windows: what hunts stays near its speed.

    One move of pick-and-place after the other, each at the same speed, is no hunting.
    """
    slow = np.abs(between) < _REST * abs(speed_rad_s)
    return bool(np.count_nonzero(slow) >= _RESTS)


def _belong_together(first: SteadyWindow, later: SteadyWindow, drift_rad_s: float) -> bool:
    """Tell whether two windows of one direction are moments of a creeping or hunting velocity.

    `drift_rad_s` is the greater of how far the velocity moves within each.
    """
    gap = later.start - first.stop
    lengths = sorted((first.stop - first.start, later.stop - later.start))
    faster = max(abs(first.velocity_rad_s), abs(later.velocity_rad_s))
    step = abs(first.velocity_rad_s - later.velocity_rad_s) / faster
    moving = drift_rad_s > _DRIFT * abs(first.velocity_rad_s - later.velocity_rad_s)
    creeps = step < _CREEP and gap < _CREEP_GAP * lengths[0] and moving
    returns = step < _RETURN and gap < _RETURN_GAP * lengths[1]
    return creeps or returns
