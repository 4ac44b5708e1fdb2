"""What an effect is computed from: one run's motion, and the twin's own numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.physics.derivative import slope
from agent.physics.friction import boundary_share
from agent.physics.gaps import LONGEST_GAP_S
from agent.physics.periodic import followed
from agent.physics.rigid_body import gravity_columns

Floats = NDArray[np.float64]

LEAST_LEVEL = 0.01
"""Of Coulomb and Stribeck friction: what yields does not turn round."""


@dataclass(frozen=True)
class Recorded:
    """Another recording of the joint: when it began, how long it lasted, how far the motor went."""

    started_at_unix_s: float
    seconds: float
    turned_rad: float


@dataclass(frozen=True)
class Motion:
    """What was measured of one run; None where it was not.

    Parameters
    ----------
    velocity_rad_s, acceleration_rad_s2 : ndarray, shape (n,)
        Of the motor.
    direction : ndarray, shape (n,)
        The velocity's sign, thresholded or filtered where the caller wishes.
    position_rad, time_s : ndarray, shape (n,), optional
        Motor angle; seconds from the recording's start.
    gearbox_temperature_degc, motor_temperature_degc : ndarray, shape (n,), optional
    started_at_unix_s : float, optional
        When the recording started, seconds since 1970-01-01 UTC.
    run : float, optional
        Which run of a series this is, counted from any of them.
    velocity_raw_rad_s : ndarray, shape (n,), optional
        The velocity before any filter, evenly sampled, where `velocity_rad_s` is smooth.
    turned_rad : ndarray, shape (n,), optional
        How far the motor has gone to and fro since the recording began; counted from the motion's
        first sample where it is not given.
    recorded_before : tuple of Recorded
        What was recorded of the joint before this run, as far as it is at hand.
    payload_kg : float, optional
        What the arm carries.
    before : Motion, optional
        The same recording until samples were lost: what has a memory keeps it across the gap.
    position_arm_rad : ndarray, shape (n,), optional
        Of the arm, by an encoder of its own.
    """

    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    direction: Floats
    position_rad: Floats | None = None
    time_s: Floats | None = None
    gearbox_temperature_degc: Floats | None = None
    motor_temperature_degc: Floats | None = None
    started_at_unix_s: float | None = None
    run: float | None = None
    velocity_raw_rad_s: Floats | None = None
    turned_rad: Floats | None = None
    recorded_before: tuple[Recorded, ...] = ()
    payload_kg: float | None = None
    before: Motion | None = None
    position_arm_rad: Floats | None = None

    def payload_beyond_kg(self, reference_kg: float) -> float:
        """Return how much more than a reference the arm carries; nothing where that is not said."""
        return 0.0 if self.payload_kg is None else self.payload_kg - reference_kg

    @property
    def unfiltered(self) -> Motion:
        """Return the motion as it was before any filter, as far as it is known.

        What swings behind the motor is driven by it: a smooth velocity lacks the corners that the
        position has, and passes the comparison's own filter a second time.
        """
        raw, period_s = self.velocity_raw_rad_s, self.period_s
        if raw is None or not period_s:
            return self
        return replace(self, velocity_rad_s=raw, acceleration_rad_s2=slope(raw, period_s))

    @property
    def period_s(self) -> float:
        """Return the time between samples; 0 where it is not known."""
        time = self.time_s
        if time is None or time.shape[0] < 2:
            return 0.0
        return float((time[-1] - time[0]) / (time.shape[0] - 1))

    def followed(self, order_per_motor_rev: float) -> Floats:
        """Return 1 where the samples can follow such a wave along the motion, else 0, (n,)."""
        return followed(order_per_motor_rev, self.velocity_rad_s, self.period_s)

    @property
    def path_rad(self) -> Floats:
        """Return how far the motor has gone since the recording began, shape (n,)."""
        if self.turned_rad is not None:
            return self.turned_rad
        return path_rad(self.need("time_s"), self.velocity_rad_s)

    def with_memory(self, travel_rad: float) -> tuple[Motion, ...]:
        """Return this motion behind as many stretches before it as friction may remember.

        Parameters
        ----------
        travel_rad : float
            Springs that were drawn out over so much in one direction know nothing of before.
        """
        out = [self]
        while (earlier := out[0].before) is not None:
            out.insert(0, earlier)
            went = np.nancumsum(earlier.velocity_rad_s[:-1] * np.diff(earlier.need("time_s")))
            if went.size and float(np.ptp(went)) > travel_rad:
                break
        return tuple(out)

    def in_a_row(self, seconds: float) -> tuple[Motion, ...]:
        """Return this motion behind those before it, as long as only a few samples were lost.

        Parameters
        ----------
        seconds : float
            What swings knows nothing of before.
        """
        out, longest_s = [self], self.need("time_s")[0] - seconds
        while (earlier := out[0].before) is not None:
            last_s, first_s = earlier.need("time_s")[-1], out[0].need("time_s")[0]
            if last_s < longest_s or not 0.0 < first_s - last_s <= LONGEST_GAP_S:
                break
            out.insert(0, earlier)
        return tuple(out)

    def need(self, name: str) -> Floats:
        """Return one column, or refuse by name."""
        values = getattr(self, name)
        if values is None:
            raise ValueError(f"needs {name}, and none was given")
        return np.asarray(values, dtype=np.float64)


def path_rad(time_s: Floats, velocity_rad_s: Floats) -> Floats:
    """Return the path from the first sample on, to and fro, shape (n,); what is NaN adds nothing.

    By the velocity: an encoder's steps and noise would add up.
    """
    speed = np.nan_to_num(np.abs(velocity_rad_s))
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time_s)
    return np.concatenate(([0.0], np.cumsum(steps)))


def along_the_way(torque_nm: Floats, direction: Floats) -> Floats:
    """Return a friction as a level, shape (n,); where nothing moves it is what it was last.

    Before the first motion it is what it is at first.
    """
    moving = direction != 0.0
    if not moving.any():
        return np.zeros_like(torque_nm)
    last = np.maximum.accumulate(np.where(moving, np.arange(moving.shape[0]), 0))
    last[: int(np.argmax(moving))] = np.argmax(moving)
    return np.asarray((torque_nm * np.sign(direction))[last])


@dataclass(frozen=True)
class Boundary:
    """One Stribeck effect of a twin: what its dry friction has more at low speed."""

    static_extra_nm: float
    stribeck_velocity_rad_s: float
    exponent: float


@dataclass(frozen=True)
class Base:
    """The twin's own numbers that effects refer to.

    Coulomb level and gravity are those that the twin ends up with: `wrong-number` and
    `gravity-imbalance` are counted in, because a spring or a bristle cannot tell them apart; what a
    stated payload adds to the arm's inertia stands beside the twin's own. `sliding_more_nm`, shape
    (n,), is what other effects add to the level of sliding friction along the motion,
    `aged_more_nm`, shape (n,), what time and use add to that of dry friction, and `held_more_nm`,
    shape (n,), what they hold the arm with beside its weight. `yields` says that another effect has
    all of friction yield before it slips, the arm's behind a stiff gear as well.
    """

    gear_ratio: float
    inertia_kg_m2: float
    coulomb_nm: float
    gravity_sin_nm: float
    gravity_cos_nm: float
    boundaries: tuple[Boundary, ...] = ()
    payload_inertia_kg_m2: float = 0.0
    sliding_more_nm: Floats | None = None
    held_more_nm: Floats | None = None
    aged_more_nm: Floats | None = None
    yields: bool = False

    def arm_rad(self, motion: Motion) -> Floats:
        """Return the arm's angle, shape (n,), as a stiff gear has it."""
        return motion.need("position_rad") / self.gear_ratio

    def weight_nm(self, motion: Motion) -> Floats:
        """Return gravity's torque on the motor side, shape (n,); zero asks for no position."""
        if not (self.gravity_sin_nm or self.gravity_cos_nm):
            return np.zeros_like(motion.velocity_rad_s)
        columns = gravity_columns(motion.need("position_rad"), self.gear_ratio)
        return np.asarray(columns @ np.array([self.gravity_sin_nm, self.gravity_cos_nm]))

    def held_nm(self, motion: Motion) -> Floats:
        """Return what the gear holds the arm against, shape (n,): weight, and what pulls beside."""
        weight = self.weight_nm(motion)
        return weight if self.held_more_nm is None else weight + self.held_more_nm

    def level_nm(self, motion: Motion) -> Floats:
        """Return the level of all friction of lasting motion but plain viscous, shape (n,)."""
        level = self.dry_level_nm(motion.velocity_rad_s)
        if self.sliding_more_nm is None:
            return level
        return np.maximum(level + self.sliding_more_nm, LEAST_LEVEL * level)

    def worn_share(self, motion: Motion) -> Floats:
        """Return what time and use have made of dry friction over Coulomb's, shape (n,)."""
        if self.aged_more_nm is None or not self.coulomb_nm > 0.0:
            return np.ones_like(motion.velocity_rad_s)
        return np.maximum(1.0 + self.aged_more_nm / self.coulomb_nm, LEAST_LEVEL)

    def dry_level_nm(self, velocity_rad_s: Floats) -> Floats:
        """Return the level of dry friction at a speed, shape (n,): Coulomb and Stribeck."""
        level = np.full_like(velocity_rad_s, self.coulomb_nm)
        for each in self.boundaries:
            share = boundary_share(velocity_rad_s, each.stribeck_velocity_rad_s, each.exponent)
            level = level + each.static_extra_nm * share
        return level
