"""A menu of safe changes to the cycle: what could be driven next, within what was driven before.

Nothing goes beyond the positions, speeds and accelerations that the recordings show, unless the
axis's limits are given: then the stroke may be longer or shifted, and every trajectory is checked
against them, stopping distances included.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.scene import Scene
from agent.explain.strata import STEADY
from agent.explain.table import Table
from trajectories import (
    AxisLimits,
    Segment,
    Trajectory,
    TrajectoryError,
    check,
    point_to_point,
    reversals,
    spaced_speeds,
    stair_paired,
    triangle,
)

_MARGIN = 0.95  # of the largest speed and acceleration seen, which hold noise as well
_DWELL_S, _DWELL_MIN_S, _REST_S = 1.5, 0.2, 0.2
_HELD_S, _SAME_SPEED = 0.3, 0.05
_REVERSAL_ARM_RAD = 0.02
_LONGEST_S = 60.0
_COOLING_S, _PAYLOAD_S = 3600.0, 900.0
_LEAST_WARMING_K = 2.0
_FELT = 0.05  # of Coulomb friction: a load that weighs less changes nothing
_TRIANGLE_PERIOD_S, _TRIANGLE_PERIODS = 1.6, 6
_CHANGES = 3


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
        hard = np.abs(table.full["acceleration_rad_s2"])
        jerks = [
            np.quantile(np.abs(np.gradient(table.full["acceleration_rad_s2"][at], period)), 0.99)
            for at, period in scene.each_piece()
        ]
        acceleration = _MARGIN * float(np.quantile(hard, 0.995))
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
        return replace(
            driven,
            fastest_rad_s=min(driven.fastest_rad_s, limits.velocity_max_rad_s),
            acceleration_rad_s2=min(driven.acceleration_rad_s2, limits.acceleration_max_rad_s2),
            jerk_rad_s3=min(driven.jerk_rad_s3, limits.jerk_max_rad_s3),
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
        a, b = 1.0 / self.acceleration_rad_s2, _DWELL_MIN_S + self.ramp_s(0.0)
        top = (math.sqrt(b * b + 4.0 * a * 0.98 * self.room_rad) - b) / (2.0 * a)
        return min(self.fastest_rad_s, top)


@dataclass(frozen=True)
class Part:
    """One run of an experiment: what is driven, and how the joint is found.

    Parameters
    ----------
    trajectory : Trajectory
    warmth : float
        Gearbox and motor temperature: 0 as the recordings began, 1 as they ended.
    later : float
        When it is driven: so many times the recordings' own span after their end.
    load : float
        Gravity's torque, in units of the recordings' own.
    """

    trajectory: Trajectory
    warmth: float = 1.0
    later: float = 0.0
    load: float = 1.0


@dataclass(frozen=True)
class Proposal:
    """One entry of the menu.

    Parameters
    ----------
    what : str
        What to do, as the beginning of a sentence for a technician.
    parts : tuple of Part
        The first one's trajectory is driven in all of them.
    set_up : str
        What has to be changed besides; empty: nothing.
    set_up_s : float
        How long that takes.
    """

    what: str
    parts: tuple[Part, ...]
    set_up: str = ""
    set_up_s: float = 0.0

    @property
    def trajectory(self) -> Trajectory:
        """Return what is driven."""
        return self.parts[0].trajectory

    @property
    def driven_s(self) -> float:
        """Return how long the joint is driven."""
        return sum(part.trajectory.duration_s for part in self.parts)


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


def menu(scene: Scene, limits: AxisLimits | None = None) -> tuple[Proposal, ...]:
    """Return what could be driven next; entries that this axis has no room for are left out.

    Parameters
    ----------
    scene : Scene
        Of the recordings.
    limits : AxisLimits, optional
        Without them nothing leaves the range that was driven.
    """
    driven = Driven.of(scene, limits)
    if not driven.moves:
        return ()
    out = [
        Proposal(what, (Part(trajectory),))
        for what, trajectory in _motions(driven, limits)
        if limits is None or not check(trajectory, limits)
    ]
    return (*out, *_set_ups(scene, driven))


def _motions(driven: Driven, limits: AxisLimits | None) -> Iterator[tuple[str, Trajectory]]:
    """Yield every motion that fits, and what it is in words."""
    slow, fast = driven.slowest_rad_s, driven.reachable_rad_s
    crawl, creep = 0.25 * slow, 0.05 * slow
    entries: list[tuple[str, Callable[[], Trajectory]]] = [
        (
            "Repeat the stair of speeds as it was",
            lambda: _stair(driven, spaced_speeds(slow, fast, 6)),
        ),
        (
            f"Drive a stair with speeds down to {crawl:.2g} rad/s, a quarter of the slowest so far",
            lambda: _stair(driven, (*spaced_speeds(crawl, 2.0 * slow, 5), fast)),
        ),
        (
            f"Drive a stair with speeds down to {creep:.2g} rad/s, a twentieth of the slowest so "
            "far",
            lambda: _stair(driven, (*spaced_speeds(creep, slow, 5), fast)),
        ),
        (
            "Drive a stair with twice as many speeds",
            lambda: _stair(driven, spaced_speeds(slow, fast, 12), 0.4 * _DWELL_S),
        ),
        (
            "Drive a stair of fast speeds, evenly spaced",
            lambda: _stair(driven, spaced_speeds(0.5 * fast, fast, 5, "linear")),
        ),
        (
            "Drive the stair with the fastest speed first",
            lambda: _stair(driven, spaced_speeds(slow, fast, 6)[::-1]),
        ),
        ("Swing to and fro, each time half as far", lambda: _halving(driven)),
        (
            "Make the same reversal at full and at a quarter of the acceleration",
            lambda: _two_ramps(driven),
        ),
        ("Drive a triangle wave of velocity", lambda: _triangle(driven)),
        ("Change the speed without turning round", lambda: _changes(driven)),
        (
            "Pass the whole stroke to and fro at five speeds",
            lambda: _sweeps(driven, spaced_speeds(max(slow, driven.room_rad / 6.0), fast, 5)),
        ),
        (
            "Raise and lower the arm slowly over the whole stroke",
            lambda: _sweeps(driven, (driven.room_rad / 8.0,)),
        ),
        *(
            (what, lambda wide=wide: _stair(wide, spaced_speeds(slow, fast, 6)))
            for what, wide in _other_strokes(driven, limits)
        ),
    ]
    for what, build in entries:
        try:
            trajectory = build()
        except TrajectoryError:
            continue  # this stroke has no room for it
        if trajectory.duration_s <= _LONGEST_S:
            yield what, trajectory


def _other_strokes(driven: Driven, limits: AxisLimits | None) -> Iterator[tuple[str, Driven]]:
    """Yield longer and shifted strokes that end clear of the limits at full speed."""
    if limits is None or not driven.placed:
        return
    speed = driven.fastest_rad_s
    stop = speed * limits.reaction_time_s + speed**2 / (2.0 * limits.stopping_deceleration_rad_s2)
    low, high = limits.position_min_rad + stop, limits.position_max_rad - stop
    below, above = max(driven.low_rad - low, 0.0), max(high - driven.high_rad, 0.0)
    step = 0.5 * driven.room_rad
    longer = replace(
        driven,
        low_rad=driven.low_rad - min(below, step),
        high_rad=driven.high_rad + min(above, step),
    )
    if longer.room_rad > 1.2 * driven.room_rad:
        yield (
            f"Drive the stair over a stroke {longer.room_rad / driven.room_rad:.1f} times as long",
            longer,
        )
    for way, sign in ((min(below, step), -1.0), (min(above, step), 1.0)):
        if way > 0.4 * step:
            arm_deg = math.degrees(sign * way / driven.gear_ratio)
            yield (
                f"Drive the stair with the stroke shifted by {arm_deg:+.3g} degrees of the arm",
                replace(
                    driven,
                    low_rad=driven.low_rad + sign * way,
                    high_rad=driven.high_rad + sign * way,
                ),
            )


def _set_ups(scene: Scene, driven: Driven) -> Iterator[Proposal]:
    """Yield what needs another temperature or another payload."""
    stair = _tried(
        lambda: _stair(driven, spaced_speeds(driven.slowest_rad_s, driven.reachable_rad_s, 6))
    )
    lift = _tried(lambda: _sweeps(driven, (driven.room_rad / 8.0,)))
    gravity_nm = float(np.hypot(scene.theta[3], scene.theta[4]))
    loaded = scene.has("position_rad") and gravity_nm > _FELT * float(scene.theta[2])
    warmed = _warming_k(scene)
    if warmed >= _LEAST_WARMING_K and stair is not None:
        yield Proposal(
            "Drive the same speeds at equal gearbox temperature while heating and while cooling",
            (Part(stair, 1.0, 1.0), Part(stair, 0.0, 2.0)),
            "Drive it once while the gearbox is as warm as at the end of these recordings, and "
            "once more when it has cooled to where they began.",
            _COOLING_S,
        )
    if warmed >= _LEAST_WARMING_K and loaded and lift is not None:
        yield Proposal(
            "Raise and lower the load slowly, cold and warm",
            (Part(lift, 0.0, 1.0), Part(lift, 1.0, 1.0)),
            "Drive it once cold and once warm, with the same payload.",
            _COOLING_S,
        )
    if loaded and stair is not None:
        yield Proposal(
            "Drive the stair with a second payload",
            (Part(stair, load=0.5),),
            "Take off about half of what the axis carries, or add as much.",
            _PAYLOAD_S,
        )


def _warming_k(scene: Scene) -> float:
    """Return the span of the recorded gearbox or motor temperature, K; 0 where there is none."""
    spans = [
        float(np.ptp(scene.table.rows[name][scene.table.used]))
        for name in ("gearbox_temperature_degc", "motor_temperature_degc")
        if scene.has(name)
    ]
    return max(spans, default=0.0)


def _tried(build: Callable[[], Trajectory]) -> Trajectory | None:
    try:
        return build()
    except TrajectoryError:
        return None


def _stair(driven: Driven, speeds_rad_s: Sequence[float], dwell_s: float = _DWELL_S) -> Trajectory:
    """Return a paired stair about the middle, every speed held as long as the stroke lets it."""
    speeds = [v for v in speeds_rad_s if v <= driven.reachable_rad_s * (1.0 + 1e-9)]
    if not speeds:
        raise TrajectoryError("no speed can be held within the stroke")
    passes = [min(dwell_s, driven.room_rad / v) + 2.0 * driven.ramp_s(v) + _REST_S for v in speeds]
    transfers = len(speeds) * 2.0 * driven.ramp_s(max(speeds))
    return stair_paired(
        driven.low_rad,
        driven.high_rad,
        speeds_rad_s=speeds,
        duration_s=2.0 * sum(passes) + transfers,
        acceleration_rad_s2=driven.acceleration_rad_s2,
        jerk_rad_s3=driven.jerk_rad_s3,
        dwell_min_s=_DWELL_MIN_S,
        rest_s=_REST_S,
    )


def _halving(driven: Driven) -> Trajectory:
    return reversals(
        driven.centre_rad,
        min(0.5 * driven.room_rad, _REVERSAL_ARM_RAD * driven.gear_ratio),
        halvings=5,
        swings=2,
        velocity_rad_s=math.sqrt(driven.slowest_rad_s * driven.fastest_rad_s),
        acceleration_rad_s2=driven.acceleration_rad_s2,
        jerk_rad_s3=driven.jerk_rad_s3,
        rest_s=_REST_S,
    )


def _two_ramps(driven: Driven) -> Trajectory:
    """Return reversals at full, then at a quarter of the acceleration."""
    parts = [
        reversals(
            driven.centre_rad,
            min(0.5 * driven.room_rad, 2.0 * _REVERSAL_ARM_RAD * driven.gear_ratio),
            halvings=0,
            swings=4,
            velocity_rad_s=0.5 * driven.fastest_rad_s,
            acceleration_rad_s2=share * driven.acceleration_rad_s2,
            jerk_rad_s3=driven.jerk_rad_s3,
        )
        for share in (1.0, 0.25)
    ]
    rest = Segment.rest(_REST_S)
    return Trajectory(
        "reversals-two-ramps",
        {"centre_rad": driven.centre_rad, "acceleration_shares": (1.0, 0.25)},
        driven.centre_rad,
        (rest, *parts[0].segments, rest, *parts[1].segments, rest),
    )


def _triangle(driven: Driven) -> Trajectory:
    a, corner_s = driven.acceleration_rad_s2, driven.ramp_s(0.0)
    widest = math.sqrt(corner_s**2 + 4.0 * driven.room_rad / a) - corner_s
    peak = min(0.25 * a * _TRIANGLE_PERIOD_S, driven.fastest_rad_s, 0.5 * a * widest)
    return triangle(
        driven.centre_rad + 0.5 * peak * (peak / a + corner_s),
        peak_velocity_rad_s=peak,
        acceleration_rad_s2=a,
        jerk_rad_s3=driven.jerk_rad_s3,
        periods=_TRIANGLE_PERIODS,
        rest_s=_REST_S,
    )


def _changes(driven: Driven) -> Trajectory:
    """Return strokes on which the speed goes up and down several times without a reversal."""
    bounds = driven.acceleration_rad_s2, driven.jerk_rad_s3
    top = driven.fastest_rad_s
    while True:
        slow = 0.2 * top
        wave = (Segment.ramp(slow, top, *bounds), Segment.ramp(top, slow, *bounds))
        out = (
            Segment.ramp(0.0, slow, *bounds),
            *wave * _CHANGES,
            Segment.ramp(slow, 0.0, *bounds),
        )
        way = sum(segment.displacement_rad for segment in out)
        if way <= driven.room_rad:
            break
        top *= 0.8
    back = tuple(segment.reversed() for segment in reversed(out))
    rest = Segment.rest(_REST_S)
    return Trajectory(
        "speed-changes",
        {"from_rad": driven.centre_rad - 0.5 * way, "top_rad_s": top, "slow_rad_s": slow},
        driven.centre_rad - 0.5 * way,
        (rest, *out, rest, *back, rest) * 2,
    )


def _sweeps(driven: Driven, speeds_rad_s: Sequence[float]) -> Trajectory:
    """Return the whole stroke to and fro at every speed."""
    rest = Segment.rest(_REST_S)
    segments: list[Segment] = [rest]
    for speed in speeds_rad_s:
        for way in ((driven.low_rad, driven.high_rad), (driven.high_rad, driven.low_rad)):
            stroke = point_to_point(
                *way,
                velocity_rad_s=min(speed, driven.fastest_rad_s),
                acceleration_rad_s2=driven.acceleration_rad_s2,
                jerk_rad_s3=driven.jerk_rad_s3,
            )
            segments += [*stroke.segments, rest]
    return Trajectory(
        "sweeps",
        {
            "from_rad": driven.low_rad,
            "to_rad": driven.high_rad,
            "speeds_rad_s": tuple(float(v) for v in speeds_rad_s),
        },
        driven.low_rad,
        tuple(segments),
    )
