"""The acceleration at corners of a speed, where torque and motion are samples of a jump.

A prescribed motion, as most simulators have it, begins and ends its ramps between two samples, or
at one. Its torque jumps with the acceleration, and a sample of it is from before the corner or from
after it, never from in between. Differences of the speed across the corner are in between: over all
rows, what they are wrong by is as much as the jump for up to half a sample, at random. Differences
that stay on the sample's own side of the corner are not.

A ramp of two or three samples, as between the slowest speeds of a stair, has no sample whose
neighbours are both in it. Where the other ramps have one acceleration it has the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.run import CORNERS, Run
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.sampling import Stretch, find_stretches
from agent.physics.derivative import slope

_SHARP, _CLEAR = 3.5, 5.0  # times what the speed bends by at the samples around, and its noise
_ROUNDED = 1e-9  # of the greatest speed: what bends by less was rounded
_ALONE = 3  # samples on either side of a corner that another one keeps away from
_AT_A_SAMPLE = 0.03  # of a sample: a corner that is no further from it is there
_UNSURE = 1.5  # times the noise over the jump, of a sample: where a corner may be as well
_OF_NOISE = 4.0  # times its own noise: a jump of the torque that tells on which side a sample is
_OFF = 0.25  # of the jump: how far such a sample of the torque is from either side of it
_MOSTLY, _FEWEST = 0.7, 3  # corners at which the torque has to jump from one sample to the next
_SEEN = 0.4  # ... and where the motion has its corner: it may be a sample off, but not mostly
_MOST_LATE = 8  # samples that it may do so after the motion
_STANDS = 1e-3  # of the greatest speed
_EITHER = 0.5  # of a jump that the torque does not show
_SHORT = 8  # samples: a ramp that is longer has corners that stand alone
_ALIKE = 0.05  # of an acceleration: by so much at most others differ from it
_AHEAD = np.array([4.0, 1.0, -2.0]) / 3.0
"""Where a straight line through three values, the nearest one first, would go on."""
_BACK = 0.2  # of a ramp's corners together: how much more one of them bends than the other
_SECOND = 6.0**0.5  # of white noise, its second differences


def with_corners(runs: Sequence[Run]) -> tuple[Run, ...]:
    """Return runs that know what their accelerations are beside differences of the motion.

    As they are where there are no corners, where noise hides them, and where the torque does not
    jump from one sample to the next: what was averaged or filtered goes with what lies in between.

    Parameters
    ----------
    runs : sequence of Run
        As often sampled as they were recorded; the speed's differences are taken where one was
        reported, and else those of the position.
    """
    return tuple(_with_corners(run) for run in runs)


def _with_corners(run: Run) -> Run:
    signals = run.signals
    beside = np.zeros_like(signals.torque_nm)
    for stretch in find_stretches(signals).stretches:
        own = _places(stretch, signals)
        if own is not None:
            beside[stretch.index] = _beside(stretch, signals)[own]
    return replace(run, columns={**run.columns, CORNERS: beside}) if beside.any() else run


def _places(stretch: Stretch, signals: Signals) -> NDArray[np.int64] | None:
    """Return where on its even grid a stretch's samples are, shape (m,); None where they are not.

    A lost row leaves the others where they were: what is filled in is beside a hole, and is not
    compared.
    """
    if not stretch.resampled:
        return np.arange(stretch.index.shape[0])
    steps = (signals.time_s[stretch.index] - stretch.time_s[0]) / stretch.period_s
    places = np.rint(steps).astype(np.int64)
    inside = places[-1] < stretch.time_s.shape[0]
    return places if inside and float(np.max(np.abs(steps - places))) < _AT_A_SAMPLE else None


def _beside(stretch: Stretch, signals: Signals) -> Floats:
    """Return the acceleration on the torque's side of corners less that across them, shape (n,)."""
    motion: _Speed | _Angle
    if signals.velocity_rad_s is not None:
        motion = _Speed(stretch.on_grid(signals, signals.velocity_rad_s), stretch.period_s)
    else:
        assert signals.position_rad is not None
        motion = _Angle(stretch.on_grid(signals, signals.position_rad), stretch.period_s)
    torque = stretch.on_grid(signals, signals.torque_nm)
    corners, out = motion.corners(), np.zeros_like(torque)
    jumps = _Jumps(torque, _OF_NOISE * _noise(torque))
    # Where the joint starts and stops friction jumps as well.
    late = _late([c for c in corners if motion.slides(c)], jumps)
    if late is None:
        return out
    across, sizes = motion.across, list[float]()
    for corner in corners:
        own = jumps.refined(corner, late)
        first, last = min(corner.at, own.at), max(corner.after, own.after)
        before, after = motion.sides(first, last)
        beside = motion.own_side(first, last)
        sizes.append(abs(motion.well_after(last) - motion.well_before(first)))
        for sample in range(first, last + 1):
            beside[sample] = before if sample <= own.at else after
        if not own.between:
            share = jumps.share(own.at + late, own.at + late, own.at + late)
            part = _EITHER if share is None else min(max(share, 0.0), 1.0)
            beside[own.at] = before + part * (after - before)
        for sample, acceleration in beside.items():
            out[sample] = acceleration - across[sample]
    typical = _typical(sizes)
    for ramp in motion.ramps() if typical > 0.0 else ():
        for sample, acceleration in _in_a_ramp(ramp, motion, jumps, late, typical).items():
            out[sample] = acceleration - across[sample]
    return out


