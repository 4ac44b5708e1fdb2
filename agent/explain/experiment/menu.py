"""A menu of safe changes to the cycle: what could be driven next, within what was driven before.

Nothing goes beyond the positions, speeds and accelerations that the recordings show, unless the
axis's limits are given: then the stroke may be longer or shifted, and every trajectory is checked
against them as `stribeck run --trajectory` does, stopping distances and torque included.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from agent.explain.experiment.cycles import (
    DWELL_S,
    halving,
    speed_changes,
    stair,
    sweeps,
    triangle_wave,
    two_ramps,
)
from agent.explain.experiment.driven import Driven
from agent.explain.rows.scene import Scene
from trajectories import AxisLimits, TorqueModel, Trajectory, TrajectoryError, check, spaced_speeds

Build = Callable[[], Trajectory]

_LONGEST_S = 60.0
_SLOWLY_S = 8.0  # for the whole stroke
_COOLING_S, _PAYLOAD_S, _LOOKING_S = 3600.0, 900.0, 60.0
_FREE_WAY = "The arm goes where these recordings were not: see first that its way is free."
_LEAST_WARMING_K = 2.0
_FELT = 0.05  # of Coulomb friction: a load that weighs less changes nothing


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
    out = [Proposal(what, (Part(trajectory),)) for what, trajectory in _motions(driven)]
    out += _set_ups(scene, driven)
    if limits is None:
        return tuple(out)
    out += _elsewhere(driven, limits)
    return tuple(p for p in out if not check(p.trajectory, limits, _torque(scene, p)))


def _torque(scene: Scene, proposal: Proposal) -> TorqueModel:
    """Return what torque the joint is believed to need, with the heaviest load that is proposed."""
    inertia, viscous, coulomb = (max(float(x), 0.0) for x in scene.theta[:3])
    weight = float(np.hypot(scene.theta[3], scene.theta[4]))
    return TorqueModel(
        inertia_kg_m2=inertia,
        coulomb_nm=coulomb,
        viscous_nm_s_per_rad=viscous,
        gravity_nm=weight * max(1.0, *(part.load for part in proposal.parts)),
    )


def _motions(driven: Driven) -> Iterator[tuple[str, Trajectory]]:
    """Yield every motion that fits within what was driven, and what it is in words."""
    slow, fast = driven.slowest_rad_s, driven.reachable_rad_s
    crawl, creep = 0.25 * slow, 0.05 * slow
    entries: list[tuple[str, Build]] = [
        (
            "Repeat the stair of speeds as it was",
            lambda: stair(driven, spaced_speeds(slow, fast, 6)),
        ),
        (
            f"Drive a stair with speeds down to {crawl:.2g} rad/s, a quarter of the slowest so far",
            lambda: stair(driven, (*spaced_speeds(crawl, 2.0 * slow, 5), fast)),
        ),
        (
            f"Drive a stair with speeds down to {creep:.2g} rad/s, a twentieth of the slowest so "
            "far",
            lambda: stair(driven, (*spaced_speeds(creep, slow, 5), fast)),
        ),
        (
            "Drive a stair with twice as many speeds",
            lambda: stair(driven, spaced_speeds(slow, fast, 12), 0.4 * DWELL_S),
        ),
        (
            "Drive a stair of fast speeds, evenly spaced",
            lambda: stair(driven, spaced_speeds(0.5 * fast, fast, 5, "linear")),
        ),
        (
            "Drive the stair with the fastest speed first",
            lambda: stair(driven, spaced_speeds(slow, fast, 6)[::-1]),
        ),
        ("Swing to and fro, each time half as far", lambda: halving(driven)),
        (
            "Make the same reversal at full and at a quarter of the acceleration",
            lambda: two_ramps(driven),
        ),
        ("Drive a triangle wave of velocity", lambda: triangle_wave(driven)),
        ("Change the speed without turning round", lambda: speed_changes(driven)),
        (
            "Pass the whole stroke to and fro at five speeds",
            lambda: sweeps(driven, spaced_speeds(max(slow, driven.room_rad / 6.0), fast, 5)),
        ),
        (
            "Raise and lower the arm slowly over the whole stroke",
            lambda: sweeps(driven, (driven.room_rad / _SLOWLY_S,)),
        ),
    ]
    for what, build in entries:
        trajectory = _tried(build)
        if trajectory is not None and trajectory.duration_s <= _LONGEST_S:
            yield what, trajectory


def _elsewhere(driven: Driven, limits: AxisLimits) -> Iterator[Proposal]:
    """Yield what is driven over a longer or another stroke."""
    speeds = spaced_speeds(driven.slowest_rad_s, driven.reachable_rad_s, 6)
    for where, stroke in _other_strokes(driven, limits):
        stairs: Build = partial(stair, stroke, speeds)
        slowly: Build = partial(sweeps, stroke, (stroke.room_rad / _SLOWLY_S,))
        for what, build in (
            ("Drive the stair", stairs),
            ("Raise and lower the arm slowly", slowly),
        ):
            trajectory = _tried(build)
            if trajectory is not None and trajectory.duration_s <= _LONGEST_S:
                yield Proposal(f"{what} {where}", (Part(trajectory),), _FREE_WAY, _LOOKING_S)


def _other_strokes(driven: Driven, limits: AxisLimits) -> Iterator[tuple[str, Driven]]:
    """Yield longer and shifted strokes that end clear of the limits at full speed, and where."""
    if not driven.placed:
        return
    speed = driven.fastest_rad_s
    stop = speed * limits.reaction_time_s + speed**2 / (2.0 * limits.stopping_deceleration_rad_s2)
    low, high = limits.position_min_rad + stop, limits.position_max_rad - stop
    below, above = max(driven.low_rad - low, 0.0), max(high - driven.high_rad, 0.0)
    step, known = 0.5 * driven.room_rad, driven.room_rad
    for most in (step, math.inf):
        longer = replace(
            driven,
            low_rad=driven.low_rad - min(below, most),
            high_rad=driven.high_rad + min(above, most),
        )
        if longer.room_rad > 1.2 * known:
            known = longer.room_rad
            yield f"over a stroke {known / driven.room_rad:.1f} times as long", longer
    for way, sign in ((min(below, step), -1.0), (min(above, step), 1.0)):
        if way > 0.4 * step:
            arm_deg = math.degrees(sign * way / driven.gear_ratio)
            yield (
                f"with the stroke shifted by {arm_deg:+.3g} degrees of the arm",
                replace(
                    driven,
                    low_rad=driven.low_rad + sign * way,
                    high_rad=driven.high_rad + sign * way,
                ),
            )


def _set_ups(scene: Scene, driven: Driven) -> Iterator[Proposal]:
    """Yield what needs another temperature or another payload."""
    plain = _tried(
        lambda: stair(driven, spaced_speeds(driven.slowest_rad_s, driven.reachable_rad_s, 6))
    )
    lift = _tried(lambda: sweeps(driven, (driven.room_rad / _SLOWLY_S,)))
    gravity_nm = float(np.hypot(scene.theta[3], scene.theta[4]))
    loaded = scene.has("position_rad") and gravity_nm > _FELT * float(scene.theta[2])
    warmed = _warming_k(scene)
    if warmed >= _LEAST_WARMING_K and plain is not None:
        yield Proposal(
            "Drive the same speeds at equal gearbox temperature while heating and while cooling",
            (Part(plain, 1.0, 1.0), Part(plain, 0.0, 2.0)),
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
    if loaded and plain is not None:
        yield Proposal(
            "Drive the stair with a second payload",
            (Part(plain, load=0.5),),
            "Take off about half of what the axis carries, or add as much, and state every "
            "recording's payload_kg.",
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


def _tried(build: Build) -> Trajectory | None:
    try:
        return build()
    except TrajectoryError:
        return None
