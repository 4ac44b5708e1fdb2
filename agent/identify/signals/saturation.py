"""Whether the torque is cut off: it piles up at its highest or lowest value while speeds differ.

A torque that nothing limits thins out towards its extremes, or reaches them at one speed. One that
a drive limits stays within its own noise of the limit, whatever the joint does meanwhile.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import Motion, read_motion

_SIGMAS = 4.0  # of the torque's noise: the width in which a limited torque stays
_PILE = 5.0  # times as many samples at the limit as in the next band of that width
_SHARE = 0.005  # of all samples
_FEWEST = 25
_MEANS = (1, 2, 4, 8, 16)  # samples
_STILL_NOISE = 1.6  # times what noise would be: more is motion
_SPREAD = 0.1  # of the fastest speed: by so much must the speeds at a limit differ


def limited_share(motion: Motion) -> float:
    """Return the share of a recording's samples whose torque is cut off; 0 where none is.

    Parameters
    ----------
    motion : Motion
        The recording; its torque may hold noise that was added behind the limit.
    """
    velocity = motion.own_velocity_rad_s()
    known = motion.signals.valid & np.isfinite(velocity)
    torque, speed = motion.signals.torque_nm[known], np.abs(velocity[known])
    if torque.size < _FEWEST:
        return 0.0
    steps = np.abs(np.diff(torque))
    width = float(np.ptp(torque))
    # What rings between two samples is no noise: the second differences see less of it.
    bends = np.abs(np.diff(torque, n=2))
    noise = min(float(np.median(d)) / np.sqrt(c) for d, c in ((steps, 2.0), (bends, 6.0))) / 0.6745
    coarse = float(np.min(steps[steps > 1e-9 * width], initial=width))
    # Half a step of a coarse channel, so that neighbouring levels stay apart.
    band = max(_SIGMAS * noise, min(0.5 * coarse, 1e-3 * width), 1e-6 * width)
    if band > 0.1 * width:
        return 0.0
    # Torque is asked of moving parts: a brake's or gravity's rest is no limit.
    count = sum(_piled(side * torque, speed, band) for side in (1.0, -1.0))
    return count / torque.size


def is_limited(signals: Signals) -> bool:
    """Return whether a drive's limit cuts the torque off, behind noise that was added, too.

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


def _piled(torque: Floats, speed: Floats, band: float) -> int:
    """Return how many samples lie at the highest torque if they are cut off there, else 0."""
    top = float(torque.max())
    at_limit = torque > top - band
    below = (torque <= top - band) & (torque > top - 2.0 * band)
    count = int(np.count_nonzero(at_limit))
    enough = max(_FEWEST, _SHARE * torque.size)
    if count < enough or count < _PILE * int(np.count_nonzero(below)):
        return 0
    low, high = np.quantile(speed[at_limit], (0.1, 0.9))
    return count if high - low > _SPREAD * float(speed.max()) else 0


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