def _typical(sizes: Sequence[float]) -> float:
    """Return by how much the acceleration jumps at corners; 0 where they differ."""
    typical = float(np.median(sizes)) if len(sizes) >= _FEWEST else 0.0
    unlike = float(np.median(np.abs(np.asarray(sizes) - typical))) if typical else 0.0
    return typical if unlike < _ALIKE * typical else 0.0


def _in_a_ramp(
    ramp: _Ramp, motion: _Speed | _Angle, jumps: _Jumps, late: int, typical: float
) -> dict[int, float]:
    """Return the accelerations of a short ramp's samples and of those around it.

    None where the torque does not show which samples are in it, or shows another ramp.
    """
    inside = jumps.pulse(ramp.first + late, ramp.last + late)
    if inside is None:
        return {}
    first, last = inside[0] - late, inside[1] - late
    before, after = motion.sides(ramp.first, ramp.last)
    if abs(abs(ramp.change) / motion.period_s / typical - (last - first + 1)) > 1.0:
        return {}
    beside = motion.own_side(ramp.first, ramp.last)
    for sample in range(ramp.first, ramp.last + 1):
        beside[sample] = before if sample < first else after
    within = 0.5 * (before + after) + math.copysign(typical, ramp.change)
    return beside | dict.fromkeys(range(first, last + 1), within)


@dataclass(frozen=True)
class _Corner:
    """Where a speed has a corner: at a sample, or between it and the next."""

    at: int
    between: bool

    @property
    def after(self) -> int:
        """Return the first sample that is not before it."""
        return self.at + self.between


@dataclass(frozen=True)
class _Ramp:
    """A ramp whose corners do not stand alone: the samples around it, and by what it changes."""

    first: int
    last: int
    change: float


@dataclass(frozen=True)
class _Speed:
    """A speed's samples, rad/s, shape (n,)."""

    values: Floats
    period_s: float

    @property
    def across(self) -> Floats:
        """Return its derivative, shape (n,), by differences that ask for no corner."""
        return slope(self.values, self.period_s)

    def corners(self) -> list[_Corner]:
        """Return the corners that stand alone, in the order of time."""
        return _corners(self.values, 0.0)

    def ramps(self) -> list[_Ramp]:
        """Return the ramps between others, in the order of time."""
        return _ramps(self.values, 0)

    def slides(self, corner: _Corner) -> bool:
        """Return whether the joint moves on either side of a corner."""
        return _moves(self.values, corner.at - 1, corner.after + 1)

    def sides(self, first: int, last: int) -> tuple[float, float]:
        """Return the accelerations at the last sample before corners and the first one after."""
        early, late = self.values[first - 2 : first + 1], self.values[last : last + 3]
        before = 3.0 * early[2] - 4.0 * early[1] + early[0]
        after = 4.0 * late[1] - 3.0 * late[0] - late[2]
        return float(0.5 * before / self.period_s), float(0.5 * after / self.period_s)

    def well_before(self, first: int) -> float:
        """Return the acceleration two samples before one: a filter may reach one further."""
        return float(0.5 * (self.values[first - 1] - self.values[first - 3]) / self.period_s)

    def well_after(self, last: int) -> float:
        """Return the acceleration two samples after one."""
        return float(0.5 * (self.values[last + 3] - self.values[last + 1]) / self.period_s)

    def own_side(self, first: int, last: int) -> dict[int, float]:
        """Return the accelerations of the samples beside these that are on one side of corners."""
        early, late = self.values[first - 2 : first + 1], self.values[last : last + 3]
        # Five points reach over the corner from one sample further away.
        return {
            first - 1: float(0.5 * (early[2] - early[0]) / self.period_s),
            last + 1: float(0.5 * (late[2] - late[0]) / self.period_s),
        }


