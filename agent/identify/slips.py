"""Positions that jump where the joint did not: an encoder, its counting or its coupling slipped.

The velocity says how far the joint can have come between two samples. A sample that comes late is
off by what the joint moved meanwhile, and so is the next one, the other way: what stays is a jump.
Behind it the arm is elsewhere than it is said to be, and with it gravity and every place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.identify.signals.arrays import Signals
from agent.numbers import significant

_ARM_RAD = 2e-3  # of the arm: less changes no answer
_NOISE, _BESIDE = 30.0, 5.0  # times the usual miss, and the greatest beside it
_NEAR = 8  # samples to either side over which a jump stays
_STAYS = (0.7, 1.4)  # of itself
_MOST = 3  # jumps: more are a position that begins anew, or a velocity of another kind
_GAP = 1.5  # times the usual time between two samples


def slips(signals: Signals) -> tuple[tuple[float, float], ...]:
    """Return when a position jumped, s, and by how much, rad on the motor's side.

    Nothing where position or velocity was not recorded, or where it happens often.

    Parameters
    ----------
    signals : Signals
    """
    position, velocity, time = signals.position_rad, signals.velocity_rad_s, signals.time_s
    if position is None or velocity is None or time.shape[0] <= 4 * _NEAR:
        return ()
    step_s, ok = np.diff(time), signals.valid[1:] & signals.valid[:-1]
    ok &= (step_s > 0.0) & (step_s < _GAP * float(np.median(step_s)))
    mean = 0.5 * (velocity[1:] + velocity[:-1])
    missed = np.where(ok, np.diff(position) - mean * step_s, 0.0)
    missed[~np.isfinite(missed)] = 0.0
    open_rad = 0.25 * np.abs(np.nan_to_num(np.diff(velocity))) * step_s
    usual = 1.4826 * float(np.median(np.abs(missed[ok] - np.median(missed[ok])))) if ok.any() else 0
    least = max(_ARM_RAD * signals.gear_ratio, _NOISE * usual)
    found = [
        (float(time[k + 1]), float(missed[k]))
        for k in np.flatnonzero(np.abs(missed) > least + open_rad)
        if _stays(missed, int(k))
    ]
    return tuple(found) if len(found) <= _MOST else ()


def _stays(missed: np.ndarray[tuple[int], np.dtype[np.float64]], at: int) -> bool:
    """Return whether a miss is alone, and not taken back by those about it."""
    near = missed[max(at - _NEAR, 0) : at + _NEAR + 1]
    beside = np.sort(np.abs(near))[-2]
    share = float(near.sum()) / float(missed[at])
    return bool(abs(missed[at]) > _BESIDE * beside and _STAYS[0] <= share <= _STAYS[1])


def slips_said(recordings: Sequence[Signals]) -> tuple[str, ...]:
    """Return what is to be said of every recording whose position jumped.

    Parameters
    ----------
    recordings : sequence of Signals
    """
    out = []
    for signals in recordings:
        for at_s, by_rad in slips(signals):
            arm_deg = math.degrees(abs(by_rad) / signals.gear_ratio)
            out.append(
                f"{signals.name}: at {at_s - signals.time_s[0]:.4g} s the position jumps by "
                f"{significant(arm_deg, 2)} degrees of the arm, which its velocity does not show: "
                "see whether the encoder, its counting or its coupling slipped; behind it the arm "
                "stands elsewhere than is recorded"
            )
    return tuple(out)
