"""What a simulated joint may have that a plain simulation lacks: described here, off by default.

Written apart from the product's own laws on purpose, so that the two can disagree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from fakes.checks import require_finite, require_not_negative, require_positive

BRISTLES = 4


@dataclass(frozen=True)
class Imperfections:
    """Physics beside two masses, a spring, gravity and symmetric friction; zero is none of it.

    Parameters
    ----------
    coulomb_asymmetry_nm : float
        Dry friction is higher by this forwards, and lower by this backwards.
    load_share : float
        Dry friction grows by this for each newton metre that the gear transmits.
    position_share, position_order_per_arm_rev : float
        Friction of Coulomb and Stribeck is ``1 + share sin(order q_arm)`` times as high.
    bump_nm, bump_arm_rad, bump_width_arm_rad : float
        More dry friction around one arm angle: ``bump exp(-((q_arm - at) / width)^2)``.
    thinning_velocity_rad_s : float
        Speed at which shear has halved the viscous coefficient:
        ``viscous w / (1 + |w| / thinning)``.
    presliding_rad : float
        Motor travel after which friction has built up: `BRISTLES` springs that slip one after
        another (Iwan 1966), so that the way there and back encloses a loop.
    ripple_nm, ripple_order_per_motor_rev, ripple_phase_rad : float
        Torque that the motor loses, ``ripple sin(order q_motor + phase)`` (cogging).
    wobble_rad, wobble_order_per_motor_rev : float
        Transmission error: the gear's input leads by ``wobble sin(order q_motor)``.
    backlash_rad : float
        Clearance of the gear, from flank to flank, as motor angle.
    cable_nm_per_arm_rad, cable_rest_arm_rad : float
        Spring torque of hoses on the arm, motor side, for each radian of arm angle from where
        they hang slack.
    torque_offset_nm : float
        The drive reports this more than there is.
    torque_constant_ratio : float
        Real over reported torque.
    encoder_error_rad, encoder_order_per_motor_rev : float
        The encoder reads ``error sin(order q_motor)`` more than the angle.
    """

    coulomb_asymmetry_nm: float = 0.0
    load_share: float = 0.0
    position_share: float = 0.0
    position_order_per_arm_rev: float = 1.0
    bump_nm: float = 0.0
    bump_arm_rad: float = 0.0
    bump_width_arm_rad: float = 0.05
    thinning_velocity_rad_s: float = 0.0
    presliding_rad: float = 0.0
    ripple_nm: float = 0.0
    ripple_order_per_motor_rev: float = 6.0
    ripple_phase_rad: float = 0.0
    wobble_rad: float = 0.0
    wobble_order_per_motor_rev: float = 2.0
    backlash_rad: float = 0.0
    cable_nm_per_arm_rad: float = 0.0
    cable_rest_arm_rad: float = 0.0
    torque_offset_nm: float = 0.0
    torque_constant_ratio: float = 1.0
    encoder_error_rad: float = 0.0
    encoder_order_per_motor_rev: float = 1.0

    def __post_init__(self) -> None:
        require_finite(self)
        require_not_negative(
            self,
            "load_share",
            "thinning_velocity_rad_s",
            "presliding_rad",
            "backlash_rad",
            "cable_nm_per_arm_rad",
        )
        require_positive(self, "torque_constant_ratio", "bump_width_arm_rad")
        if abs(self.position_share) > 1.0:
            raise ValueError(f"position_share: expected -1 to 1, got {self.position_share}")
        self._require_gentle("wobble_rad", self.wobble_order_per_motor_rev)
        self._require_gentle("encoder_error_rad", self.encoder_order_per_motor_rev)

    def _require_gentle(self, name: str, order: float) -> None:
        """Refuse a wave that would turn the motion round."""
        amplitude = getattr(self, name)
        if abs(amplitude * order) >= 0.5:
            raise ValueError(
                f"{name}: expected less than 0.5 / order, got {amplitude} at order {order}"
            )

    @property
    def act_in_the_joint(self) -> bool:
        """Return whether anything differs from a joint without them, the cable apart.

        A cable is a load on the arm beside gravity, and costs the integrator nothing.
        """
        plain = Imperfections()
        return any(
            getattr(self, f.name) != getattr(plain, f.name)
            for f in fields(self)
            if not f.name.startswith("cable")
        )

    def bristle_stiffness_nm_per_rad(self, breakaway_nm: float) -> float:
        """Return the stiffness of the joint at rest, before anything slips; 0 without."""
        if self.presliding_rad == 0.0:
            return 0.0
        reaches = (self.presliding_rad * (i + 1) / BRISTLES for i in range(BRISTLES))
        return sum(breakaway_nm / BRISTLES / reach for reach in reaches)


class Reaction:
    """How an imperfect joint answers at one instant; holds the bristles' state.

    Parameters
    ----------
    imperfections : Imperfections
        What there is.
    spring_nm_per_rad, damper_nm_s_per_rad, gear_ratio : float
        The gear.
    motor_position_rad : float
        Where the bristles are at ease.
    """

    __slots__ = ("_anchors_rad", "_damper", "_i", "_per_gear", "_reaches_rad", "_spring")

    def __init__(
        self,
        imperfections: Imperfections,
        *,
        spring_nm_per_rad: float,
        damper_nm_s_per_rad: float,
        gear_ratio: float,
        motor_position_rad: float,
    ) -> None:
        self._i = imperfections
        self._spring, self._damper = spring_nm_per_rad, damper_nm_s_per_rad
        self._per_gear = 1.0 / gear_ratio
        reach = imperfections.presliding_rad
        self._reaches_rad = [reach * (i + 1) / BRISTLES for i in range(BRISTLES)] if reach else []
        self._anchors_rad = [motor_position_rad] * len(self._reaches_rad)

    def angle_read_rad(self, motor_position_rad: float) -> float:
        """Return what the encoder makes of the motor's angle."""
        i = self._i
        return motor_position_rad + i.encoder_error_rad * math.sin(
            i.encoder_order_per_motor_rev * motor_position_rad
        )

    def gear_nm(
        self,
        motor_position_rad: float,
        motor_velocity_rad_s: float,
        arm_position_rad: float,
        arm_velocity_rad_s: float,
    ) -> tuple[float, float]:
        """Return the gear's torque, N m, against the motor and on the arm.

        The wobble changes the ratio for a moment, and with it what of the arm's torque reaches the
        motor, so that the gear neither makes nor eats energy. Within the clearance there is none.
        """
        i = self._i
        phase = i.wobble_order_per_motor_rev * motor_position_rad
        ratio = 1.0 + i.wobble_rad * i.wobble_order_per_motor_rev * math.cos(phase)
        twist = motor_position_rad + i.wobble_rad * math.sin(phase) - arm_position_rad
        half = 0.5 * i.backlash_rad
        if half > 0.0:
            if -half <= twist <= half:
                return 0.0, 0.0
            twist -= math.copysign(half, twist)
        rate = motor_velocity_rad_s * ratio - arm_velocity_rad_s
        on_arm = self._spring * twist + self._damper * rate
        return on_arm * ratio, on_arm

    def drive_nm(self, torque_nm: float, motor_position_rad: float) -> float:
        """Return the torque that is there where the drive reports `torque_nm`."""
        i = self._i
        real = i.torque_constant_ratio * (torque_nm - i.torque_offset_nm)
        phase = i.ripple_order_per_motor_rev * motor_position_rad + i.ripple_phase_rad
        return real - i.ripple_nm * math.sin(phase)

    def dry_nm(
        self, level_nm: float, carried_nm: float, motor_position_rad: float
    ) -> tuple[float, float]:
        """Return dry friction forwards and backwards, N m, of which `level_nm` is the plain law.

        `carried_nm` is what the gear transmits to the arm.
        """
        i = self._i
        angle = motor_position_rad * self._per_gear
        level = level_nm * (
            1.0 + i.position_share * math.sin(i.position_order_per_arm_rev * angle)
        ) + i.load_share * abs(carried_nm)
        if i.bump_nm != 0.0:
            level += i.bump_nm * math.exp(-(((angle - i.bump_arm_rad) / i.bump_width_arm_rad) ** 2))
        return max(level + i.coulomb_asymmetry_nm, 0.0), max(level - i.coulomb_asymmetry_nm, 0.0)

    def viscous_nm_s_per_rad(self, viscous_nm_s_per_rad: float, speed_rad_s: float) -> float:
        """Return the viscous coefficient at a speed."""
        thinning = self._i.thinning_velocity_rad_s
        if thinning == 0.0:
            return viscous_nm_s_per_rad
        return viscous_nm_s_per_rad / (1.0 + speed_rad_s / thinning)

    @property
    def has_bristles(self) -> bool:
        """Return whether dry friction builds up over a travel instead of at once."""
        return bool(self._reaches_rad)

    def bristles_nm(
        self, motor_position_rad: float, forward_nm: float, backward_nm: float
    ) -> float:
        """Return the bristles' torque against the motor, and let slip those at their reach.

        Together they carry `forward_nm` or `backward_nm` once all of them slip.
        """
        total, anchors = 0.0, self._anchors_rad
        for i, reach in enumerate(self._reaches_rad):
            bent = motor_position_rad - anchors[i]
            if bent > reach:
                anchors[i], bent = motor_position_rad - reach, reach
            elif bent < -reach:
                anchors[i], bent = motor_position_rad + reach, -reach
            total += bent / reach * (forward_nm if bent > 0.0 else backward_nm)
        return total / BRISTLES
