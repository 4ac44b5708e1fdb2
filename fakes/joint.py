"""The simulated joint: motor and arm, joined by a spring, with gravity on the arm."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from fakes.checks import require_finite, require_not_negative, require_positive
from fakes.friction import FrictionParameters
from fakes.imperfections import Imperfections


@dataclass(frozen=True)
class JointParameters:
    """Two masses, a spring with damper between them, friction on the motor's side.

    Everything is motor side: the arm's inertia, its spring and its gravity are divided by the
    gear ratio as torques and by its square as inertias. The defaults resemble axis 1 of the
    seed thesis' robot: total inertia 0.0184 kg m2, gear 224.

    Parameters
    ----------
    motor_inertia_kg_m2, arm_inertia_kg_m2 : float
        The two masses.
    spring_nm_per_rad, damper_nm_s_per_rad : float
        Between them; motor torque per motor radian of twist.
    gravity_sin_nm, gravity_cos_nm : float
        Torque that holds the arm: ``gravity_sin sin(q_arm) + gravity_cos cos(q_arm)``.
    gear_ratio : float
        Motor turns per arm turn.
    brake_nm : float
        Holding brake, closed whenever the power stage is off; 0 means that the joint coasts.
    initial_arm_position_rad : float
        Where the arm hangs when the drive is switched on.
    friction : FrictionParameters
        What the motor has to overcome.
    imperfections : Imperfections
        What a plain simulation of the joint lacks; none by default.
    """

    motor_inertia_kg_m2: float = 0.0084
    arm_inertia_kg_m2: float = 0.0100
    spring_nm_per_rad: float = 25.3
    damper_nm_s_per_rad: float = 0.04
    gravity_sin_nm: float = 0.0
    gravity_cos_nm: float = 0.0
    gear_ratio: float = 224.0
    brake_nm: float = 0.0
    initial_arm_position_rad: float = 0.0
    friction: FrictionParameters = field(default_factory=FrictionParameters)
    imperfections: Imperfections = field(default_factory=Imperfections)

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(
            self, "motor_inertia_kg_m2", "arm_inertia_kg_m2", "spring_nm_per_rad", "gear_ratio"
        )
        require_not_negative(self, "damper_nm_s_per_rad", "brake_nm")

    @property
    def inertia_kg_m2(self) -> float:
        """Return the total inertia, motor side."""
        return self.motor_inertia_kg_m2 + self.arm_inertia_kg_m2

    @property
    def locked_frequency_hz(self) -> float:
        """Return the undamped frequency of the arm when the motor stands still."""
        return math.sqrt(self.spring_nm_per_rad / self.arm_inertia_kg_m2) / (2.0 * math.pi)

    @property
    def resonance_frequency_hz(self) -> float:
        """Return the undamped frequency of motor against arm when the motor is free."""
        reduced = self.motor_inertia_kg_m2 * self.arm_inertia_kg_m2 / self.inertia_kg_m2
        return math.sqrt(self.spring_nm_per_rad / reduced) / (2.0 * math.pi)

    def gravity_nm(self, arm_position_rad: float) -> float:
        """Return the motor torque that balances gravity at an arm angle."""
        return self.gravity_sin_nm * math.sin(arm_position_rad) + self.gravity_cos_nm * math.cos(
            arm_position_rad
        )

    def load_nm(self, arm_position_rad: float) -> float:
        """Return the motor torque that balances gravity and cables at an arm angle."""
        more = self.imperfections
        cable = more.cable_nm_per_arm_rad * (arm_position_rad - more.cable_rest_arm_rad)
        return self.gravity_nm(arm_position_rad) + cable

    def require_stable_at(self, dt_s: float) -> None:
        """Refuse a step that the integrator could not follow.

        Semi-implicit Euler keeps an undamped mode of angular frequency w bounded for
        ``w dt < 2``; a tenth of that keeps its frequency right to 0.1 %. The damper is taken
        explicitly and asks for ``d dt (1/Jm + 1/Ja) < 1``. Bristles of presliding friction
        stiffen the motor alone.
        """
        bristles = self.imperfections.bristle_stiffness_nm_per_rad(
            self.friction.coulomb_nm + self.friction.static_extra_nm
        )
        bristle_rad_s = math.sqrt(bristles / self.motor_inertia_kg_m2)
        if bristle_rad_s * dt_s > 0.2:
            raise ValueError(
                f"imperfections.presliding_rad: {self.imperfections.presliding_rad} is too short "
                f"for a step of {dt_s} s (w dt = {bristle_rad_s * dt_s:.3f}, expected up to 0.2)"
            )
        stiff = 2.0 * math.pi * self.resonance_frequency_hz * dt_s
        damped = self.damper_nm_s_per_rad * dt_s
        damped *= 1.0 / self.motor_inertia_kg_m2 + 1.0 / self.arm_inertia_kg_m2
        if stiff > 0.2 or damped > 1.0:
            raise ValueError(
                f"step of {dt_s} s: too long for a resonance of "
                f"{self.resonance_frequency_hz:.1f} Hz and a damper of "
                f"{self.damper_nm_s_per_rad} N m s/rad (w dt = {stiff:.3f}, expected up to 0.2; "
                f"d dt (1/Jm + 1/Ja) = {damped:.3f}, expected up to 1)"
            )
