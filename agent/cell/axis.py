"""CELL.toml's axes: limits, supervision and cycle of one joint, and who has commissioned it.

Angles of the arm are in degrees here, because that is what a technician reads from the robot's
pendant; they are converted to motor-side radians once, in this module.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from agent.cell.bus import Drive, Finite
from agent.cell.devices import (
    Cia404Temperature,
    ContactRelease,
    Job,
    Part,
    Positive,
    Release,
    Temperature,
)
from agent.errors import InputError
from trajectories import AxisLimits, TorqueModel, motor_rad

NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class Limits(Part):
    """What this axis may never exceed; the gate refuses what would."""

    arm_position_min_deg: Finite
    arm_position_max_deg: Finite
    motor_velocity_max_rad_s: Positive
    motor_acceleration_max_rad_s2: Positive
    motor_jerk_max_rad_s3: Positive
    motor_torque_max_nm: Positive
    stopping_deceleration_rad_s2: Positive
    velocity_error_max_rad_s: Positive
    following_error_max_arm_deg: Positive
    gearbox_temperature_min_degc: Finite = 0.0
    gearbox_temperature_max_degc: Finite = 80.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.arm_position_min_deg >= self.arm_position_max_deg:
            raise ValueError("arm_position_min_deg must be below arm_position_max_deg")
        if self.gearbox_temperature_min_degc >= self.gearbox_temperature_max_degc:
            raise ValueError(
                "gearbox_temperature_min_degc must be below gearbox_temperature_max_degc"
            )
        return self


class Supervision(Part):
    """How quickly silence is noticed, by us and by the drive."""

    agent_node_id: int = Field(default=127, ge=1, le=127)
    heartbeat_period_s: Positive = 0.02
    heartbeat_timeout_s: Positive = 0.15
    drive_heartbeat_period_s: Positive = 0.1
    sample_age_max_s: Positive = 0.1
    samples_lost_in_a_row_max: int = Field(default=3, ge=1)

    @property
    def reaction_time_s(self) -> float:
        """Return how long the joint may go on before anything brakes it, in seconds."""
        return max(self.heartbeat_timeout_s + self.heartbeat_period_s, self.sample_age_max_s)

    @model_validator(mode="after")
    def _heartbeats_fit(self) -> Self:
        if self.heartbeat_timeout_s < 3.0 * self.heartbeat_period_s:
            raise ValueError("heartbeat_timeout_s must be at least three heartbeat_period_s")
        return self


class Stair(Part):
    """The identification cycle: each speed forward and backward, between two arm positions."""

    kind: Literal["paired", "between"] = "paired"
    arm_from_deg: Finite = -50.0
    arm_to_deg: Finite = 50.0
    speeds: int = Field(default=11, ge=2, le=60)
    motor_velocity_min_rad_s: Positive
    motor_velocity_max_rad_s: Positive
    motor_acceleration_rad_s2: Positive
    motor_jerk_rad_s3: Positive
    duration_s: Positive = 40.0
    approach_velocity_rad_s: Positive
    start_tolerance_arm_deg: Positive = 0.5

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.motor_velocity_min_rad_s >= self.motor_velocity_max_rad_s:
            raise ValueError("motor_velocity_min_rad_s must be below motor_velocity_max_rad_s")
        if self.arm_from_deg >= self.arm_to_deg:
            raise ValueError("arm_from_deg must be below arm_to_deg")
        return self


class Expected(Part):
    """A rough idea of the joint, for the torque estimate of the dry run; motor side."""

    inertia_kg_m2: NonNegative = 0.0
    coulomb_nm: NonNegative = 0.0
    viscous_nm_s_per_rad: NonNegative = 0.0
    gravity_peak_nm: NonNegative = 0.0


class Axis(Part):
    """One joint: its drive, its limits, its cycle, and who has commissioned it."""

    number: int = Field(ge=1, le=99)
    commissioned: bool = False
    commissioned_by: str = ""
    gear_ratio: Annotated[float, Field(ge=1.0, allow_inf_nan=False)]
    gearbox_serial: str = ""
    payload_kg: NonNegative | None = None
    drive_: Drive | None = Field(default=None, alias="drive")
    job: Job | None = None
    limits: Limits
    stair: Stair
    supervision: Supervision = Supervision()
    expected: Expected | None = None
    temperature: Temperature | None = None

    @property
    def drive(self) -> Drive:
        """Return the servo drive, or refuse: a controller may run the axis by itself."""
        if self.drive_ is None:
            raise InputError(
                f"Axis {self.number} has no drive of its own: a controller runs it as a job."
            )
        return self.drive_

    @property
    def has_gearbox_temperature(self) -> bool:
        """Return whether a gearbox temperature is measured: by drive, probe or controller."""
        by_drive = self.drive_ is not None and self.drive_.gearbox_temperature is not None
        by_controller = self.job is not None and self.job.gearbox_temperature
        return by_drive or self.temperature is not None or by_controller

    def motor_rad(self, arm_deg: float) -> float:
        """Return the motor angle, in radians, of an arm angle in degrees."""
        return motor_rad(arm_deg, self.gear_ratio)

    @property
    def motor_limits(self) -> AxisLimits:
        """Return the limits on the motor side, in radians."""
        return AxisLimits(
            position_min_rad=self.motor_rad(self.limits.arm_position_min_deg),
            position_max_rad=self.motor_rad(self.limits.arm_position_max_deg),
            velocity_max_rad_s=self.limits.motor_velocity_max_rad_s,
            acceleration_max_rad_s2=self.limits.motor_acceleration_max_rad_s2,
            jerk_max_rad_s3=self.limits.motor_jerk_max_rad_s3,
            torque_max_nm=self.limits.motor_torque_max_nm,
            stopping_deceleration_rad_s2=self.limits.stopping_deceleration_rad_s2,
            reaction_time_s=self.reaction_time_s,
        )

    @property
    def reaction_time_s(self) -> float:
        """Return how long the joint may go on before anything brakes it, in seconds."""
        if self.job is None:
            return self.supervision.reaction_time_s
        silence_s = self.job.alive_timeout_s + self.job.timeout_s
        return max(silence_s, self.supervision.sample_age_max_s)

    @property
    def torque_model(self) -> TorqueModel | None:
        """Return the rough torque model of the dry run, where the cell gives one."""
        if self.expected is None:
            return None
        return TorqueModel(
            inertia_kg_m2=self.expected.inertia_kg_m2,
            coulomb_nm=self.expected.coulomb_nm,
            viscous_nm_s_per_rad=self.expected.viscous_nm_s_per_rad,
            gravity_nm=self.expected.gravity_peak_nm,
        )

    @model_validator(mode="after")
    def _someone_answers_for_it(self) -> Self:
        if self.commissioned and not self.commissioned_by.strip():
            raise ValueError("commissioned = true needs commissioned_by: who, and when")
        return self

    @model_validator(mode="after")
    def _one_driver_one_temperature(self) -> Self:
        if (self.drive_ is None) == (self.job is None):
            raise ValueError("an axis needs either [axis.drive] or [axis.job]")
        if self.job is not None and self.temperature is not None:
            raise ValueError("with [axis.job] the temperature comes from the controller")
        by_drive = self.drive_ is not None and self.drive_.gearbox_temperature is not None
        if by_drive and self.temperature is not None:
            raise ValueError(
                "the gearbox temperature comes from drive.gearbox_temperature or from "
                "[axis.temperature], not from both"
            )
        return self


def claimed_beside(axis: Axis, others: Sequence[Axis], release: Release | None) -> tuple[str, ...]:
    """Return what of an axis takes a node id that a device beside it has, in words; empty is well.

    Its own heartbeat under another device's id would pass for that device's; a probe or a contact
    where another axis has its drive would be asked in its place. A probe may serve several axes.
    """
    drives = {a.drive_.node_id: f"the drive of axis {a.number}" for a in others if a.drive_}
    beside = [
        (a.temperature.node_id, f"the temperature of axis {a.number}")
        for a in (axis, *others)
        if isinstance(a.temperature, Cia404Temperature)
    ]
    if isinstance(release, ContactRelease):
        beside.append((release.node_id, "the release"))
    found = [f"{what} is node {n}, and so is {drives[n]}" for n, what in beside if n in drives]
    agent, devices = axis.supervision.agent_node_id, {**dict(beside), **drives}
    if axis.drive_ is not None and agent in devices:
        found.append(f"agent_node_id is {agent}, and so is {devices[agent]}")
    return tuple(found)