@dataclass(frozen=True)
class _Angle:
    """An angle's samples, rad, shape (n,)."""

    values: Floats
    period_s: float

    @property
    def across(self) -> Floats:
        """Return its second derivative, shape (n,), by differences that ask for no corner."""
        return slope(slope(self.values, self.period_s), self.period_s)

    def corners(self) -> list[_Corner]:
        """Return the corners of its speed that stand alone, in the order of time."""
        return _corners(np.diff(self.values) / self.period_s, 0.5)

    def ramps(self) -> list[_Ramp]:
        """Return the ramps of its speed between others, in the order of time."""
        return _ramps(np.diff(self.values) / self.period_s, 1)

    def slides(self, corner: _Corner) -> bool:
        """Return whether the joint moves on either side of a corner."""
        return _moves(np.diff(self.values), corner.at - 2, corner.after + 1)

    def sides(self, first: int, last: int) -> tuple[float, float]:
        """Return the accelerations at the last sample before corners and the first one after."""
        own = self.own_side(first, last)
        before, after = (
            float(_AHEAD @ [own[at + way * by] for by in (1, 2, 3)])
            for at, way in ((first, -1), (last, 1))
        )
        return before, after

    def well_before(self, first: int) -> float:
        """Return the mean acceleration of the three samples before one."""
        return float(np.mean([self._at(first - back) for back in (1, 2, 3)]))

    def well_after(self, last: int) -> float:
        """Return the mean acceleration of the three samples after one."""
        return float(np.mean([self._at(last + on) for on in (1, 2, 3)]))

    def own_side(self, first: int, last: int) -> dict[int, float]:
        """Return the accelerations of the samples beside these that are on one side of corners."""
        early = {first - back: self._at(first - back) for back in (1, 2, 3)}
        return early | {last + on: self._at(last + on) for on in (1, 2, 3)}

    def _at(self, sample: int) -> float:
        before, here, after = self.values[sample - 1 : sample + 2]
        return float((after - 2.0 * here + before) / self.period_s**2)


def _moves(speed: Floats, before: int, after: int) -> bool:
    """Return whether a speed is more than a standstill's at two of its samples, and of one sign."""
    least = _STANDS * float(np.max(np.abs(speed), initial=0.0))
    return bool(speed[before] * speed[after] > least**2)


def _bends(speed: Floats) -> tuple[Floats, float, float]:
    """Return by how much a speed bends at its samples, the noise of that, and the least corner."""
    bends = np.zeros_like(speed)
    bends[1:-1] = np.diff(speed, n=2)
    noise = float(np.median(np.abs(bends))) / 0.6745
    return bends, noise, max(_CLEAR * noise, _ROUNDED * float(np.max(np.abs(speed), initial=0.0)))


def _ramps(speed: Floats, begins: int) -> list[_Ramp]:
    """Return what a speed changes by within a few samples, between stretches that do not bend.

    Parameters
    ----------
    speed : ndarray, shape (m,)
    begins : int
        How many samples of the motion are before the first one of the speed, half ones up.
    """
    bends, _, least = _bends(speed)
    standing = _STANDS * float(np.max(np.abs(speed), initial=0.0))
    bent = np.flatnonzero(np.abs(bends) > 0.5 * least)
    out, margin = list[_Ramp](), _ALONE + 2
    for group in np.split(bent, np.flatnonzero(np.diff(bent) > _ALONE) + 1):
        if group.shape[0] < 2 or group[-1] - group[0] > _SHORT:
            continue
        first, last = int(group[0]) - 1, int(group[-1]) + 1
        if first < margin or last >= speed.shape[0] - margin:
            continue
        own = bends[group]
        alike = abs(float(own.sum())) < _BACK * float(np.abs(own).sum())
        moves = min(abs(speed[first]), abs(speed[last])) > standing
        if alike and moves and float(np.abs(own).max()) > least:
            line = 0.5 * (speed[first] - speed[first - 1] + speed[last + 1] - speed[last])
            change = float(speed[last] - speed[first] - line * (last - first))
            out.append(_Ramp(first, last + begins, change))
    return out


