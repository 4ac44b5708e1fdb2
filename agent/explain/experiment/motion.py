"""A motion that nobody has recorded yet, as the table and scene that every form is computed on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from agent.explain.experiment.menu import Part
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, Table, tabulate
from agent.explain.rows.use import OPERATING, TURNED, recorded_use
from agent.identify.result import Floats
from agent.physics import rigid_body
from agent.physics.effects.motion import path_rad
from agent.physics.twin import Twin
from trajectories import Trajectory

_RATE_PER_CUTOFF = 12.0
Temperatures = Callable[[Floats], Mapping[str, Floats]]

_TEMPERATURES = ("gearbox_temperature_degc", "motor_temperature_degc")


@dataclass(frozen=True)
class Elsewhere(Scene):
    """Another motion, seen with the references of the recordings.

    Forms count from the recordings' mean temperature, middle, or fastest speed; their numbers mean
    the same on another motion only if these references stay.

    Parameters
    ----------
    home : Scene
        The recordings.
    """

    home: Scene = field(kw_only=True)

    @cached_property
    def speeds(self) -> tuple[float, float]:
        """Return the recordings' slowest and fastest speed, rad/s."""
        return self.home.speeds

    def has(self, name: str) -> bool:
        """Return whether the recordings have a column."""
        return self.home.has(name)

    def span(self, name: str) -> tuple[float, float]:
        """Return the recordings' quantiles of a column."""
        return self.home.span(name)

    def mean(self, name: str) -> float:
        """Return the recordings' mean of a column."""
        return self.home.mean(name)

    def runs(self) -> NDArray[np.int64]:
        """Return the run of every full-rate sample, counted on from the recordings', shape (N,)."""
        return np.asarray(super().runs() + len(self.home.table.runs))


def elsewhere(home: Scene, experiments: Sequence[Sequence[Part]]) -> Elsewhere:
    """Return the scene of some experiments that were not driven yet, all of one load.

    Parameters
    ----------
    home : Scene
        Of the recordings: its band, its numbers and its references are kept.
    experiments : sequence of sequences of Part
        The parts of one are driven one after another. Every one begins with the joint as used as
        the recordings left it: only one of them will be driven.
    """
    parts = [part for experiment in experiments for part in experiment]
    load = {part.load for part in parts}
    if len(load) != 1:
        raise ValueError(f"expected runs of one load, got {sorted(load)}")
    theta = home.theta.copy()
    theta[3:5] *= load.pop()
    cutoff_hz = home.table.cutoff_hz
    recorded_s = min(piece.period_s for piece in home.table.pieces)
    period_s = max(recorded_s, 1.0 / (_RATE_PER_CUTOFF * cutoff_hz))
    warmth = _Warmth.of(home)
    runs = [
        simulated_run(
            part.trajectory,
            theta,
            home.table.gear_ratio,
            period_s,
            partial(warmth.columns, part.warmth),
            placed=home.has("position_rad"),
        )
        for part in parts
    ]
    table = tabulate(
        plain_twin(theta, home.table.gear_ratio), runs, cutoff_hz, align_velocity=False
    )
    begun = [k > 0 for experiment in experiments for k in range(len(experiment))]
    clocks = {"elapsed_s": _elapsed(home, table, parts), **_use(home, table, begun)}
    table = replace(table, full={**table.full, **clocks})
    same = {f.name: getattr(home, f.name) for f in fields(Scene) if f.init}
    left = np.zeros(table.used.shape[0])
    return Elsewhere(**{**same, "table": table, "theta": theta, "residual_nm": left, "home": home})


def simulated_run(
    trajectory: Trajectory,
    theta: Floats,
    gear_ratio: float,
    period_s: float,
    temperatures: Temperatures,
    *,
    placed: bool = True,
) -> Run:
    """Return a trajectory as a plain joint would have it recorded, without noise.

    Parameters
    ----------
    trajectory : Trajectory
    theta : ndarray, shape (5,)
        Of the joint, in the order of `table.BASE`.
    gear_ratio, period_s : float
    temperatures : callable
        From the motor's path, rad, shape (n,), to every temperature along it, by column.
    placed : bool
        Whether the position is recorded.
    """
    samples = math.floor(trajectory.duration_s / period_s) + 1
    time = np.arange(samples, dtype=np.float64) * period_s
    points = trajectory.sample(time)
    columns = rigid_body.regressor(
        points.position_rad if placed else None,
        points.velocity_rad_s,
        points.acceleration_rad_s2,
        np.sign(points.velocity_rad_s),
        gear_ratio,
    )[:, : len(BASE)]
    recorded = {
        "time_s": time,
        "velocity_rad_s": points.velocity_rad_s,
        "torque_nm": columns @ theta,
        **temperatures(path_rad(time, points.velocity_rad_s)),
    }
    if placed:
        recorded["position_rad"] = points.position_rad
    return Run.from_columns(recorded, gear_ratio, name=trajectory.name)


