"""Modes of operation of the fake beside profile velocity: what each asks of the velocity loop.

Everything in radians on the motor; `DriveLoop` calls `tick` once a millisecond while the drive
follows, and `restart` when it begins to.
"""

from __future__ import annotations

import enum
import math

from fakes.object_dictionary import ObjectDictionary
from fakes.plant import Plant

STEP_S = 0.001
POSITION_GAIN_PER_S = 10.0
POSITION_WINDOW_RAD = 0.05
WINDOW_SPEED_RAD_S = 1.0
RPM_RAD_S = 2.0 * math.pi / 60.0
RAMP_BITS = 0x70  # vl: ramp enabled, unlocked, taken from the target
BIT_4, BIT_12 = 0x0010, 0x1000


class Mode(enum.IntEnum):
    """Modes that the fake can be set to (0x6060)."""

    NONE = 0
    PROFILE_POSITION = 1
    VELOCITY = 2
    PROFILE_VELOCITY = 3
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9


def offered(supported_modes: int) -> frozenset[int]:
    """Return the modes that a value of 0x6502 means, as far as the fake can do them."""
    return frozenset(m for m in Mode if m and supported_modes >> (m - 1) & 1) | {0}


def falling_ramp(dictionary: ObjectDictionary) -> int:
    """Return which object brakes: 0x6084, or 0x6083 in a drive without it."""
    return 0x6084 if dictionary.shows(0x6084) else 0x6083


class Follower:
    """What a mode wants of the velocity loop now.

    Attributes
    ----------
    velocity_rad_s : float
        The velocity loop's target.
    limited : bool
        Whether a software limit has cut the target.
    word : int
        The mode's own bits of the statusword: 10 (target reached) and 12.
    per_count : float
        Radians in one user unit of position; `DriveLoop` keeps it.
    """

    def __init__(self, dictionary: ObjectDictionary, plant: Plant) -> None:
        self.od = dictionary
        self.plant = plant
        self.per_count = 0.0
        self.velocity_rad_s = 0.0
        self.limited = False
        self.word = 0

    def restart(self) -> None:
        """Begin to follow from where the joint stands."""
        self.velocity_rad_s, self.limited, self.word = 0.0, False, 0

    def command(self, controlword: int) -> None:
        """Hear a controlword."""

    def synced(self) -> None:
        """Hear that the set-points of a SYNC have been taken over."""

    def tick(self) -> None:
        """Decide for the next millisecond."""
        raise NotImplementedError

    def _within(self, wanted_rad: float) -> float:
        """Return a position inside the software limits, where there are any."""
        low, high = self.od.number(0x607D, 1), self.od.number(0x607D, 2)
        inside = wanted_rad
        if low < high:
            inside = min(max(wanted_rad, low * self.per_count), high * self.per_count)
        self.limited = inside != wanted_rad
        return inside


class VelocityRamp(Follower):
    """vl: rpm in 0x6042 within 0x6046, ramps 0x6048 and 0x6049, released by controlword bits."""

    def __init__(self, dictionary: ObjectDictionary, plant: Plant) -> None:
        super().__init__(dictionary, plant)
        self._released = False

    def command(self, controlword: int) -> None:
        """Hear a controlword."""
        self._released = controlword & RAMP_BITS == RAMP_BITS

    def tick(self) -> None:
        """Decide for the next millisecond."""
        number = self.od.number
        target = 0.0
        if self._released:
            rpm = number(0x6042)
            amount = min(max(abs(rpm), number(0x6046, 1)), number(0x6046, 2))
            target = math.copysign(amount if rpm else 0.0, rpm) * RPM_RAD_S
        faster = abs(target) > abs(self.velocity_rad_s)
        index = 0x6048 if faster else 0x6049
        seconds = max(number(index, 2), 1)
        step = number(index, 1) * RPM_RAD_S / seconds * STEP_S
        change = min(max(target - self.velocity_rad_s, -step), step)
        self.velocity_rad_s += change
        self.od.set(0x6043, 0, round(self.velocity_rad_s / RPM_RAD_S))


class VelocityStream(Follower):
    """csv: 0x60FF is followed at once; the ramp is the master's business."""

    def tick(self) -> None:
        """Decide for the next millisecond."""
        fastest = self.od.number(0x607F)
        wanted = self.od.number(0x60FF)
        self.velocity_rad_s = min(max(wanted, -fastest), fastest) * self.per_count
        self.limited = abs(wanted) > fastest
        self.word = BIT_12


