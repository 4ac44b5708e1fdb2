"""A drive's integers to SI on the motor side, and back. Explicit: nothing is guessed.

Most drive files carry neither gear nor encoder objects completely, and the rated torque that
scales 0x6077 is absent or 0 in most, so all of it is configuration, kept with every recording.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

from drivers.cia402.objects import DriveObject

VelocityUnit = Literal["counts_per_s", "rpm", "milli_rpm"]

_INT16 = range(-(2**15), 2**15)
_INT32 = range(-(2**31), 2**31)
_UINT32 = range(2**32)


@dataclass(frozen=True)
class Scaling:
    """How to read and write one drive's numbers.

    Parameters
    ----------
    encoder_counts_per_motor_rev : float
        Counts of 0x6064 in one turn of the motor, quadrature and drive gearing included.
    rated_torque_nm : float
        What 1000 per mille of 0x6077 mean, in N m on the motor.
    velocity_unit : str
        Unit of 0x606C and 0x60FF.
    acceleration_unit : str or None
        Unit, per second, of 0x6083, 0x6084, 0x6085; None: that of velocity.
    direction : int
        +1 or -1: the sign of the agent's motion in the drive's counts.
    zero_position_counts : int
        What 0x6064 reads where the agent's motor angle is 0.
    """

    encoder_counts_per_motor_rev: float
    rated_torque_nm: float
    velocity_unit: VelocityUnit = "counts_per_s"
    acceleration_unit: VelocityUnit | None = None
    direction: int = 1
    zero_position_counts: int = 0

    rad_per_count: float = field(init=False, repr=False)
    rad_s_per_unit: float = field(init=False, repr=False)
    rad_s2_per_unit: float = field(init=False, repr=False)
    nm_per_mille: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("encoder_counts_per_motor_rev", "rated_torque_nm"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} must be positive and finite, got {value}")
        if self.direction not in (1, -1):
            raise ValueError(f"direction must be 1 or -1, got {self.direction}")
        for unit in (self.velocity_unit, self.acceleration_unit):
            if unit is not None and unit not in get_args(VelocityUnit):
                raise ValueError(f"unit must be one of {get_args(VelocityUnit)}, got {unit!r}")
        velocity = self._rad_per_unit(self.velocity_unit)
        acceleration = self._rad_per_unit(self.acceleration_unit or self.velocity_unit)
        # Frozen, yet computed once: these four are read a thousand times a second.
        derived = {
            "rad_per_count": self.direction * math.tau / self.encoder_counts_per_motor_rev,
            "rad_s_per_unit": self.direction * velocity,
            "rad_s2_per_unit": acceleration,
            "nm_per_mille": self.direction * self.rated_torque_nm / 1000.0,
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    def position_rad(self, counts: int) -> float:
        """Return the motor angle in rad of a 0x6064 value."""
        return (counts - self.zero_position_counts) * self.rad_per_count

    def position_counts(self, position_rad: float) -> int:
        """Return the 0x6064 value of a motor angle in rad."""
        counts = round(position_rad / self.rad_per_count) + self.zero_position_counts
        return _within(counts, _INT32, f"position {position_rad} rad")

    def velocity_rad_s(self, units: int) -> float:
        """Return the motor velocity in rad/s of a 0x606C value."""
        return units * self.rad_s_per_unit

    def velocity_units(self, velocity_rad_s: float) -> int:
        """Return the 0x60FF value of a motor velocity in rad/s; NaN and infinity are refused."""
        if not math.isfinite(velocity_rad_s):
            raise ValueError(f"velocity must be finite, got {velocity_rad_s} rad/s")
        units = round(velocity_rad_s / self.rad_s_per_unit)
        return _within(units, _INT32, f"velocity {velocity_rad_s} rad/s")

    def rpm(self, velocity_rad_s: float) -> int:
        """Return the 0x6042 value of a motor velocity in rad/s: whole rpm in 16 bits."""
        if not math.isfinite(velocity_rad_s):
            raise ValueError(f"velocity must be finite, got {velocity_rad_s} rad/s")
        rpm = round(self.direction * velocity_rad_s * 60.0 / math.tau)
        return _within(rpm, _INT16, f"velocity {velocity_rad_s} rad/s")

    def acceleration_units(self, acceleration_rad_s2: float) -> int:
        """Return the 0x6083 value of an acceleration in rad/s^2, at least one unit."""
        units = round(acceleration_rad_s2 / self.rad_s2_per_unit)
        if units < 1:
            raise ValueError(
                f"acceleration {acceleration_rad_s2} rad/s^2 is less than one unit of the drive"
            )
        return _within(units, _UINT32, f"acceleration {acceleration_rad_s2} rad/s^2")

    def torque_nm(self, per_mille: int) -> float:
        """Return the motor torque in N m of a 0x6077 value."""
        return per_mille * self.nm_per_mille

    def _rad_per_unit(self, unit: VelocityUnit) -> float:
        """Return rad/s in one unit of velocity."""
        if unit == "counts_per_s":
            return math.tau / self.encoder_counts_per_motor_rev
        return math.tau / 60.0 * (1e-3 if unit == "milli_rpm" else 1.0)


@dataclass(frozen=True)
class TemperatureSource:
    """Where a drive reports a temperature, and how to read it.

    Parameters
    ----------
    index, subindex : int
        The vendor's object; it must be mappable into a TPDO.
    kind : str
        ``i16``, ``u16``, ``i8``, ``u8``, ``i32``, ``u32`` or ``f32``.
    scale_degc : float
        Degrees Celsius in one unit.
    offset_degc : float
        Degrees Celsius at raw 0.
    sentinels : tuple of int
        Raw values that mean "no sensor".
    """

    index: int
    subindex: int
    kind: str = "i16"
    scale_degc: float = 0.1
    offset_degc: float = 0.0
    sentinels: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scale_degc) and self.scale_degc != 0.0):
            raise ValueError(f"scale_degc must be finite and not 0, got {self.scale_degc}")
        if not math.isfinite(self.offset_degc):
            raise ValueError(f"offset_degc must be finite, got {self.offset_degc}")
        _ = self.mapped  # refuses an index or a type that does not exist

    @property
    def mapped(self) -> DriveObject:
        """Return the vendor's object as it is mapped."""
        return DriveObject(self.index, self.subindex, self.kind, "temperature")

    def degc(self, raw: float) -> float:
        """Return degrees Celsius, NaN for a sentinel."""
        if raw in self.sentinels:
            return math.nan
        return raw * self.scale_degc + self.offset_degc

    def why_none(self, raw: float) -> str:
        """Return why a raw value is no temperature; empty where it is one."""
        if math.isfinite(self.degc(raw)):
            return ""
        return f"the drive has no value, {raw} stands in 0x{self.index:04X}:{self.subindex:02X}"


def _within(units: int, allowed: range, what: str) -> int:
    """Return `units`, refusing what the drive's integer cannot hold."""
    if units not in allowed:
        raise ValueError(f"{what} is {units} in the drive's units, beyond its integer")
    return units
