"""What recordings show that an axis was driven through: the range within which to plan."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.rows.scene import Scene
from agent.explain.rows.strata import STEADY
from agent.explain.rows.table import Table
from trajectories import AxisLimits

DWELL_MIN_S = 0.2
"""No speed is held for less."""

_MARGIN = 0.95  # of the largest speed seen, which holds noise as well
_CLEAR = 0.9  # of the acceleration driven: a loop that overshoots asks for more than its command
_SUSTAINED_S = 0.05  # a change of speed that lasts for less is overshoot, ringing or noise
_HELD_S, _SAME_SPEED = 0.3, 0.05


@dataclass(frozen=True)
class Driven:
    """What the recordings show that this axis was driven through; motor side, all magnitudes.

    `slowest_rad_s` is the slowest speed that was held; `placed` tells whether positions were
    recorded, without which nothing can be driven at a place.
    """

    low_rad: float
    high_rad: float
    slowest_rad_s: float
    fastest_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    gear_ratio: float
    placed: bool

    @classmethod
    def of(cls, scene: Scene, limits: AxisLimits | None = None) -> Driven:
        """Read it from a table, and cut it to the axis's limits where they are given."""
        table = scene.table
        placed = scene.has("position_rad")
        speed = np.abs(table.rows["velocity_rad_s"])
        held = _held_rad_s(table)
        position = table.full["position_rad"]
        fastest = _MARGIN * float(np.quantile(speed[table.used], 0.999))
        jerks = [
            np.quantile(np.abs(np.gradient(table.full["acceleration_rad_s2"][at], period)), 0.99)
            for at, period in scene.each_piece()
        ]
        acceleration = _CLEAR * _sustained_rad_s2(scene)
        driven = cls(
            float(np.min(position)) if placed else -0.5 * fastest,
            float(np.max(position)) if placed else 0.5 * fastest,
            min(held, 0.5 * fastest),
            fastest,
            acceleration,
            max(float(np.max(jerks)), 5.0 * acceleration),
            table.gear_ratio,
            placed,
        )
        if limits is None:
            return driven
        return driven._within(limits)

    def _within(self, limits: AxisLimits) -> Driven:
        """Return the range cut to an axis's limits: it ends where a stop from full speed fits."""
        fastest = min(self.fastest_rad_s, limits.velocity_max_rad_s)
        acceleration = min(self.acceleration_rad_s2, limits.acceleration_max_rad_s2)
        reaction_rad = fastest * limits.reaction_time_s
        stop_rad = reaction_rad + fastest**2 / (2.0 * limits.stopping_deceleration_rad_s2)
        # On the way to a stroke's end the speed falls, and with it the way that a stop needs.
        beyond_rad = max(stop_rad - fastest**2 / (2.0 * acceleration), reaction_rad)
        return replace(
            self,
            low_rad=max(self.low_rad, limits.position_min_rad + beyond_rad),
            high_rad=min(self.high_rad, limits.position_max_rad - beyond_rad),
            slowest_rad_s=min(self.slowest_rad_s, 0.5 * fastest),
            fastest_rad_s=fastest,
            acceleration_rad_s2=acceleration,
            jerk_rad_s3=min(self.jerk_rad_s3, limits.jerk_max_rad_s3),
        )

    @property
    def room_rad(self) -> float:
        """Return the stroke."""
        return self.high_rad - self.low_rad

    @property
    def moves(self) -> bool:
        """Return whether there is a range to plan within."""
        sizes = self.room_rad, self.slowest_rad_s, self.acceleration_rad_s2, self.jerk_rad_s3
        return all(math.isfinite(size) and size > 0.0 for size in sizes)

    @property
    def centre_rad(self) -> float:
        """Return the stroke's middle."""
        return 0.5 * (self.low_rad + self.high_rad)

    def ramp_s(self, speed_rad_s: float) -> float:
        """Return a time in which a speed is reached."""
        return speed_rad_s / self.acceleration_rad_s2 + self.acceleration_rad_s2 / self.jerk_rad_s3

    @property
    def reachable_rad_s(self) -> float:
        """Return the fastest speed that the stroke lets hold for the shortest dwell."""
        a, b = 1.0 / self.acceleration_rad_s2, DWELL_MIN_S + self.ramp_s(0.0)
        top = (math.sqrt(b * b + 4.0 * a * 0.98 * self.room_rad) - b) / (2.0 * a)
        return min(self.fastest_rad_s, top)


def _held_rad_s(table: Table) -> float:
    """Return the slowest speed that was held for a while, rad/s."""
    velocity = table.rows["velocity_rad_s"]
    steady = table.used & (table.stratum == STEADY)
    held = []
    for piece in table.pieces:
        half = max(2, round(0.5 * _HELD_S / (piece.period_s * piece.stride)))
        for at in range(piece.rows.start, piece.rows.stop - 2 * half, half):
            if steady[at : at + 2 * half].all():
                first = float(np.mean(velocity[at : at + half]))
                second = float(np.mean(velocity[at + half : at + 2 * half]))
                if abs(second - first) < _SAME_SPEED * abs(first + second):
                    held.append(0.5 * abs(first + second))
    speed = np.abs(velocity[table.used])
    return float(np.quantile(held, 0.02)) if held else float(np.quantile(speed, 0.1))


def _sustained_rad_s2(scene: Scene) -> float:
    """Return the largest acceleration that lasted, rad/s2: of the command, where it is recorded.

    The change of speed over a twentieth of a second: the peaks of a measured acceleration are those
    of a loop that overshoots, and no axis that was told of 300 rad/s2 need allow 360.
    """
    name = "velocity_command_rad_s"
    velocity = scene.table.full[name if scene.has(name) else "velocity_rad_s"]
    largest = []
    for at, period_s in scene.each_piece():
        way = max(1, round(_SUSTAINED_S / period_s))
        own = velocity[at]
        if own.shape[0] > way:
            change = np.abs(own[way:] - own[:-way]) / (way * period_s)
            largest.append(float(np.quantile(change, 0.999)))
    return max(largest, default=0.0)
