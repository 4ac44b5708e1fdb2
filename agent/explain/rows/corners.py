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

from agent.explain.rows.corner import AT_A_SAMPLE, Corner, Ramp, corners_of, moves, ramps_of
from agent.explain.rows.jumps import FEWEST, Jumps, late_of
from agent.explain.rows.run import CORNERS, Run
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.sampling import Stretch, find_stretches
from agent.physics.derivative import slope

_EITHER = 0.5  # of a jump that the torque does not show
_ALIKE = 0.05  # of an acceleration: by so much at most others differ from it
_AHEAD = np.array([4.0, 1.0, -2.0]) / 3.0
"""Where a straight line through three values, the nearest one first, would go on."""


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
    return places if inside and float(np.max(np.abs(steps - places))) < AT_A_SAMPLE else None


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
    jumps = Jumps.of(torque)
    # Where the joint starts and stops friction jumps as well.
    late = late_of([c for c in corners if motion.slides(c)], jumps)
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
    typical = float(np.median(sizes)) if len(sizes) >= FEWEST else 0.0
    unlike = float(np.median(np.abs(np.asarray(sizes) - typical))) if typical else 0.0
    return typical if unlike < _ALIKE * typical else 0.0


def _in_a_ramp(
    ramp: Ramp, motion: _Speed | _Angle, jumps: Jumps, late: int, typical: float
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
class _Speed:
    """A speed's samples, rad/s, shape (n,)."""

    values: Floats
    period_s: float

    @property
    def across(self) -> Floats:
        """Return its derivative, shape (n,), by differences that ask for no corner."""
        return slope(self.values, self.period_s)

    def corners(self) -> list[Corner]:
        """Return the corners that stand alone, in the order of time."""
        return corners_of(self.values, 0.0)

    def ramps(self) -> list[Ramp]:
        """Return the ramps between others, in the order of time."""
        return ramps_of(self.values, 0)

    def slides(self, corner: Corner) -> bool:
        """Return whether the joint moves on either side of a corner."""
        return moves(self.values, corner.at - 1, corner.after + 1)

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

    def corners(self) -> list[Corner]:
        """Return the corners of its speed that stand alone, in the order of time."""
        return corners_of(np.diff(self.values) / self.period_s, 0.5)

    def ramps(self) -> list[Ramp]:
        """Return the ramps of its speed between others, in the order of time."""
        return ramps_of(np.diff(self.values) / self.period_s, 1)

    def slides(self, corner: Corner) -> bool:
        """Return whether the joint moves on either side of a corner."""
        return moves(np.diff(self.values), corner.at - 2, corner.after + 1)

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
