"""The months themselves: which night, how warm, how worn, what is carried; then one run each."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fakes.checks import require_finite, require_not_negative, require_positive
from fakes.friction import FrictionParameters, FrictionTruth
from fakes.history.climate import Climate
from fakes.history.cycle import Condition, CycleRun, Floats, Measuring, run_columns
from fakes.history.events import OilChange, Swap, Wear
from fakes.joint import JointParameters
from trajectories import Trajectory, point_to_point, stair_between

SPEEDS_RAD_S = (3.0, 7.0, 14.0, 25.0, 40.0, 60.0, 85.0, 115.0, 155.0, 200.0)
_FIRST_GEARBOX, _FIRST_OIL = "G-0001", "oil-1"
_WEAR_GRID = np.concatenate(([0.0], np.geomspace(0.5, 1000.0, 200)))


@dataclass(frozen=True)
class Worker:
    """The joint's ordinary work: moves between random positions, some short, some long.

    Parameters
    ----------
    moves : int
        Moves in one recording.
    reach_arm_rad : float
        They stay within this of the middle.
    velocity_rad_s, acceleration_rad_s2, jerk_rad_s3 : float
        Motor side.
    """

    moves: int = 12
    reach_arm_rad: float = 0.9
    velocity_rad_s: float = 200.0
    acceleration_rad_s2: float = 400.0
    jerk_rad_s3: float = 4000.0


@dataclass(frozen=True)
class HistoryPlan:
    """One joint's history: everything that its recordings follow from.

    Parameters
    ----------
    cycles : int
        How many; one every `every_days`.
    every_days : float
        1 is nightly.
    seed : int
        The same seed gives the same recordings.
    first : date
        The first night; the climate's season follows from it.
    joint : JointParameters
        Taken as rigid; axis 1 of the thesis' robot where nothing is said.
    climate : Climate
        Of the site.
    repeatability : float
        Standard deviation of the friction level from night to night, as a share: what no
        temperature explains.
    payloads_kg : tuple of float
        One of them is drawn for each night.
    load_friction : float
        Friction a newton metre of gravity torque.
    events : tuple
        `Wear`, `OilChange`, `Swap`, in any order.
    """

    cycles: int = 60
    every_days: float = 1.0
    seed: int = 1
    first: datetime.date = datetime.date(2024, 1, 8)
    robot: str = "simulated"
    axis: int = 1
    joint: JointParameters = field(default_factory=lambda: JointParameters(gravity_sin_nm=0.25))
    climate: Climate = field(default_factory=Climate)
    measuring: Measuring = field(default_factory=Measuring)
    repeatability: float = 0.004
    payloads_kg: tuple[float, ...] = (0.0,)
    payload_arm_m: float = 1.0
    load_friction: float = 0.05
    events: tuple[Wear | OilChange | Swap, ...] = ()

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(self, "cycles", "every_days")
        require_not_negative(self, "repeatability", "load_friction", "payload_arm_m")
        if not self.payloads_kg or min(self.payloads_kg) < 0.0:
            raise ValueError(f"payloads_kg: expected at least one of 0 or more: {self.payloads_kg}")


def cycles(plan: HistoryPlan, motion: Trajectory | None = None) -> Iterator[CycleRun]:
    """Yield the runs of a history in order of time.

    Parameters
    ----------
    plan : HistoryPlan
        The joint and what happens to it.
    motion : Trajectory, optional
        Driven every night; `nightly_stair` without it.
    """
    driven = nightly_stair(plan.joint.gear_ratio) if motion is None else motion
    rng = np.random.default_rng([plan.seed, 1])
    for night in _nights(plan):
        yield _run(plan, night, driven, rng, f"cycle-{night.number:04d}")


def ordinary_runs(plan: HistoryPlan, worker: Worker | None = None) -> Iterator[CycleRun]:
    """Yield, for the very nights of `cycles`, a recording of ordinary work just before."""
    rng = np.random.default_rng([plan.seed, 2])
    for night in _nights(plan):
        motion = _work(worker or Worker(), plan.joint.gear_ratio, rng)
        yield _run(plan, night, motion, rng, f"work-{night.number:04d}")


def nightly_stair(gear_ratio: float = 224.0) -> Trajectory:
    """Return a stair of ten speeds over 100 degrees of the arm in 40 s."""
    half = 0.5 * np.radians(100.0) * gear_ratio
    top = half / 195.0  # the speeds belong to a gear of 224; a smaller one turns its motor less
    return stair_between(
        -half,
        half,
        duration_s=40.0,
        acceleration_rad_s2=1000.0 * top,
        jerk_rad_s3=20_000.0 * top,
        speeds_rad_s=[top * v for v in SPEEDS_RAD_S],
        dwell_min_s=0.35,
    )


@dataclass(frozen=True)
class _Night:
    number: int
    day: float
    ambient_degc: float
    gearbox_degc: float
    payload_kg: float
    level: float


def _nights(plan: HistoryPlan) -> list[_Night]:
    """Draw every night's circumstances; the same for each kind of recording."""
    rng = np.random.default_rng([plan.seed, 0])
    day = np.arange(plan.cycles, dtype=np.float64) * plan.every_days
    of_year = day + plan.first.timetuple().tm_yday - 1.0
    ambient = plan.climate.ambient_degc(of_year, rng)
    gearbox = plan.climate.gearbox_degc(ambient, rng)
    payload = rng.choice(plan.payloads_kg, plan.cycles)
    level = 1.0 + plan.repeatability * rng.standard_normal(plan.cycles)
    drawn = zip(day, ambient, gearbox, payload, level, strict=True)
    return [_Night(k + 1, *map(float, values)) for k, values in enumerate(drawn)]


