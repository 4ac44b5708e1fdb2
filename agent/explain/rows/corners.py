"""The acceleration at corners of a speed, where torque and motion are samples of a jump.

A prescribed motion, as most simulators have it, begins and ends its ramps between two samples, or
at one. Its torque jumps with the acceleration, and a sample of it is from before the corner or from
after it, never from in between. Differences of the speed across the corner are in between: over all
rows, what they are wrong by is as much as the jump for up to half a sample, at random. Differences
that stay on the sample's own side of the corner are not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

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
_MOST_LATE = 8  # samples that it may do so after the motion
_STANDS = 1e-3  # of the greatest speed
_EITHER = 0.5  # of a jump that the torque does not show
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
        if not stretch.resampled:
            beside[stretch.index] = _beside(stretch, signals)
    return replace(run, columns={**run.columns, CORNERS: beside}) if beside.any() else run


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
    across = motion.across
    for corner in corners:
        own_side = motion.own_side(corner)
        if not corner.between:
            share = jumps.share(corner.at + late, corner.at + late, corner.at + late)
            before, after = motion.sides(corner)
            part = _EITHER if share is None else min(max(share, 0.0), 1.0)
            own_side[corner.at] = before + part * (after - before)
        for sample, acceleration in own_side.items():
            out[sample] = acceleration - across[sample]
    return out


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

    def slides(self, corner: _Corner) -> bool:
        """Return whether the joint moves on either side of a corner."""
        return _moves(self.values, corner.at - 1, corner.after + 1)

    def sides(self, corner: _Corner) -> tuple[float, float]:
        """Return the accelerations just before and just after a corner."""
        early = self.values[corner.at - 2 : corner.at + 1]
        late = self.values[corner.after : corner.after + 3]
        before = 3.0 * early[2] - 4.0 * early[1] + early[0]
        after = 4.0 * late[1] - 3.0 * late[0] - late[2]
        return float(0.5 * before / self.period_s), float(0.5 * after / self.period_s)

    def own_side(self, corner: _Corner) -> dict[int, float]:
        """Return the acceleration of the samples around one that are on one side of it."""
        early = self.values[corner.at - 2 : corner.at + 1]
        late = self.values[corner.after : corner.after + 3]
        # Five points reach over the corner from one sample further away.
        out = {
            corner.at - 1: float(0.5 * (early[2] - early[0]) / self.period_s),
            corner.after + 1: float(0.5 * (late[2] - late[0]) / self.period_s),
        }
        if corner.between:
            out[corner.at], out[corner.after] = self.sides(corner)
        return out


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

    def slides(self, corner: _Corner) -> bool:
        """Return whether the joint moves on either side of a corner."""
        return _moves(np.diff(self.values), corner.at - 2, corner.after + 1)

    def sides(self, corner: _Corner) -> tuple[float, float]:
        """Return the accelerations just before and just after a corner."""
        early, late = corner.at - 1, corner.after + 1  # whose neighbours are on the same side
        before = 2.0 * self._at(early) - self._at(early - 1)
        return before, 2.0 * self._at(late) - self._at(late + 1)

    def own_side(self, corner: _Corner) -> dict[int, float]:
        """Return the acceleration of the samples around one that are on one side of it."""
        out = {corner.at - back: self._at(corner.at - back) for back in (1, 2, 3)}
        out |= {corner.after + on: self._at(corner.after + on) for on in (1, 2, 3)}
        if corner.between:
            out[corner.at], out[corner.after] = self.sides(corner)
        return out

    def _at(self, sample: int) -> float:
        before, here, after = self.values[sample - 1 : sample + 2]
        return float((after - 2.0 * here + before) / self.period_s**2)


def _moves(speed: Floats, before: int, after: int) -> bool:
    """Return whether a speed is more than a standstill's at two of its samples, and of one sign."""
    least = _STANDS * float(np.max(np.abs(speed), initial=0.0))
    return bool(speed[before] * speed[after] > least**2)


def _corners(speed: Floats, begins: float) -> list[_Corner]:
    """Return the corners of a speed that stand alone, in the order of time.

    Parameters
    ----------
    speed : ndarray, shape (m,)
    begins : float
        When the first of its samples is, in samples.
    """
    bends = np.zeros_like(speed)
    bends[1:-1] = np.diff(speed, n=2)
    size = np.abs(bends)
    noise = float(np.median(size)) / 0.6745
    least = max(_CLEAR * noise, _ROUNDED * float(np.max(np.abs(speed), initial=0.0)))
    margin, out = _ALONE + 2, list[_Corner]()
    for k in np.flatnonzero(size > 0.5 * least).tolist():
        if not margin <= k < speed.shape[0] - margin or size[k] < max(size[k - 1], size[k + 1]):
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
    return best if shares[best] >= _MOSTLY else None


def _noise(torque_nm: Floats) -> float:
    """Return the torque's noise from one sample to the next, N m."""
    return float(np.median(np.abs(np.diff(torque_nm, n=2)))) / (0.6745 * _SECOND)
