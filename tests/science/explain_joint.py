"""A plain joint with one law more, on any trajectory: recordings for the explanation's tests.

Torque is written down from the set-points, so that what is missing is known to the last digit.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.choosing.choice import Choice, choose
from agent.explain.choosing.search import Library
from agent.explain.forms.library import judgeable
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from agent.physics.twin import Twin
from trajectories import SetPoints, Trajectory, stair_paired

GEAR_RATIO = 100.0
NOISE_NM = 0.02
TWIN = Twin("bench", 1, GEAR_RATIO, 0.012, 0.5, 0.01)
RATE_HZ = 250.0
YIELDS_OVER_RAD = 0.15

Missing = Callable[[SetPoints, "Conditions"], Floats]


@dataclass(frozen=True)
class Conditions:
    """How the joint is found."""

    gearbox_degc: float = 25.0
    started_s: float = 0.0


def nothing(points: SetPoints, at: Conditions) -> Floats:
    """Return the law of a joint that lacks none."""
    del at
    return np.zeros_like(points.velocity_rad_s)


def yields(now: SetPoints, at: Conditions) -> Floats:
    """Return what Dahl's friction lacks of Coulomb's."""
    del at
    drawn = np.ones_like(now.position_rad)
    for i, step in enumerate(np.diff(now.position_rad), start=1):
        slope = 1.0 - np.sign(step) * drawn[i - 1]
        drawn[i] = np.clip(drawn[i - 1] + step / YIELDS_OVER_RAD * slope, -1.0, 1.0)
    return np.asarray(TWIN.coulomb_nm * (drawn - np.sign(now.velocity_rad_s)))


def stair(
    speeds_rad_s: Sequence[float], stroke_rad: float = 120.0, duration_s: float = 24.0
) -> Trajectory:
    """Return a paired stair about zero."""
    return stair_paired(
        -0.5 * stroke_rad,
        0.5 * stroke_rad,
        speeds_rad_s=speeds_rad_s,
        duration_s=duration_s,
        acceleration_rad_s2=200.0,
        jerk_rad_s3=5000.0,
        dwell_min_s=0.1,
    )


def record(
    trajectory: Trajectory, missing: Missing, at: Conditions, seed: int, *, name: str = "run"
) -> Run:
    """Return a recording of the joint with a law that its twin lacks."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(trajectory.duration_s * RATE_HZ)) / RATE_HZ
    points = trajectory.sample(time)
    torque = (
        TWIN.inertia_kg_m2 * points.acceleration_rad_s2
        + TWIN.viscous_nm_s_per_rad * points.velocity_rad_s
        + TWIN.coulomb_nm * np.sign(points.velocity_rad_s)
        + missing(points, at)
        + NOISE_NM * rng.standard_normal(time.shape[0])
    )
    columns = {
        "time_s": time,
        "position_rad": points.position_rad,
        "velocity_rad_s": points.velocity_rad_s + 0.01 * rng.standard_normal(time.shape[0]),
        "torque_nm": torque,
        "gearbox_temperature_degc": np.full(time.shape[0], at.gearbox_degc),
    }
    return Run.from_columns(columns, GEAR_RATIO, name=name, started_s=at.started_s)


def library_of(
    runs: Sequence[Run], twin: Twin = TWIN, asked: Collection[str] | None = None
) -> Library:
    """Return the candidates on recordings, as an explanation has them; of some effects alone."""
    table = tabulate(twin, runs)
    delta, left = refit(table)
    theta = np.array([getattr(twin, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)
    forms = [form for form in judgeable(table)[0] if asked is None or form.effect in asked]
    return Library.of(scene, weigh(table, left), forms)


def chosen(runs: Sequence[Run]) -> tuple[Library, Choice]:
    """Return the candidates and what an explanation chooses of them."""
    library = library_of(runs)
    return library, choose(library)
