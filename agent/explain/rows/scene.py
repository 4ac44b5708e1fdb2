"""What candidate forms are computed from: the table's motion at full rate, and the first refit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.ageing import Ageing
from agent.explain.rows.arm_motion import ArmMotion
from agent.explain.rows.blows import Blows, blows_of
from agent.explain.rows.bridged import Bridged
from agent.explain.rows.evidence import Weighing
from agent.explain.rows.kept import Kept
from agent.explain.rows.lag import earlier_by_stretch
from agent.explain.rows.remembered import remembered
from agent.explain.rows.strata import travel_rad
from agent.explain.rows.table import Table
from agent.explain.rows.wave import wave_of
from agent.identify.result import Floats
from agent.physics.derivative import slope
from agent.physics.effects import LEAST_LEVEL, along_the_way
from agent.physics.rigid_body import gravity_columns

_WAVES = 12  # of 2 MB each
_ARM = 0.6  # of the inertia, behind the gear, where nothing says more


@dataclass(frozen=True, eq=False)
class Scene:
    """The table, with what the refitted twin makes of it; like another one only if it is that one.

    Parameters
    ----------
    table : Table
    theta : ndarray, shape (5,)
        The refitted twin's numbers, in the order of `table.BASE`.
    residual_nm : ndarray, shape (n,)
        What the refitted twin leaves, at the rows; 0 where a row is not used.
    given : ndarray, shape (5,), optional
        The twin's numbers as given; `theta` where it says nothing.
    held : callable, optional
        What the arm is held against beside its weight, as far as it was found: scene to torque at
        full rate, shape (N,).
    beside : tuple of callable
        Effects that are known already: scene to what each adds to the refitted twin's torque at
        full rate, shape (N,).
    sliding : tuple of callable
        Effects that sliding friction has beside Coulomb's, as far as they were found: scene to
        torque at full rate, shape (N,). What yields before it slips is all of it.
    ageing : tuple of Ageing
        The arm's part of the dry friction changes alike.
    yields_rad : float
        How far friction was found to give way before it slips; 0 where it was not.
    others_nm : ndarray, shape (n,), optional
        What a model's other terms add at the rows, where one of them is held against the rest.
    late_s : float
        By how much the torque is later than the motion, as far as that was found; below zero
        where the motion is the late one.
    lag_s : float
        How much of that is a low-pass that the torque has passed, and no plain delay.
    arm_share : float
        The arm's share of the inertia, as far as it was found; else as it often is.
    closely : bool
        Whether an arm is followed as closely as its numbers are told, and not as a search asks.
    waves : dict
        The last few of `wave`, by order, with the motion that each is of: searches meet again.
    parts : dict
        The last few parts that laws' columns are mixed of, with the weighing that each is under.
    """

    table: Table
    theta: Floats
    residual_nm: Floats
    given: Floats | None = field(default=None, kw_only=True)
    held: Callable[[Scene], Floats] | None = field(default=None, kw_only=True)
    beside: tuple[Callable[[Scene], Floats], ...] = field(default=(), kw_only=True)
    sliding: tuple[Callable[[Scene], Floats], ...] = field(default=(), kw_only=True)
    ageing: tuple[Ageing, ...] = field(default=(), kw_only=True)
    yields_rad: float = field(default=0.0, kw_only=True)
    others_nm: Floats | None = field(default=None, kw_only=True)
    late_s: float = field(default=0.0, kw_only=True)
    lag_s: float = field(default=0.0, kw_only=True)
    arm_share: float = field(default=_ARM, kw_only=True)
    closely: bool = field(default=False, kw_only=True)
    waves: dict[float, tuple[Floats, Floats, Kept]] = field(
        default_factory=dict, kw_only=True, compare=False, repr=False
    )
    parts: dict[tuple[Callable[..., Floats], tuple[float, ...], bool], tuple[Weighing, Kept]] = (
        field(init=False, default_factory=dict, compare=False, repr=False)
    )

    def full(self, name: str) -> Floats:
        """Return a full-rate column, shape (N,)."""
        return self.table.full[name]

    @property
    def speed(self) -> Floats:
        """Return the smooth speed, shape (N,)."""
        return np.abs(self.table.full["velocity_rad_s"])

    @property
    def direction(self) -> Floats:
        """Return the direction of motion, shape (N,)."""
        return self.table.full["direction"]

    @property
    def as_given(self) -> Floats:
        """Return the twin's numbers as given, shape (5,)."""
        return self.theta if self.given is None else self.given

    @cached_property
    def arm_rad(self) -> Floats:
        """Return the arm's angle behind a stiff gear, shape (N,)."""
        return self.table.full["position_rad"] / self.table.gear_ratio

    def wave(self, order: float) -> Floats:
        """Return cosine and sine of so many times the motor's angle, read-only, shape (N, 2).

        Nothing where the samples cannot follow them.
        """
        position, velocity = self.table.full["position_rad"], self.table.full["velocity_rad_s"]
        found = self.waves.get(order)
        if found is None or found[0] is not position or found[1] is not velocity:
            while len(self.waves) >= _WAVES:
                self.waves.pop(next(iter(self.waves)))
            made = partial(wave_of, order, position, velocity, self.each_piece())
            found = self.waves[order] = position, velocity, Kept(made)
        return found[2].columns

    @cached_property
    def travel_rad(self) -> Floats:
        """Return the motor's travel since it last started or turned round, shape (N,)."""
        return travel_rad(self.table.full, self.table.pieces)

    @cached_property
    def held_nm(self) -> Floats | None:
        """Return what the arm is held against beside its weight, shape (N,); None for nothing."""
        return None if self.held is None else self.held(self)

    @cached_property
    def weight_nm(self) -> Floats:
        """Return what the arm is held against, gravity and what was found beside it, (N,)."""
        held = np.zeros(self.direction.shape[0]) if self.held_nm is None else self.held_nm
        if self.table.load_nm is not None:
            held = held + self.table.load_nm
        if not self.has("position_rad"):
            return held
        sin_nm, cos_nm = self.theta[3:5]
        sin, cos = gravity_columns(self.full("position_rad"), self.table.gear_ratio).T
        return np.asarray(held + sin_nm * sin + cos_nm * cos)

    @cached_property
    def lighter_nm_per_rad(self) -> Floats:
        """Return by how much less an arm weighs for every radian that it is behind, (N,).

        A radian of the motor, as all angles here.
        """
        if not self.has("position_rad"):
            return np.zeros(self.direction.shape[0])
        sin_nm, cos_nm = self.theta[3:5]
        sin, cos = gravity_columns(self.full("position_rad"), self.table.gear_ratio).T
        return np.asarray((sin_nm * cos - cos_nm * sin) / self.table.gear_ratio)

    @cached_property
    def stiff_rad_s2(self) -> Floats:
        """Return the acceleration of an arm behind a stiff gear, as recorded, shape (N,)."""
        return self._slope_of("velocity_raw_rad_s")

    @cached_property
    def stiff_along_the_way_rad_s2(self) -> Floats:
        """Return the same of a velocity that is kept to the position's way, shape (N,)."""
        return self._slope_of("velocity_driving_rad_s")

    def _slope_of(self, name: str) -> Floats:
        velocity = self.table.full[name]
        out = np.empty_like(velocity)
        for at, period_s in self.each_piece():
            out[at] = slope(velocity[at], period_s)
        return out

    @cached_property
    def drawn(self) -> Floats:
        """Return how far dry friction is drawn out where it yields, -1 to 1, shape (N,).

        The direction of motion where it was not found to yield.
        """
        if not self.yields_rad > 0.0:
            return self.direction
        from agent.physics.kernels import slipping

        stiffness, level = np.array([1.0 / self.yields_rad]), np.ones(1)
        return remembered(
            self.table.full,
            self.table.pieces,
            lambda time, velocity, _, start: slipping(time, velocity, stiffness, level, start),
        )

    @cached_property
    def level_share(self) -> Floats:
        """Return all of sliding friction over Coulomb's, shape (N,); 1 where no more was found."""
        return self._over_coulomb(self.sliding)

    @cached_property
    def worn_share(self) -> Floats:
        """Return what time and use have made of the dry friction over Coulomb's, shape (N,)."""
        return self._over_coulomb(self.ageing)

    def _over_coulomb(self, effects: Sequence[Callable[[Scene], Floats]]) -> Floats:
        coulomb = float(self.theta[2])
        if not effects or not coulomb > 0.0:
            return np.ones_like(self.direction)
        more = np.sum([torque_nm(self) for torque_nm in effects], axis=0)
        return np.maximum(1.0 + along_the_way(more, self.direction) / coulomb, LEAST_LEVEL)

    def load_nm(self, arm_share: float = 1.0) -> Floats:
        """Return the torque of the weight and of a share of the inertia, shape (N,)."""
        inertia = arm_share * self.theta[0]
        return np.asarray(inertia * self.table.full["acceleration_rad_s2"] + self.weight_nm)

    def arm_rows(self) -> Floats:
        """Return the arm's angle at the rows, shape (n,)."""
        return self.table.rows["position_rad"] / self.table.gear_ratio

    def load_rows(self) -> Floats:
        """Return the torque of weight and inertia at the rows, shape (n,)."""
        return np.asarray(self.weight_rows() + self.table.base[:, 0] * self.theta[0])

    def weight_rows(self) -> Floats:
        """Return `weight_nm` at the rows, shape (n,)."""
        gravity = np.asarray(self.table.base[:, 3:5] @ self.theta[3:5])
        if self.table.load_nm is not None:
            gravity = gravity + self.table.band(self.table.load_nm)
        return gravity if self.held_nm is None else gravity + self.table.band(self.held_nm)

    @cached_property
    def blows(self) -> Blows | None:
        """Return the blows of loose teeth that are heard above the band; None for none."""
        return blows_of(self.table, self.theta, self.weight_nm)

    @cached_property
    def predicted_nm(self) -> Floats:
        """Return the refitted twin's torque and the known effects' at full rate, shape (N,)."""
        plain = self.own_nm
        if self.beside and self.held_nm is not None:
            plain = plain - self.held_nm  # it is among the known effects
        return np.asarray(plain + self.beside_nm)

    @cached_property
    def own_nm(self) -> Floats:
        """Return the refitted twin's torque alone, shape (N,): known effects may rest on it."""
        full = self.table.full
        friction = self.theta[2] * full["direction"] + self.theta[1] * full["velocity_rad_s"]
        return np.asarray(self.load_nm() + friction)

    @property
    def not_smooth_nm(self) -> Floats:
        """Return what `own_nm` lacks as its motion is smooth, shape (N,)."""
        full, recorded = self.table.full, self.table.as_recorded
        faster = recorded["acceleration_rad_s2"] - full["acceleration_rad_s2"]
        rough = recorded["velocity_rad_s"] - full["velocity_rad_s"]
        inertia, viscous = self.theta[:2]
        return np.asarray(inertia * faster + viscous * rough)

    @property
    def not_late_nm(self) -> Floats:
        """Return of `predicted_nm` what no column of its own brings as late as it is, (N,)."""
        return self.predicted_nm - self.beside_nm if self.late_s else self.predicted_nm

    def as_late(self, raw: Floats) -> Floats:
        """Return full-rate columns, shape (N,) or (N, k), as late as the torque is."""
        if not self.late_s:
            return raw
        if self.lag_s:
            raw = self.smoothed(raw)
        return earlier_by_stretch(raw, self.each_piece(), self.lag_s - self.late_s)

    def smoothed(self, raw: Floats) -> Floats:
        """Return full-rate columns, shape (N,) or (N, k), behind the torque's low-pass."""
        from agent.physics.kernels import smoothed

        own, time = np.ascontiguousarray(raw.reshape(raw.shape[0], -1)), self.full("time_s")
        each = [smoothed(time[at], own[at], self.lag_s) for at, _ in self.each_piece()]
        return np.concatenate(each).reshape(raw.shape)

    def on_time(self, rows_nm: Floats) -> Floats:
        """Return a torque at the rows, shape (n,), in step with the motion."""
        if not self.late_s:
            return rows_nm
        each = [(piece.rows, piece.period_s * piece.stride) for piece in self.table.pieces]
        return earlier_by_stretch(rows_nm, each, self.late_s)

    @cached_property
    def beside_nm(self) -> Floats:
        """Return what the known effects add at full rate, shape (N,)."""
        out = np.zeros(self.direction.shape[0])
        for torque_nm in self.beside:
            out += torque_nm(self)
        return out

    @property
    def slowest(self) -> float:
        """Return the slowest speed that was held, rad/s."""
        return self.speeds[0]

    @property
    def fastest(self) -> float:
        """Return the fastest speed, rad/s."""
        return self.speeds[1]

    @cached_property
    def one_way(self) -> bool:
        """Return whether only one direction was driven."""
        direction = self.table.rows["direction"][self.table.sliding]
        return bool(np.unique(direction[direction != 0.0]).size == 1)

    @cached_property
    def speeds(self) -> tuple[float, float]:
        """Return the 2 % and 99 % quantiles of the speed while sliding, rad/s."""
        rows = self.table
        speed = np.abs(rows.rows["velocity_rad_s"][rows.sliding])
        if not speed.size:
            return 1.0, 2.0
        fast = float(np.quantile(speed, 0.99))
        return max(float(np.quantile(speed, 0.02)), 1e-3 * fast), fast

    def has(self, name: str) -> bool:
        """Return whether a column was recorded in every run."""
        return self.table.has(name)

    def stroke_arm_rad(self) -> tuple[float, float]:
        """Return the angles of the arm that hold all but a hundredth of the rows at either end."""
        lower, upper = self.span("position_rad")
        return lower / self.table.gear_ratio, upper / self.table.gear_ratio

    def ends_arm_rad(self) -> tuple[float, float]:
        """Return the least and the greatest angle of the arm at the used rows."""
        values = self.arm_rows()[self.table.used]
        return float(values.min()), float(values.max())

    def span(self, name: str) -> tuple[float, float]:
        """Return the 1 % and 99 % quantiles of a row column over the used rows."""
        values = self.table.rows[name][self.table.used]
        return float(np.quantile(values, 0.01)), float(np.quantile(values, 0.99))

    def mean(self, name: str) -> float:
        """Return the mean of a row column over the used rows."""
        return float(np.mean(self.table.rows[name][self.table.used]))

    def each_piece(self) -> Sequence[tuple[slice, float]]:
        """Return the full-rate slice and the period of every stretch."""
        return [(piece.full, piece.period_s) for piece in self.table.pieces]

    @cached_property
    def bridged(self) -> Bridged:
        """Return the stretches in a row, across samples that were lost."""
        return Bridged.of(self.table.pieces)

    @cached_property
    def sprung_arm(self) -> ArmMotion:
        """Return what moves an arm on a spring.

        It follows the velocity as recorded: the smooth one would lack the swing itself. What an arm
        behind a stiff gear rubs yields with the joint, as another term says where one says it.
        """
        return self._arm_motion("velocity_raw_rad_s", self.stiff_rad_s2, self.direction)

    @cached_property
    def loose_arm(self) -> ArmMotion:
        """Return what moves an arm in a gap.

        It stands where the motor's way has led it, so that it is driven by a velocity that is kept
        to that; one on a spring follows, and what is not in the inertia's own column would be a
        swing.
        """
        along = self.stiff_along_the_way_rad_s2
        return self._arm_motion("velocity_driving_rad_s", along, self.drawn)

    def _arm_motion(self, driving: str, stiff_rad_s2: Floats, drawn: Floats) -> ArmMotion:
        across = self.bridged.over
        return ArmMotion(
            self.bridged,
            velocity_rad_s=across(self.full(driving), self.full("position_rad")),
            stiff_rad_s2=across(stiff_rad_s2),
            drawn=across(drawn),
            worn_share=across(self.worn_share),
            weight_nm=across(self.weight_nm),
            lighter_nm_per_rad=across(self.lighter_nm_per_rad),
            oil_rad_s=across(self.full("velocity_rad_s")),
        )

    def runs(self) -> NDArray[np.int64]:
        """Return the run of every full-rate sample, shape (N,)."""
        return np.round(self.table.full["run"]).astype(np.int64)