class PositionStream(Follower):
    """csp and ip: a position each SYNC; between two it interpolates, after the last it goes on.

    Going on with the last speed is the worst that real drives do when their master falls silent.

    Parameters
    ----------
    dictionary, plant
        See `Follower`.
    index, subindex : int
        Where the positions come: 0x607A or 0x60C1:1.
    needs_bit_4 : bool
        Whether controlword bit 4 releases the interpolation (ip).
    """

    def __init__(
        self,
        dictionary: ObjectDictionary,
        plant: Plant,
        index: int,
        subindex: int,
        *,
        needs_bit_4: bool,
    ) -> None:
        super().__init__(dictionary, plant)
        self._place = index, subindex
        self._needs_bit_4 = needs_bit_4
        self._released = not needs_bit_4
        self._last_rad = self._reference_rad = self._slope_rad_s = 0.0

    def restart(self) -> None:
        """Begin to follow from where the joint stands."""
        super().restart()
        self._last_rad = self._reference_rad = self.plant.motor_position_rad
        self._slope_rad_s = 0.0

    def command(self, controlword: int) -> None:
        """Hear a controlword."""
        if self._needs_bit_4:
            self._released = bool(controlword & BIT_4)

    def synced(self) -> None:
        """Hear that the set-points of a SYNC have been taken over."""
        if not self._released:
            return
        wanted = self._within(self.od.number(*self._place) * self.per_count)
        period_s = self.od.number(0x60C2, 1) * 10.0 ** self.od.number(0x60C2, 2)
        self._reference_rad = self._last_rad
        self._slope_rad_s = (wanted - self._last_rad) / period_s
        self._last_rad = wanted

    def tick(self) -> None:
        """Decide for the next millisecond."""
        self._reference_rad += self._slope_rad_s * STEP_S
        error = self._reference_rad - self.plant.motor_position_rad
        self.velocity_rad_s = self._slope_rad_s + POSITION_GAIN_PER_S * error
        self.word = BIT_12 if self._released else 0


class PositionProfile(Follower):
    """pp: one trapezoid a set-point, offered by controlword bit 4, acknowledged by bit 12."""

    def __init__(self, dictionary: ObjectDictionary, plant: Plant) -> None:
        super().__init__(dictionary, plant)
        self._bit_4 = False
        self._acknowledged = False
        self._moving = False
        self._target_rad = self._reference_rad = self._speed_rad_s = 0.0
        self._cruise_rad_s = 0.0

    def restart(self) -> None:
        """Begin to follow from where the joint stands."""
        super().restart()
        self._target_rad = self._reference_rad = self.plant.motor_position_rad
        self._speed_rad_s = 0.0
        self._moving = self._acknowledged = False

    def command(self, controlword: int) -> None:
        """Hear a controlword."""
        bit = bool(controlword & BIT_4)
        if bit and not self._bit_4:
            self._target_rad = self._within(self.od.number(0x607A) * self.per_count)
            self._cruise_rad_s = self.od.number(0x6081) * self.per_count
            self._moving = self._acknowledged = True
        elif not bit:
            self._acknowledged = False
        self._bit_4 = bit

    def tick(self) -> None:
        """Decide for the next millisecond."""
        left = self._target_rad - self._reference_rad
        if self._moving:
            self._advance(left)
        error = self._reference_rad - self.plant.motor_position_rad
        self.velocity_rad_s = self._speed_rad_s + POSITION_GAIN_PER_S * error
        close = abs(self._target_rad - self.plant.motor_position_rad) < POSITION_WINDOW_RAD
        slow = abs(self.plant.velocity_measured_rad_s) < WINDOW_SPEED_RAD_S
        reached = close and slow and not self._moving
        self.word = (0x0400 if reached else 0) | (BIT_12 if self._acknowledged else 0)

    def _advance(self, left_rad: float) -> None:
        """Take the profile one millisecond on."""
        rise = self.od.number(0x6083) * self.per_count * STEP_S
        fall = self.od.number(falling_ramp(self.od)) * self.per_count
        # Half a step of travel is kept back, so that the ramp ends at the target, not beyond it.
        room = max(abs(left_rad) - 0.5 * abs(self._speed_rad_s) * STEP_S, 0.0)
        allowed = min(self._cruise_rad_s, math.sqrt(2.0 * fall * room))
        wanted = math.copysign(allowed, left_rad)
        step = rise if abs(wanted) > abs(self._speed_rad_s) else math.inf
        self._speed_rad_s += min(max(wanted - self._speed_rad_s, -step), step)
        way = self._speed_rad_s * STEP_S
        if abs(left_rad) <= abs(way) or abs(left_rad) < self.per_count:
            self._reference_rad, self._speed_rad_s, self._moving = self._target_rad, 0.0, False
        else:
            self._reference_rad += way


def follower(
    mode: int, dictionary: ObjectDictionary, plant: Plant, per_count: float
) -> Follower | None:
    """Return what follows in a mode; None for profile velocity, which `DriveLoop` does itself."""
    found = _follower(mode, dictionary, plant)
    if found is not None:
        found.per_count = per_count
    return found


def _follower(mode: int, dictionary: ObjectDictionary, plant: Plant) -> Follower | None:
    match mode:
        case Mode.PROFILE_POSITION:
            return PositionProfile(dictionary, plant)
        case Mode.VELOCITY:
            return VelocityRamp(dictionary, plant)
        case Mode.CYCLIC_VELOCITY:
            return VelocityStream(dictionary, plant)
        case Mode.CYCLIC_POSITION:
            return PositionStream(dictionary, plant, 0x607A, 0, needs_bit_4=False)
        case Mode.INTERPOLATED_POSITION:
            return PositionStream(dictionary, plant, 0x60C1, 1, needs_bit_4=True)
    return None
