"""Where a joint holds one speed: the passes of a recording, on its stretches' grids.

A pass is what `agent.identify.signals.windows` finds: one level of velocity, ramps cut off. Its
direction is that of its mean, however noisy the single sample or much a slow motor stutters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.direction import direction_of
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.sampling import Stretch
from agent.identify.signals.windows import SteadyWindow, find_windows

_SIGMAS = 4.0
_CLEARLY = 2.0  # times what noise reaches: a pass so fast shows a standstill as one
_ONE_SPEED = 0.8  # of a stretch: with so much of it in one pass, nothing accelerates it


@dataclass(frozen=True)
class Held:
    """The passes of one stretch, on its even grid of n samples.

    Parameters
    ----------
    velocity_rad_s : ndarray, shape (n,)
        Mean velocity of the pass that a sample belongs to; 0 outside every pass.
    step : ndarray, shape (n,)
        Number of the velocity step, from 0: a pass with the change of speed that leads to it.
    one_speed : bool
        Whether hardly anything but one pass is in it: what accelerates is unrest, not the motion.
    """

    velocity_rad_s: Floats
    step: Floats
    one_speed: bool


def held_speeds(motion: Motion) -> tuple[Held, ...]:
    """Return the passes of every stretch of a recording."""
    windows = find_windows(motion, compiled=True)
    return tuple(_held(stretch, motion, windows) for stretch in motion.timing.stretches)


def _held(stretch: Stretch, motion: Motion, windows: Sequence[SteadyWindow]) -> Held:
    time_s, own_s = stretch.time_s, motion.signals.time_s
    velocity = np.zeros(time_s.shape[0])
    ends = []
    for window in windows:
        first = int(np.searchsorted(time_s, own_s[window.start], side="left"))
        last = int(np.searchsorted(time_s, own_s[window.stop - 1], side="right"))
        if last > first:
            velocity[first:last] = window.velocity_rad_s
            ends.append(last)
    step = np.searchsorted(np.array(ends[:-1]), np.arange(time_s.shape[0]), side="right")
    inside = int(np.count_nonzero(velocity))
    alone = len(ends) == 1 and inside >= _ONE_SPEED * time_s.shape[0]
    return Held(velocity, step.astype(np.float64), alone)


def direction_in_passes(
    velocity: Floats, held: Held, period_s: float, cutoff_hz: float, noise_rad_s: float
) -> Floats:
    """Return the direction of motion, -1, 0 or 1, shape (n,), where dips do not turn a pass round.

    Outside passes it is `direction_of`. Inside, a sample of unknown or opposite direction takes the
    pass's own, if in the band of the comparison the joint goes on that way; or if the pass is so
    slow against the noise that a standstill could not be told from it.

    Parameters
    ----------
    velocity : ndarray, shape (n,)
        Unfiltered velocity, rad/s.
    held : Held
    period_s, cutoff_hz : float
    noise_rad_s : float
        Standard deviation of the unfiltered velocity's white noise.
    """
    own = direction_of(velocity, period_s, cutoff_hz, noise_rad_s)
    sign = np.sign(held.velocity_rad_s)
    asked = (sign != 0.0) & (own != sign)
    if not asked.any():
        return own
    smooth = sign * lowpass(velocity, period_s, cutoff_hz)
    reach = _SIGMAS * noise_rad_s * np.sqrt(min(2.0 * cutoff_hz * period_s, 1.0))
    unclear = (np.abs(held.velocity_rad_s) < _CLEARLY * reach) & (smooth > -reach)
    return np.where(asked & ((smooth > reach) | unclear), sign, own)
