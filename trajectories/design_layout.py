"""How speeds become strokes, and what a stroke passes.

A stroke starts and ends at rest, and is driven back mirrored in time, so that every speed is held
in both directions over the same positions. Since a stroke must come down again anyway, dwells on
its falling side cost no further ramp: `dealt` climbs through some speeds on the way up, through
the others on the way down. That puts slow speeds, which take long, at both ends of the stroke;
gravity's cosine and an offset differ most between the ends and the middle, which a stroke passes
slowly only in another order (`trajectories.design_order`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trajectories.segment import Segment, ramp_times_s

Floats = NDArray[np.float64]
Strokes = tuple[tuple[tuple[int, float], ...], ...]
"""For every stroke the numbers of its speeds in a grid, each with its share of the time."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


@dataclass(frozen=True)
class Room:
    """What a stair may use: motor side, every number above zero but `rest_s`.

    Parameters
    ----------
    stroke_rad, duration_s : float
        Distance between the ends; the whole time, rests included.
    acceleration_rad_s2, jerk_rad_s3 : float
        Bounds of the ramps.
    dwell_min_s, rest_s : float
        No speed is held for less; standstill before, between and after strokes.
    """

    stroke_rad: float
    duration_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    dwell_min_s: float
    rest_s: float

    def ramp(self, change_rad_s: float) -> tuple[float, float]:
        """Return duration and jerk time of a change of speed."""
        return ramp_times_s(change_rad_s, self.acceleration_rad_s2, self.jerk_rad_s3)

    def stroke_for_rad(self, speed_rad_s: float) -> float:
        """Return the stroke that a speed needs: up, held for the shortest dwell, and down."""
        return speed_rad_s * (self.ramp(speed_rad_s)[0] + self.dwell_min_s)


@dataclass(frozen=True)
class Stroke:
    """Speeds in the order in which they are held, all above zero, with a dwell each."""

    speeds_rad_s: tuple[float, ...]
    dwells_s: tuple[float, ...]

    def table(self, room: Room) -> Floats:
        """Return ramps and dwells in order, shape (k, 4): start and end speed, time, jerk time."""
        rows, before = [], 0.0
        for speed, dwell_s in zip(self.speeds_rad_s, self.dwells_s, strict=True):
            rows.append((before, speed, *room.ramp(speed - before)))
            rows.append((speed, speed, dwell_s, 0.0))
            before = speed
        rows.append((before, 0.0, *room.ramp(before)))
        return np.array(rows)

    def segments(self, room: Room, direction: float) -> list[Segment]:
        """Return the stroke out."""
        bounds = room.acceleration_rad_s2, room.jerk_rad_s3
        out, before = [], 0.0
        for speed, dwell_s in zip(self.speeds_rad_s, self.dwells_s, strict=True):
            velocity = direction * speed
            out.append(Segment.ramp(before, velocity, *bounds))
            out.append(Segment.steady(velocity, dwell_s))
            before = velocity
        return [*out, Segment.ramp(before, 0.0, *bounds)]


@dataclass(frozen=True)
class Layout:
    """Strokes, each driven out and back from the same end."""

    strokes: tuple[Stroke, ...]

    @property
    def speeds_rad_s(self) -> Floats:
        """The speeds in the order in which they are held, shape (n,)."""
        return np.array([v for s in self.strokes for v in s.speeds_rad_s])

    @property
    def dwells_s(self) -> Floats:
        """Dwell of each in one direction, shape (n,)."""
        return np.array([d for s in self.strokes for d in s.dwells_s])

    def distances_rad(self, room: Room) -> list[float]:
        """Return how far each stroke leads."""
        tables = [s.table(room) for s in self.strokes]
        return [float(np.sum(0.5 * (t[:, 0] + t[:, 1]) * t[:, 2])) for t in tables]

    def start_rad(self, room: Room, centre_rad: float, direction: float) -> float:
        """Return where all strokes start, so that the longest is centred."""
        return centre_rad - 0.5 * direction * max(self.distances_rad(room))

    def body_gram(
        self, room: Room, centre_rad: float, direction: float, gear_ratio: float
    ) -> Floats:
        """Return ``integral r r' dt`` over out and back, shape (4, 4).

        With ``r = [a, sin(q/N), cos(q/N), 1]``. Because the way back mirrors the way out in time,
        products of these with the velocity or its sign cancel: friction is orthogonal to them.
        """
        tables = [s.table(room) for s in self.strokes]
        moved = [0.5 * (t[:, 0] + t[:, 1]) * t[:, 2] for t in tables]
        start_rad = centre_rad - 0.5 * direction * max(float(m.sum()) for m in moved)
        begin = np.concatenate([np.cumsum(m) - m for m in moved])
        v0, v1, time_s, jerk_s = np.concatenate(tables).T
        # The exact mean square of the trapezoid of acceleration, on a straight ramp.
        held_s = time_s - jerk_s
        square = ((v1 - v0) / held_s) ** 2 * (time_s - 4.0 / 3.0 * jerk_s) / time_s
        u = _NODES[:, np.newaxis] * time_s
        arm = start_rad + direction * (begin + u * (v0 + 0.5 * (v1 - v0) * u / time_s))
        arm /= gear_ratio
        rows = np.empty((4, *arm.shape))
        rows[0] = direction * np.sign(v1 - v0) * np.sqrt(square)
        rows[1], rows[2], rows[3] = np.sin(arm), np.cos(arm), 1.0
        weight = 2.0 * _WEIGHTS[:, np.newaxis] * time_s
        flat = rows.reshape(4, -1)
        return np.asarray((flat * weight.ravel()) @ flat.T, dtype=np.float64)

    def segments(self, room: Room, direction: float) -> tuple[Segment, ...]:
        """Return the whole stair, rests included."""
        pause = [Segment.rest(room.rest_s)] if room.rest_s > 0.0 else []
        out = list(pause)
        for stroke in self.strokes:
            ahead = stroke.segments(room, direction)
            out += [*ahead, *pause, *(s.reversed() for s in reversed(ahead)), *pause]
        return tuple(out)


