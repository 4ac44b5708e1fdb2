"""What is driven before something is looked for: a rich set of recordings, and a poor one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fakes.conceal.robot import Robot, half_pass_rad
from fakes.conceal.truth import RunState
from trajectories import Segment, Trajectory, reversals, stair_paired
from trajectories.point_to_point import move

Design = Literal["rich", "poor"]
DURATION_S = 30.0
_STAIR_S = 22.0
_SPEEDS = 6


@dataclass(frozen=True)
class Run:
    """One recording to be made: how the joint is found and what it is driven through.

    `arm_encoder` tells whether somebody has put an encoder on the arm for it.
    """

    trajectory: Trajectory
    state: RunState
    is_holdout: bool
    started_hours: float
    arm_encoder: bool = False


def plan_runs(rng: np.random.Generator, robot: Robot, design: Design) -> tuple[Run, ...]:
    """Return the runs in the order in which they are driven, hold-outs marked.

    Rich: seven recordings at six temperatures between 20 and 60 degC, in an order that heats,
    cools and heats again, so that temperature is not time; stairs, reversed stairs and strokes.
    Two hold-outs: an untouched temperature and untouched speeds, and a reversed order of speeds at
    another. Poor: two recordings of a monotone warm-up with the same stair, and the next one as
    hold-out.
    """
    if design == "rich":
        cool, step = rng.uniform(20.0, 24.0), rng.uniform(6.0, 7.2)
        order = (0, 3, 1, 5, 2, 4, 1)
        warmth = [cool + step * k for k in order]
        runs = [
            _rich_run(rng, robot, number, degc, 4.0 * number) for number, degc in enumerate(warmth)
        ]
        unseen = (cool + 3.5 * step, cool + 1.5 * step)
        held = (_stair(rng, robot, speed_factor=0.83), _strokes(rng, robot, top=0.93).reversed())
        for number, (degc, trajectory) in enumerate(zip(unseen, held, strict=True), len(runs)):
            runs.append(_run(rng, trajectory, degc, number, 4.0 * number, held=True))
        return tuple(runs)
    cool, step = rng.uniform(20.0, 26.0), rng.uniform(7.0, 12.0)
    stair = _stair(rng, robot, speed_factor=1.0)
    parts = (stair, stair, stair.reversed())
    return tuple(
        _run(rng, part, cool + step * k, k, 0.4 * k, held=k == 2) for k, part in enumerate(parts)
    )


def _rich_run(
    rng: np.random.Generator, robot: Robot, number: int, degc: float, hours: float
) -> Run:
    kinds = ("stair", "strokes", "reversed", "stair", "strokes", "reversed", "stair")
    if kinds[number] == "strokes":
        trajectory = _strokes(rng, robot, top=1.0)
    else:
        trajectory = _stair(rng, robot, speed_factor=rng.uniform(0.92, 1.0))
        if kinds[number] == "reversed":
            trajectory = trajectory.reversed()
    return _run(rng, trajectory, degc, number, hours, held=False)


def _run(
    rng: np.random.Generator,
    trajectory: Trajectory,
    degc: float,
    number: int,
    hours: float,
    *,
    held: bool,
) -> Run:
    ambient = rng.uniform(19.0, 23.0)
    state = RunState(
        oil_degc=degc,
        winding_degc=degc + rng.uniform(4.0, 16.0),
        # The sensor sits in steel: it is still on its way to what the oil has reached.
        sensor_degc=degc + rng.uniform(-0.8, 0.3),
        ambient_degc=ambient,
        age_runs=float(number),
        phase_rad=rng.uniform(0.0, 6.28),
    )
    return Run(trajectory, state, held, hours)


def _stair(rng: np.random.Generator, robot: Robot, *, speed_factor: float) -> Trajectory:
    """Return a paired stair about a place of its own, followed by reversals of halving size."""
    gear = robot.truth.gear_ratio
    low = (robot.centre_arm_rad - robot.reach_arm_rad) * gear
    high = (robot.centre_arm_rad + robot.reach_arm_rad) * gear
    top = robot.top_rad_s * speed_factor
    speeds = np.geomspace(top / rng.uniform(45.0, 70.0), top, _SPEEDS)
    order = rng.permutation(_SPEEDS)
    half = half_pass_rad(top, robot.acceleration_rad_s2, robot.jerk_rad_s3)
    half = max(half, min(0.5 * (high - low), 0.5 * half + 0.35 * (high - low)))
    middle = rng.uniform(low + half, high - half) if high - low > 2.0 * half else 0.5 * (low + high)
    stair = stair_paired(
        middle - half,
        middle + half,
        speeds_rad_s=[float(speeds[k]) for k in order],
        duration_s=_STAIR_S,
        acceleration_rad_s2=robot.acceleration_rad_s2,
        jerk_rad_s3=robot.jerk_rad_s3,
        dwell_min_s=0.05,
        rest_s=0.1,
    )
    swings = reversals(
        middle,
        rng.uniform(3.0, 8.0),
        halvings=4,
        velocity_rad_s=rng.uniform(0.1, 0.2) * robot.top_rad_s,
        acceleration_rad_s2=robot.acceleration_rad_s2 * rng.uniform(0.4, 1.0),
        jerk_rad_s3=robot.jerk_rad_s3,
        rest_s=rng.uniform(0.0, 0.15),
    )
    return _padded(_joined(robot, (stair, swings)), DURATION_S)


def _strokes(rng: np.random.Generator, robot: Robot, *, top: float) -> Trajectory:
    """Return moves between places drawn at random, at speeds and accelerations drawn, too."""
    gear, here = robot.truth.gear_ratio, robot.centre_arm_rad * robot.truth.gear_ratio
    start, elapsed = here, 0.0
    segments: list[Segment] = []
    while True:
        speed = float(robot.top_rad_s * top * 10.0 ** rng.uniform(-1.6, 0.0))
        there = (robot.centre_arm_rad + robot.reach_arm_rad * rng.uniform(-0.95, 0.95)) * gear
        longest = speed * rng.uniform(1.5, 3.5)  # slow moves are short: time is what a move costs
        step = float(np.clip(there - here, -longest, longest))
        if abs(step) < 1.0:
            continue
        part = move(
            step,
            speed,
            robot.acceleration_rad_s2 * rng.uniform(0.5, 1.0),
            robot.jerk_rad_s3 * rng.uniform(0.6, 1.0),
            evaluated=True,
        )
        rest = Segment.rest(rng.uniform(0.05, 0.6))
        elapsed += sum(s.duration_s for s in part) + rest.duration_s
        if elapsed > DURATION_S:
            break
        segments += [*part, rest]
        here += step
    return _padded(Trajectory("strokes", {"speeds": "drawn"}, start, tuple(segments)), DURATION_S)


def _joined(robot: Robot, parts: tuple[Trajectory, ...]) -> Trajectory:
    """Return parts one after the other, with a transfer wherever one ends elsewhere."""
    first = parts[0]
    segments, here = list(first.segments), first.end_position_rad
    for part in parts[1:]:
        segments += move(
            part.start_position_rad - here,
            0.5 * robot.top_rad_s,
            robot.acceleration_rad_s2,
            robot.jerk_rad_s3,
        )
        segments += part.segments
        here = part.end_position_rad
    return Trajectory(first.name, first.parameters, first.start_position_rad, tuple(segments))


def _padded(trajectory: Trajectory, duration_s: float) -> Trajectory:
    """Return the trajectory with rest at its end, so that it lasts `duration_s` or longer."""
    missing = duration_s - trajectory.duration_s
    if missing <= 0.0:
        return trajectory
    return replace(trajectory, segments=(*trajectory.segments, Segment.rest(missing)))