def plain_twin(theta: Floats, gear_ratio: float) -> Twin:
    """Return the twin of five numbers; what cannot be negative is cut at zero."""
    numbers = dict(zip(BASE, (float(x) for x in theta), strict=True))
    return Twin(
        "planned",
        1,
        gear_ratio,
        max(numbers["inertia_kg_m2"], 0.0),
        max(numbers["coulomb_nm"], 0.0),
        max(numbers["viscous_nm_s_per_rad"], 0.0),
        numbers["gravity_sin_nm"],
        numbers["gravity_cos_nm"],
    )


@dataclass(frozen=True)
class _Warmth:
    """Temperatures where the recordings began, where they ended, and how driving warms.

    A joint that is driven is used and warmed at once. If an experiment's temperature stood still,
    warmth and use would part in it as they never do.

    Parameters
    ----------
    ends : mapping of str to (float, float)
        At the beginning and at the end of the recordings, degC, by column.
    rise : mapping of str to float
        For every radian of the motor's path, as within the recordings; not below zero.
    """

    ends: Mapping[str, tuple[float, float]]
    rise: Mapping[str, float]

    @classmethod
    def of(cls, home: Scene) -> _Warmth:
        order = np.arange(home.table.used.shape[0])
        if home.has("elapsed_s"):
            order = np.argsort(home.table.rows["elapsed_s"], kind="stable")
        order = order[home.table.used[order]]
        tenth = max(1, order.shape[0] // 10)
        ends, rise = {}, {}
        for name in _TEMPERATURES:
            if home.has(name):
                values = home.table.rows[name][order]
                ends[name] = (
                    float(np.median(values[:tenth])),
                    float(np.median(values[-tenth:])),
                )
                rise[name] = _rise_per_rad(home.table, name)
        return cls(ends, rise)

    def columns(self, warmth: float, path_rad: Floats) -> dict[str, Floats]:
        """Return the temperatures along a path that begins at a warmth from 0 to 1."""
        return {
            name: begin + warmth * (end - begin) + self.rise[name] * path_rad
            for name, (begin, end) in self.ends.items()
        }


def _rise_per_rad(table: Table, name: str) -> float:
    """Return by how much a column rises with the motor's path, by least squares within pieces."""
    square, product = 0.0, 0.0
    for piece in table.pieces:
        path = path_rad(table.full["time_s"][piece.full], table.full["velocity_rad_s"][piece.full])
        values = table.full[name][piece.full]
        known = np.isfinite(values)
        if not known.any():
            continue
        away = path[known] - np.mean(path[known])
        square += float(away @ away)
        product += float(away @ values[known])
    return max(product / square, 0.0) if square > 0.0 else 0.0


def _elapsed(home: Scene, table: Table, parts: Sequence[Part]) -> Floats:
    """Return the recordings' own clock at full rate, shape (N,); NaN where it is not known."""
    out = np.full(table.full["time_s"].shape[0], np.nan)
    if not home.has("elapsed_s"):
        return out
    clock = home.table.full["elapsed_s"]
    first, last = float(np.nanmin(clock)), float(np.nanmax(clock))
    for piece in table.pieces:
        later_s = parts[piece.run].later * (last - first)
        out[piece.full] = last + later_s + table.full["time_s"][piece.full]
    # What counts from the first sample counts from the recordings' first: the joint stands there,
    # and the row is not used.
    out[0] = first
    return out


def _use(home: Scene, table: Table, begun: Sequence[bool]) -> dict[str, Floats]:
    """Return the recordings' odometers at full rate, shape (N,): what is driven is added to them.

    `begun` says of every run whether its experiment had begun before it. NaN where the recordings'
    own are not known.
    """
    use = recorded_use(table.runs, table.pieces, table.full)
    out = {}
    for name, counted in ((OPERATING, "seconds"), (TURNED, "turned_rad")):
        known = home.has(name)
        last = float(np.nanmax(home.table.full[name])) if known else math.nan
        out[name] = np.full(table.full["time_s"].shape[0], last)
        before = _before(begun, [getattr(each, counted) for each in use])
        for piece in table.pieces:
            time = table.full["time_s"][piece.full]
            speed = table.full["velocity_rad_s"][piece.full]
            own = time if name == OPERATING else path_rad(time, speed)
            out[name][piece.full] += before[piece.run] + own
    return out


def _before(begun: Sequence[bool], amounts: Sequence[float]) -> list[float]:
    """Return what an experiment had added before each of its runs."""
    out: list[float] = []
    for k, goes_on in enumerate(begun):
        out.append(out[-1] + amounts[k - 1] if goes_on else 0.0)
    return out
