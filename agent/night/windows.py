"""Quiet windows on the wall's clock as moments in UTC, through every change of the clock.

On a night when the clock is changed, a time that occurs twice or never is taken so that the
window becomes shorter, never longer: what is quiet for certain.
"""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from dataclasses import dataclass

from agent.night.description import DAYS, AxisNight

_DAY = datetime.timedelta(days=1)


@dataclass(frozen=True)
class Window:
    """One axis's quiet window of one night.

    Parameters
    ----------
    axis : int
    night : datetime.date
        The local date on which it begins: the night's name.
    begins, ends : datetime.datetime
        UTC. Not later than it begins: the clock's change leaves nothing of it.
    """

    axis: int
    night: datetime.date
    begins: datetime.datetime
    ends: datetime.datetime

    @property
    def key(self) -> tuple[int, str]:
        """Return what no two windows share."""
        return self.axis, self.night.isoformat()


def window_of(axis: AxisNight, night: datetime.date, zone: datetime.tzinfo) -> Window:
    """Return the window that begins on a local date."""
    end_date = night if axis.ends > axis.begins else night + _DAY
    begins = max(_moments(night, axis.begins, zone))
    ends = min(_moments(end_date, axis.ends, zone))
    return Window(axis.number, night, begins, ends)


def windows_between(
    axis: AxisNight, zone: datetime.tzinfo, since: datetime.datetime, until: datetime.datetime
) -> Iterator[Window]:
    """Yield the windows that end after `since` and begin before `until`, in order."""
    night = since.astimezone(zone).date() - 2 * _DAY
    last = until.astimezone(zone).date() + _DAY
    while night <= last:
        if DAYS[night.weekday()] in axis.days:
            window = window_of(axis, night, zone)
            if window.ends > since and window.begins < until:
                yield window
        night += _DAY


def _moments(
    date: datetime.date, time: datetime.time, zone: datetime.tzinfo
) -> tuple[datetime.datetime, datetime.datetime]:
    """Return the two readings of a local time, which are one except where the clock is changed."""
    local = datetime.datetime.combine(date, time, zone)
    first, second = (local.replace(fold=fold).astimezone(datetime.UTC) for fold in (0, 1))
    return first, second
