"""What speaks against a recording although it can be read: limits, unrest, a slow clock.

Each objection ends with what to record instead.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.identify.signals.preprocess import Motion
from agent.identify.signals.saturation import limited_share
from agent.identify.signals.settling import never_settles
from agent.identify.signals.windows import SteadyWindow

_SLOW_HZ = 20.0
_JUMP = 0.1  # of the fastest speed, from one sample to the next
_JUMPED = 0.5  # of all change of velocity


def objections(motion: Motion, windows: Sequence[SteadyWindow]) -> list[str]:
    """Return every objection to one recording, in plain words; empty where there is none.

    Parameters
    ----------
    motion : Motion
        The recording.
    windows : sequence of SteadyWindow
        Its steady windows, in order of time.
    """
    name, found = motion.signals.name, []
    limited = limited_share(motion)
    if limited > 0.0:
        found.append(
            f"{name}: the torque is cut off at a limit during {100 * limited:.1f} % of the time; "
            "record a gentler motion (less acceleration or lower speeds), or raise the limit"
        )
    if never_settles(motion, windows):
        found.append(
            f"{name}: the velocity never settles: it creeps or hunts while it should be steady; "
            "record with every speed held for longer, or with a better tuned loop"
        )
    # Passes of many samples carry their means however slow the clock is.
    if not windows and jumps(motion):
        found.append(too_slow(motion))
    return found


def too_slow(motion: Motion) -> str:
    """Say that the speed changes between samples, and what to record instead."""
    return (
        f"{motion.signals.name}: sampled at {motion.timing.sample_rate_hz:.3g} Hz, too slow for "
        "this motion: the speed changes between one sample and the next; record at 100 Hz or faster"
    )


def too_few_speeds(speeds_rad_s: Sequence[float]) -> str:
    """Say why two speeds make no friction law."""
    shown = " and ".join(f"{v:.3g}" for v in speeds_rad_s)
    return (
        f"there are only two steady speeds ({shown} rad/s): a line goes through two points "
        "whatever the friction law is; record at least three, better ten, in both directions"
    )


def jumps(motion: Motion) -> bool:
    """Tell whether most of the velocity's change happens between single samples."""
    if not 0.0 < motion.timing.sample_rate_hz < _SLOW_HZ or not motion.velocity_rad_s:
        return False
    steps = np.concatenate([np.abs(np.diff(v)) for v in motion.velocity_rad_s])
    fastest = max(float(np.max(np.abs(v), initial=0.0)) for v in motion.velocity_rad_s)
    change = float(steps.sum())
    return change > 0.0 and float(steps[steps > _JUMP * fastest].sum()) > _JUMPED * change
