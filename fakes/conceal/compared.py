"""What of a motion a comparison of torques sees: a band, away from starts and reversals.

Whoever compares torques low-passes them, and leaves out where dry friction turns round: there a
simulation is wrong whatever it knows. A soft gear, a gap or a delay has most of its energy just
there or above the band, a drift of friction has none, so that of a mixture these see other shares
than the whole motion has. How wide the band is, is the tool's to say; so it is told for several.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fakes.conceal.measure import Floats, Seen
from fakes.conceal.refit import Booleans, sliding

BANDS_HZ = (5.0, 10.0, 20.0, 40.0)
EDGE_ARM_RAD = 2e-4
"""Of the arm's travel after a start or a reversal."""

_STANDS_RAD_S = 0.1  # of the motor: what comes out of the noise of a velocity
_ORDER = 4
_PADDING, _ENDS = 3.0, 1.5  # of the cutoff's period: what is added at an end, what it spoils


def low_passed(values: Floats, period_s: float, cutoff_hz: float) -> Floats:
    """Return signals, shape (n, k), low-passed without phase shift; a half is left at the cutoff.

    A Butterworth low-pass forward and backward: ``1 / (1 + (f / fc)^8)``, on oddly extended ends.
    """
    count = values.shape[0]
    pad = min(count - 1, math.ceil(_PADDING / (cutoff_hz * period_s)))
    first, last = 2.0 * values[0] - values[pad:0:-1], 2.0 * values[-1] - values[-2 : -pad - 2 : -1]
    frequency = np.fft.rfftfreq(count + 2 * pad, period_s)
    response = 1.0 / (1.0 + (frequency / cutoff_hz) ** (2 * _ORDER))
    # In a circle: the way from the end back to the beginning is taken off, which all bands keep.
    extended = np.concatenate((first, values, last))
    way = np.linspace(0.0, 1.0, extended.shape[0])[:, np.newaxis]
    line = extended[0] + way * (extended[-1] - extended[0])
    spectrum = np.fft.rfft(extended - line, axis=0) * response[:, np.newaxis]
    smooth = np.fft.irfft(spectrum, n=extended.shape[0], axis=0) + line
    return np.asarray(smooth[pad : pad + count])


def compared(
    seen: Sequence[Seen], gear_ratio: float, period_s: float, cutoff_hz: float
) -> tuple[Booleans, ...]:
    """Return which samples of each run are compared in a band, shape (n,) each.

    Not where the joint stands, nor within the cutoff's period of an edge, nor near a run's ends.
    """
    out = []
    for run in seen:
        edge = EDGE_ARM_RAD * gear_ratio
        slides = sliding(run.velocity_rad_s, run.position_rad, edge, _STANDS_RAD_S)
        count, memory = slides.shape[0], round(1.0 / (cutoff_hz * period_s))
        edges = np.concatenate(([0], np.cumsum(~slides)))
        at = np.arange(count)
        near = edges[np.minimum(at + memory + 1, count)] - edges[np.maximum(at - memory, 0)]
        end = math.ceil(_ENDS / (cutoff_hz * period_s))
        out.append(np.asarray((near == 0) & (at >= end) & (at < count - end)))
    return tuple(out)