def held_in(groups: Sequence[Sequence[tuple[float, float]]], room: Room) -> Layout | None:
    """Return the stair that holds these strokes' speeds in this order.

    The common unit of dwell is as long as the time allows, in a stroke that would become too long
    as long as the stroke allows.

    Parameters
    ----------
    groups : sequence of sequence of tuple of float
        For every stroke its speeds, each with its share of the time.
    room : Room
        What may be used.

    Returns
    -------
    Layout or None
        None where ramps, shortest dwells or the stroke leave no such stair.
    """
    if any(not group for group in groups):
        return None
    time_s = 0.5 * (room.duration_s - (2 * len(groups) + 1) * room.rest_s)
    units: list[float] = []
    for group in groups:
        before = ramps_rad = 0.0
        for speed in (*(v for v, _ in group), 0.0):
            ramp_s = room.ramp(speed - before)[0]
            ramps_rad += 0.5 * (before + speed) * ramp_s
            time_s -= ramp_s
            before = speed
        # A hair less than the stroke, for rounding.
        left_rad = room.stroke_rad * (1.0 - 1e-9) - ramps_rad
        units.append(left_rad / sum(v * share for v, share in group))
    unit_s = _common_unit(units, [sum(share for _, share in g) for g in groups], time_s)
    made = []
    for group, most_s in zip(groups, units, strict=True):
        dwells = tuple(share * min(unit_s, most_s) for _, share in group)
        if min(dwells) < room.dwell_min_s:
            return None
        made.append(Stroke(tuple(v for v, _ in group), dwells))
    return Layout(tuple(made))


def _common_unit(most_s: Sequence[float], shares: Sequence[float], time_s: float) -> float:
    """Return the unit of dwell that uses up the time, where strokes cut it at a most each."""
    unit_s, free = 0.0, list(zip(most_s, shares, strict=True))
    while free and time_s > 0.0:
        unit_s = time_s / sum(share for _, share in free)
        cut = [(most, share) for most, share in free if most < unit_s]
        if not cut:
            break
        time_s -= sum(most * share for most, share in cut)
        free = [(most, share) for most, share in free if most >= unit_s]
    return unit_s


def dealt(held: Sequence[tuple[int, float]], strokes: int, mixed: bool) -> Strokes:
    """Deal rising speeds out to strokes; within a stroke, every other one on the way down.

    Parameters
    ----------
    held : sequence of tuple
        Rising numbers of speeds, each with its share of the time.
    strokes : int
        How many.
    mixed : bool
        Deal the speeds out in turn, fastest first, so that every stroke is fast; else slow and
        fast speeds have strokes of their own.
    """
    if mixed:
        groups = [held[-1 - k :: -strokes][::-1] for k in range(strokes)]
    else:
        cuts = np.linspace(0, len(held), strokes + 1).round().astype(int)
        groups = [held[a:b] for a, b in pairwise(cuts)]
    return tuple(_up_and_down(group, odd=bool(k % 2)) for k, group in enumerate(groups))


def _up_and_down(group: Sequence[tuple[int, float]], *, odd: bool) -> tuple[tuple[int, float], ...]:
    """Put every other speed on the way down, the fastest in between."""
    return (*group[odd::2], *reversed(group[1 - odd :: 2]))
