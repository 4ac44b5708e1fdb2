"""Joint and drive loop in one integrator: pure scalars, 4 kHz, many times faster than real time."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fakes.checks import require_finite, require_positive
from fakes.friction import FrictionTruth
from fakes.imperfections import Reaction
from fakes.joint import JointParameters
from fakes.thermal import Gearbox, ThermalParameters

STRIBECK_REACH = 12.0  # multiples of the Stribeck velocity; beyond, its exponential is below 1e-10


@dataclass(frozen=True)
class ServoParameters:
    """The drive's cascaded loop: profile generator, PI velocity loop, current loop.

    Parameters
    ----------
    velocity_gain_nm_s_per_rad : float
        Proportional gain, about the spring's impedance, so that the loop damps the arm.
    integral_time_s : float
        Of the PI controller.
    current_lag_s, velocity_filter_s : float
        First-order lags of the current loop and of the velocity from the encoder.
    encoder_counts_per_rev : int
        Position is only known in these steps.
    torque_noise_nm : float
        Standard deviation of the torque that the drive reports, from sample to sample.
    step_s : float
        Integration step, and the period of the velocity loop.
    """

    velocity_gain_nm_s_per_rad: float = 0.6
    integral_time_s: float = 0.08
    current_lag_s: float = 0.001
    velocity_filter_s: float = 0.002
    encoder_counts_per_rev: int = 65536
    torque_noise_nm: float = 0.02
    step_s: float = 0.00025

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(
            self,
            "velocity_gain_nm_s_per_rad",
            "integral_time_s",
            "current_lag_s",
            "velocity_filter_s",
            "encoder_counts_per_rev",
            "step_s",
        )
        if self.torque_noise_nm < 0.0:
            raise ValueError(f"torque_noise_nm: expected 0 or more, got {self.torque_noise_nm}")


class Plant:
    """Two-mass joint under a velocity drive; `advance` is the only thing that moves it.

    Set-points are plain attributes, read at the start of every `advance`: `powered`,
    `target_rad_s` with its ramps `rise_rad_s2` (away from zero) and `fall_rad_s2` (towards
    zero), `torque_limit_nm`, and `torque_reference_nm`, which opens the velocity loop when it
    is not None. `stuck_brake_nm` is a holding brake that stays closed whatever the drive wants.

    Integration is semi-implicit Euler: velocities first, positions with the new velocities,
    which neither pumps nor drains the spring's energy. Dry friction is the exact solution of
    the implicit step, a soft threshold on the frictionless velocity: the motor sticks exactly
    when the torque is below the breakaway torque, and cannot chatter around zero for any
    step. Viscous friction is implicit too, so in steady motion torque equals friction to the
    last bit.
    """

    __slots__ = (
        "_counts",
        "_friction",
        "_gearbox",
        "_heat_j",
        "_integral_nm",
        "_reaction",
        "_since_thermal_s",
        "arm_position_rad",
        "arm_velocity_rad_s",
        "fall_rad_s2",
        "joint",
        "motor_position_rad",
        "motor_velocity_rad_s",
        "powered",
        "reference_rad_s",
        "rise_rad_s2",
        "servo",
        "stuck_brake_nm",
        "target_rad_s",
        "torque_limit_nm",
        "torque_nm",
        "torque_reference_nm",
        "velocity_measured_rad_s",
    )

    THERMAL_PERIOD_S = 0.1

    def __init__(
        self,
        joint: JointParameters | None = None,
        servo: ServoParameters | None = None,
        thermal: ThermalParameters | None = None,
    ) -> None:
        self.joint = joint or JointParameters()
        self.servo = servo or ServoParameters()
        self.joint.require_stable_at(self.servo.step_s)
        self._gearbox = Gearbox(thermal or ThermalParameters())
        self._friction = self.joint.friction.truth(self._gearbox.temperature_degc)
        self.powered = False
        self.stuck_brake_nm = 0.0
        self.target_rad_s = 0.0
        self.rise_rad_s2 = self.fall_rad_s2 = 200.0
        self.torque_limit_nm = 10.0
        self.torque_reference_nm: float | None = None
        arm = self.joint.initial_arm_position_rad
        self.arm_position_rad = arm * self.joint.gear_ratio  # motor side, like everything here
        # The spring carries the load from the start: the arm hangs at rest, on one flank.
        load = self.joint.load_nm(arm)
        twist = load / self.joint.spring_nm_per_rad
        twist += math.copysign(0.5 * self.joint.imperfections.backlash_rad, load)
        self.motor_position_rad = self.arm_position_rad + twist
        self._reaction = self._reaction_at(self.motor_position_rad)
        self.motor_velocity_rad_s = self.arm_velocity_rad_s = 0.0
        self.reference_rad_s = self.velocity_measured_rad_s = 0.0
        self.torque_nm = self._integral_nm = 0.0
        self._heat_j = self._since_thermal_s = 0.0
        self._counts = math.floor(self.motor_position_rad * self._counts_per_rad)

    def _reaction_at(self, motor_position_rad: float) -> Reaction | None:
        """Return how an imperfect joint answers; None for one that is as simple as it gets."""
        joint = self.joint
        if not joint.imperfections.act_in_the_joint:
            return None
        return Reaction(
            joint.imperfections,
            spring_nm_per_rad=joint.spring_nm_per_rad,
            damper_nm_s_per_rad=joint.damper_nm_s_per_rad,
            gear_ratio=joint.gear_ratio,
            motor_position_rad=motor_position_rad,
        )

    @property
    def _counts_per_rad(self) -> float:
        return self.servo.encoder_counts_per_rev / (2.0 * math.pi)

    @property
    def counts(self) -> int:
        """Return the encoder's reading."""
        return self._counts

    @property
    def gearbox(self) -> Gearbox:
        """Return the gearbox with its temperatures."""
        return self._gearbox

    @property
    def friction(self) -> FrictionTruth:
        """Return the friction law that acts now."""
        return self._friction

    def power_on(self) -> None:
        """Switch the power stage on: the profile starts from the speed that is there."""
        self.powered = True
        self.reference_rad_s = self.velocity_measured_rad_s
        self._integral_nm = 0.0

    def power_off(self) -> None:
        """Take the torque away; the joint coasts, or its brake holds it."""
        self.powered = False
        self._integral_nm = 0.0

    def advance(self, steps: int) -> None:  # noqa: C901 - fused for speed, see the class
        """Integrate `steps` steps of `servo.step_s` with the set-points as they stand.

        One function with local names, though it is long: a step takes 0.6 us, of which each part
        that is called would take a seventh more, and each attribute; every simulated night pays.
        """
        joint, servo, friction = self.joint, self.servo, self._friction
        dt = servo.step_s
        powered, target, torque_reference = (
            self.powered,
            self.target_rad_s,
            self.torque_reference_nm,
        )
        rise, fall = self.rise_rad_s2 * dt, self.fall_rad_s2 * dt
        limit = self.torque_limit_nm
        gain = servo.velocity_gain_nm_s_per_rad
        integral_gain = gain * dt / servo.integral_time_s
        current_share = -math.expm1(-dt / servo.current_lag_s)
        filter_share = -math.expm1(-dt / servo.velocity_filter_s)
        counts_per_rad = self._counts_per_rad
        rad_s_per_count = 1.0 / (counts_per_rad * dt)
        spring, damper = joint.spring_nm_per_rad, joint.damper_nm_s_per_rad
        motor_share = dt / joint.motor_inertia_kg_m2
        arm_share = dt / joint.arm_inertia_kg_m2
        brake_nm = max(self.stuck_brake_nm, 0.0 if powered else joint.brake_nm)
        dry = (friction.coulomb_nm + brake_nm) * motor_share
        extra = friction.static_extra_nm * motor_share
        per_stribeck, exponent = 1.0 / friction.stribeck_velocity_rad_s, friction.exponent
        reach = STRIBECK_REACH * friction.stribeck_velocity_rad_s
        slip = 1.0 / (1.0 + friction.viscous_nm_s_per_rad * motor_share)
        per_gear = 1.0 / joint.gear_ratio
        reaction, viscous = self._reaction, friction.viscous_nm_s_per_rad
        has_bristles = reaction is not None and reaction.has_bristles
        gravity_sin, gravity_cos = joint.gravity_sin_nm, joint.gravity_cos_nm
        cable = joint.imperfections.cable_nm_per_arm_rad
        cable_rest = joint.imperfections.cable_rest_arm_rad
        is_loaded = gravity_sin != 0.0 or gravity_cos != 0.0 or cable != 0.0
        load, sin, cos, exp = 0.0, math.sin, math.cos, math.exp
        reference, measured = self.reference_rad_s, self.velocity_measured_rad_s
        integral, torque = self._integral_nm, self.torque_nm
        motor_position, motor_velocity = self.motor_position_rad, self.motor_velocity_rad_s
        arm_position, arm_velocity = self.arm_position_rad, self.arm_velocity_rad_s
        counts: float = self._counts
        heat, command = 0.0, 0.0

        for _ in range(steps):
            # Encoder, differentiated and filtered as a drive does it.
            before = counts
            angle = motor_position if reaction is None else reaction.angle_read_rad(motor_position)
            counts = angle * counts_per_rad // 1.0
            measured += filter_share * ((counts - before) * rad_s_per_count - measured)
            if powered:
                if torque_reference is None:
                    if reference < target:
                        reference += rise if reference >= 0.0 else fall
                        if reference > target:
                            reference = target
                    elif reference > target:
                        reference -= rise if reference <= 0.0 else fall
                        if reference < target:
                            reference = target
                    error = reference - measured
                    command = gain * error + integral
                else:
                    error = 0.0
                    command = torque_reference
                # Anti-windup: at the limit the integrator only moves back.
                if command > limit:
                    command = limit
                    if error < 0.0:
                        integral += integral_gain * error
                elif command < -limit:
                    command = -limit
                    if error > 0.0:
                        integral += integral_gain * error
                else:
                    integral += integral_gain * error
            torque += current_share * (command - torque)

            speed = motor_velocity if motor_velocity >= 0.0 else -motor_velocity
            hold = dry
            if speed < reach:
                hold += extra * exp(-((speed * per_stribeck) ** exponent))
            if reaction is None:
                twist = spring * (motor_position - arm_position) + damper * (
                    motor_velocity - arm_velocity
                )
                push, back = torque - twist, hold
            else:
                against, twist = reaction.gear_nm(
                    motor_position, motor_velocity, arm_position, arm_velocity
                )
                push = reaction.drive_nm(torque, motor_position) - against
                ahead_nm, back_nm = reaction.dry_nm(hold / motor_share, twist, motor_position)
                if has_bristles:
                    bent = reaction.bristles_nm(motor_position, ahead_nm, back_nm)
                    push -= bent
                    heat += bent * motor_share * motor_velocity
                    hold = back = 0.0
                else:
                    hold, back = ahead_nm * motor_share, back_nm * motor_share
                slip = 1.0 / (1.0 + reaction.viscous_nm_s_per_rad(viscous, speed) * motor_share)
            free = motor_velocity + motor_share * push
            if free > hold:
                motor_velocity = (free - hold) * slip
                heat += (free - motor_velocity) * motor_velocity
            elif free < -back:
                motor_velocity = (free + back) * slip
                heat += (free - motor_velocity) * motor_velocity
            else:
                motor_velocity = 0.0
            if is_loaded:
                angle = arm_position * per_gear
                load = gravity_sin * sin(angle) + gravity_cos * cos(angle)
                load += cable * (angle - cable_rest)
            arm_velocity += arm_share * (twist - load)
            motor_position += dt * motor_velocity
            arm_position += dt * arm_velocity

        self.reference_rad_s, self.velocity_measured_rad_s = reference, measured
        self._integral_nm, self.torque_nm = integral, torque
        self.motor_position_rad, self.motor_velocity_rad_s = motor_position, motor_velocity
        self.arm_position_rad, self.arm_velocity_rad_s = arm_position, arm_velocity
        self._counts = int(counts)
        self._warm(heat * joint.motor_inertia_kg_m2, steps * dt)

    def _warm(self, friction_energy_j: float, dt_s: float) -> None:
        """Hand the friction's work to the gearbox, ten times a second."""
        self._heat_j += friction_energy_j
        self._since_thermal_s += dt_s
        if self._since_thermal_s >= self.THERMAL_PERIOD_S:
            self._gearbox.step(self._heat_j, self._since_thermal_s)
            self._friction = self.joint.friction.truth(self._gearbox.temperature_degc)
            self._heat_j = self._since_thermal_s = 0.0
