"""The motions of the menu, each built within what was driven; what has no room is refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

from agent.explain.experiment.driven import DWELL_MIN_S, Driven
from trajectories import (
    Segment,
    Trajectory,
    TrajectoryError,
    point_to_point,
    reversals,
    stair_paired,
    triangle,
)

DWELL_S = 1.5
"""How long a speed is held where the stroke allows it."""

_REST_S = 0.2
_REVERSAL_ARM_RAD = 0.02
_TRIANGLE_PERIOD_S, _TRIANGLE_PERIODS = 1.6, 6
_CHANGES = 3


def stair(driven: Driven, speeds_rad_s: Sequence[float], dwell_s: float = DWELL_S) -> Trajectory:
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
        dwell_min_s=DWELL_MIN_S,
        rest_s=_REST_S,
    )


def halving(driven: Driven) -> Trajectory:
    """Return swings about the middle, each time half as far."""
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


def two_ramps(driven: Driven) -> Trajectory:
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


def triangle_wave(driven: Driven) -> Trajectory:
    """Return a triangle wave of velocity about the middle."""
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


def speed_changes(driven: Driven) -> Trajectory:
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


def sweeps(driven: Driven, speeds_rad_s: Sequence[float]) -> Trajectory:
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
