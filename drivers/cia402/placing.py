"""Whether a sample belongs where the ledger has put it in time, by what the joint did meanwhile.

Between two samples the position changes by the mean velocity times the time between them. Booked
one SYNC too early or too late, a sample of a moving joint is off by a whole period's travel: where
that is more than the motion leaves open, the sample is borne out or contradicted; at standstill and
at a reversal nothing can be said.
"""

from __future__ import annotations

import math

from drivers.cia402.answers import Place
from drivers.cia402.scaling import Scaling
from drivers.ports import Sample

_COUNTS = 2


class Placing:
    """Judges the samples of one drive in the order of their SYNCs.

    Parameters
    ----------
    period_s : float
        Between two SYNCs.
    scaling : Scaling
        How finely the drive counts.
    """

    def __init__(self, period_s: float, scaling: Scaling) -> None:
        self._period_s = period_s
        self._position_step_rad = _COUNTS * abs(scaling.position_rad(1) - scaling.position_rad(0))
        self._velocity_step_rad_s = _COUNTS * abs(
            scaling.velocity_rad_s(1) - scaling.velocity_rad_s(0)
        )
        self._last: Sample | None = None
        self._suspicious = False

    def judge(self, sample: Sample) -> Place:
        """Return whether the motion since the last sample bears `sample` out.

        The travel between two samples differs from trapezoid's rule by at most a quarter of the
        change of velocity times the time, when acceleration is anywhere between none and what
        makes that change at once. A drive that hears a SYNC late measures late, by no more than its
        answer comes late: a sample may be ahead by its own delay, or behind by that of the one
        before it. Where only that explains a sample, it is doubtful. After such a one, or one that
        was contradicted, what cannot be told is doubtful, too, until a sample is borne out or needs
        no second look; all are held against the last one before.
        """
        last = self._last
        if last is None:
            return Place.UNKNOWN
        span_s = sample.time_s - last.time_s
        mean_rad_s = 0.5 * (sample.velocity_rad_s + last.velocity_rad_s)
        travel_rad = sample.position_rad - last.position_rad
        ahead_rad = math.copysign(1.0, mean_rad_s) * (travel_rad - mean_rad_s * span_s)
        half_rad = 0.5 * abs(mean_rad_s) * self._period_s
        change_rad_s = abs(sample.velocity_rad_s - last.velocity_rad_s)
        open_rad = (
            0.25 * change_rad_s + self._velocity_step_rad_s
        ) * span_s + self._position_step_rad
        slack_rad = abs(mean_rad_s) * _delay_s(sample if ahead_rad > 0.0 else last)
        if abs(ahead_rad) > half_rad + open_rad:
            self._suspicious = True
            late = abs(ahead_rad) <= half_rad + open_rad + slack_rad
            return Place.DOUBTFUL if late else Place.CONTRADICTED
        if abs(ahead_rad) <= half_rad and half_rad > open_rad:
            return Place.BORNE_OUT
        return Place.DOUBTFUL if self._suspicious else Place.UNKNOWN

    def keep(self, sample: Sample) -> None:
        """Take a sample as one that is where it belongs: what follows is held against it."""
        self._last = sample
        self._suspicious = False


def _delay_s(sample: Sample) -> float:
    """Return how long after its SYNC an answer came, at most by so much it may be too new."""
    return max(0.0, sample.received_s - sample.time_s)
