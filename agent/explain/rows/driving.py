"""The velocity that drives what is behind the gear: as reported, its way kept to the position's.

A reported velocity is noisy from sample to sample, and its sum walks away from the way that the
motor went: by a few tenths of a milliradian while the teeth of a gap are apart, which is as much
as a narrow gap is wide. A position knows the way, and not the speed: an encoder has steps, and
stamps err. Below the frequency at which the one's noise is as large as the other's, differentiated,
the position tells the velocity, above it the drive does (a complementary filter; Higgins, IEEE
Trans. Aerosp. Electron. Syst. 11 (1975) 321).
"""

from __future__ import annotations

import math

import numpy as np

from agent.explain.rows.lag import Lag, earlier
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.sampling import Stretch, through_neighbours
from agent.physics.derivative import slope

_LOWEST_HZ = 1.0  # below it nothing is gained: teeth are apart for some hundredths of a second
_FEWEST = 50  # samples, to know a noise by
_NORMAL_MEDIAN = 0.6745
_THIRD, _FOURTH = math.sqrt(20.0), math.sqrt(70.0)  # of white noise, its differences


def driving_velocity(
    signals: Signals, stretch: Stretch, velocity: Floats, lag: Lag, cutoff_hz: float, *, align: bool
) -> Floats:
    """Return a stretch's velocity, shape (n,), with the position's way.

    Parameters
    ----------
    signals : Signals
        The recording, with position and velocity.
    stretch : Stretch
    velocity : ndarray, shape (n,)
        As it was reported, on the stretch's grid.
    lag : Lag
        By how much it is later than the position.
    cutoff_hz : float
        Of the comparison's band, in which the lag is known.
    align : bool
        Whether what is returned is in step with the position, and not with the velocity.
    """
    position, period_s = signals.position_rad, stretch.period_s
    as_given = lag.undone(velocity, period_s, cutoff_hz) if align else velocity
    if position is None or velocity.shape[0] < _FEWEST:
        return as_given
    way = period_s * np.concatenate(([0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]))))
    # Where samples are missing both are known at the ends alone: so it is their difference that is
    # carried over the gap, and not the position, which does not go in a straight line.
    short = stretch.on_grid(signals, _beside(signals, stretch, position, way))
    bend = lag.bend_s2 + 0.5 * lag.late_s**2
    smooth = lowpass(velocity, period_s, cutoff_hz)
    short = short - lag.late_s * velocity - bend * slope(smooth, period_s)
    reported = float(np.median(np.abs(np.diff(velocity, n=3)))) / _NORMAL_MEDIAN / _THIRD
    # Not the median: a stamp that errs is felt at speed, and an encoder at rest has no noise.
    stepped = float(np.sqrt(np.mean(np.diff(short, n=4) ** 2))) / _FOURTH
    crossing_hz = reported / (2.0 * math.pi * stepped) if stepped > 0.0 else math.inf
    if not crossing_hz > _LOWEST_HZ:
        return as_given
    missing = slope(lowpass(short, period_s, crossing_hz), period_s)
    return as_given + (earlier(missing, lag.late_s, period_s) if align else missing)


def _beside(signals: Signals, stretch: Stretch, position: Floats, way: Floats) -> Floats:
    """Return a position less a way that is known on a stretch's grid, at the recording's samples.

    NaN outside the stretch.
    """
    out = np.full(position.shape[0], np.nan)
    own_s = signals.time_s[stretch.index]
    gone = through_neighbours(own_s, stretch.time_s, way) if stretch.resampled else way
    out[stretch.index] = position[stretch.index] - gone
    return out