def _corners(speed: Floats, begins: float) -> list[_Corner]:
    """Return the corners of a speed that stand alone, in the order of time.

    Parameters
    ----------
    speed : ndarray, shape (m,)
    begins : float
        When the first of its samples is, in samples.
    """
    bends, noise, least = _bends(speed)
    size = np.abs(bends)
    margin, out = _ALONE + 2, list[_Corner]()
    for k in np.flatnonzero(size > 0.5 * least).tolist():
        # At the end one more, as the torque may have it a sample later.
        if not margin <= k < speed.shape[0] - margin - 1 or size[k] < max(size[k - 1 : k + 2]):
            continue
        own = np.maximum(bends[k - 1 : k + 2] * np.sign(bends[k]), 0.0)
        jump = float(own.sum())
        around = max(size[k - 1 - _ALONE : k - 1].max(), size[k + 2 : k + 2 + _ALONE].max())
        if not jump > max(least, _SHARP * around):
            continue
        at = begins + k + float(own[2] - own[0]) / jump
        between = abs(at - round(at)) > max(_AT_A_SAMPLE, _UNSURE * noise / jump)
        corner = _Corner(math.floor(at) if between else round(at), between)
        if not out or corner.at > out[-1].at + _ALONE:
            out.append(corner)
    return out


@dataclass(frozen=True)
class _Jumps:
    """How a torque goes through its jumps.

    Parameters
    ----------
    torque_nm : ndarray, shape (n,)
    least_nm : float
        A jump that is smaller tells nothing.
    """

    torque_nm: Floats
    least_nm: float

    def share(self, at: int, first: int, last: int) -> float | None:
        """Return how much of a jump around some samples is over at one; None for no jump."""
        if first < 1 or last + 1 >= self.torque_nm.shape[0]:
            return None
        before, after = float(self.torque_nm[first - 1]), float(self.torque_nm[last + 1])
        if not abs(after - before) > self.least_nm:
            return None
        return (float(self.torque_nm[at]) - before) / (after - before)

    def refined(self, corner: _Corner, late: int) -> _Corner:
        """Return where it jumps at a corner, or beside it: a speed is filtered, or comes late."""
        if self.is_sharp(corner, late):
            return corner
        splits = (_Corner(corner.at + by, True) for by in (0, -1, 1))
        halves = (_Corner(corner.at + by, False) for by in (0, 1, -1))
        return next((c for c in (*splits, *halves) if self.is_sharp(c, late)), corner)

    def pulse(self, first: int, last: int) -> tuple[int, int] | None:
        """Return the samples between two that a pulse takes, as sharp at either end; else None."""
        if first < 2 or last + 3 > self.torque_nm.shape[0]:
            return None
        part = self.torque_nm[first - 1 : last + 2]
        over = part - np.linspace(float(part[0]), float(part[-1]), part.shape[0])
        height = float(over[np.argmax(np.abs(over))])
        if not abs(height) > self.least_nm:
            return None
        share = over / height
        within = np.flatnonzero(share > 0.5)
        clear = np.all((share < _OFF) | (share > 1.0 - _OFF))
        if not clear or within[-1] - within[0] + 1 != within.shape[0]:
            return None
        return first - 1 + int(within[0]), first - 1 + int(within[-1])

    def is_there(self, corner: _Corner) -> bool:
        """Return whether it jumps at a corner, at once or a little later."""
        first, last = corner.at - 1, min(corner.after + _MOST_LATE + 1, self.torque_nm.shape[0] - 1)
        return abs(float(self.torque_nm[last] - self.torque_nm[first])) > self.least_nm

    def is_sharp(self, corner: _Corner, late: int) -> bool:
        """Return whether it jumps from one sample to the next, at a corner and so much later."""
        first, last = corner.at + late, corner.after + late
        begins, ends = self.share(first, first, last), self.share(last, first, last)
        if begins is None or ends is None or not 2 <= first <= self.torque_nm.shape[0] - 4:
            return False
        # It is over where the corner is: a filtered torque would go on to change.
        further = self.share(first - 2, first, last), self.share(last + 2, first, last)
        over = all(x is not None and min(abs(x), abs(1.0 - x)) < _OFF for x in further)
        return over and (not corner.between or (abs(begins) < _OFF and abs(1.0 - ends) < _OFF))


def _late(corners: Sequence[_Corner], jumps: _Jumps) -> int | None:
    """Return by how many samples the torque jumps after the motion; None where it does not jump."""
    told = [corner for corner in corners if jumps.is_there(corner)]
    if len(told) < _FEWEST:
        return None
    shares = [
        float(np.mean([jumps.is_sharp(corner, late) for corner in told]))
        for late in range(_MOST_LATE + 1)
    ]
    best = int(np.argmax(shares))
    sharp = [jumps.is_sharp(jumps.refined(corner, best), best) for corner in told]
    return best if shares[best] >= _SEEN and float(np.mean(sharp)) >= _MOSTLY else None


def _noise(torque_nm: Floats) -> float:
    """Return the torque's noise from one sample to the next, N m."""
    return float(np.median(np.abs(np.diff(torque_nm, n=2)))) / (0.6745 * _SECOND)