def _run(
    plan: HistoryPlan, night: _Night, motion: Trajectory, rng: np.random.Generator, name: str
) -> CycleRun:
    condition, gearbox, oil = _condition(plan, night)
    columns = run_columns(plan.joint, condition, motion, plan.measuring, rng)
    n = columns["time_s"].size
    sensor = night.gearbox_degc + 0.05 * rng.standard_normal(n)
    columns["gearbox_temperature_degc"] = np.round(sensor, 1)
    start = datetime.datetime.combine(plan.first, datetime.time(2), datetime.UTC)
    start += datetime.timedelta(days=night.day)
    metadata = {
        "schema": "stribeck.recording/1",
        "robot": plan.robot,
        "axis": plan.axis,
        "gear_ratio": plan.joint.gear_ratio,
        "started_at": start.isoformat(timespec="seconds"),
        "trajectory": {"name": motion.name, "parameters": dict(motion.parameters)},
        "payload_kg": night.payload_kg,
        "ambient_degc": round(night.ambient_degc, 1),
        "samples_lost": 0,
        "gearbox_serial": gearbox,
        "oil": oil,
        "notes": "simulated",
    }
    label = {
        "day": night.day,
        "gearbox_degc": night.gearbox_degc,
        "low_speed_rise_nm": float(condition.rise_nm[0, 1]),
    }
    return CycleRun(name, columns, metadata, label)


def _condition(plan: HistoryPlan, night: _Night) -> tuple[Condition, str, str]:
    """Return the joint's state on a night, with its gearbox's serial number and its oil."""
    law = plan.joint.friction
    gearbox, oil, swapped_on = _FIRST_GEARBOX, _FIRST_OIL, -np.inf
    for event in sorted(
        (e for e in plan.events if not isinstance(e, Wear) and e.day <= night.day),
        key=lambda e: e.day,
    ):
        law = _changed(law, event)
        if isinstance(event, Swap):
            gearbox, swapped_on = event.gearbox_serial, event.day
        else:
            oil = event.oil
    wear: NDArray[np.float64] = np.zeros_like(_WEAR_GRID)
    for worn in plan.events:
        if isinstance(worn, Wear) and worn.onset_day >= swapped_on:
            wear += worn.rise_nm(night.day, _WEAR_GRID)
    truth = _scaled(law.truth(night.gearbox_degc), night.level)
    rise: Floats = np.column_stack((_WEAR_GRID, wear))
    condition = Condition(truth, plan.load_friction, night.payload_kg, plan.payload_arm_m, rise)
    return condition, gearbox, oil


def _changed(law: FrictionParameters, event: OilChange | Swap) -> FrictionParameters:
    coulomb = event.coulomb_factor if isinstance(event, Swap) else 1.0
    return replace(
        law,
        coulomb_nm=law.coulomb_nm * coulomb,
        viscous_nm_s_per_rad=law.viscous_nm_s_per_rad * event.viscous_factor,
    )


def _scaled(truth: FrictionTruth, level: float) -> FrictionTruth:
    return replace(
        truth,
        coulomb_nm=truth.coulomb_nm * level,
        viscous_nm_s_per_rad=truth.viscous_nm_s_per_rad * level,
        static_extra_nm=truth.static_extra_nm * level,
    )


def _work(worker: Worker, gear_ratio: float, rng: np.random.Generator) -> Trajectory:
    """Return moves between random positions with short rests, there and back home."""
    reach = worker.reach_arm_rad * gear_ratio
    places = [0.0, *rng.uniform(-reach, reach, worker.moves - 1).tolist(), 0.0]
    moves = [
        point_to_point(
            a,
            b,
            velocity_rad_s=float(worker.velocity_rad_s * rng.uniform(0.25, 1.0)),
            acceleration_rad_s2=worker.acceleration_rad_s2,
            jerk_rad_s3=worker.jerk_rad_s3,
            rest_s=0.15,
        )
        for a, b in pairwise(places)
    ]
    segments = tuple(s for move in moves for s in move.segments)
    return Trajectory("work", {"moves": worker.moves}, 0.0, segments)
