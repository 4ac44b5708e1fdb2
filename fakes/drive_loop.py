"""The drive's 1 kHz task: from objects and state to set-points of the plant, limits included."""

from __future__ import annotations

import math

from fakes.drive_modes import Follower, Mode, falling_ramp, follower
from fakes.object_dictionary import ObjectDictionary
from fakes.plant import Plant
from fakes.state_machine import Motion, State, StateMachine

AT_REST_RAD_S = 1.0
# How far the motor may run on behind its reference: with speed (filter and current loop), and at
# any speed (the integrator unwinds the friction torque).
LIMIT_LEAD_S, LIMIT_MARGIN_RAD = 0.005, 0.4
INSTANT_RAD_S2 = 1e6

OBJECTS = (0x6072, 0x6076, 0x607F, 0x6083, 0x6084, 0x6085, 0x60FF)
GEAR_RATIO, FEED_CONSTANT = 0x6091, 0x6092
PAIRS = (0x607D, GEAR_RATIO, FEED_CONSTANT)


class Runaway:
    """A loop that has lost its set-point: where it drives to, and whether it can be braked."""

    __slots__ = ("obeys_ramps", "velocity_rad_s")

    def __init__(self, velocity_rad_s: float, *, obeys_ramps: bool) -> None:
        self.velocity_rad_s = velocity_rad_s
        self.obeys_ramps = obeys_ramps


class DriveLoop:
    """Steers the plant by the object dictionary's numbers and the state machine's motion.

    Parameters
    ----------
    plant : Plant
        What moves.
    dictionary : ObjectDictionary
        Target, ramps and limits, in user units and per mille as on the bus; and what these units
        are: by feed constant and gear ratio, as CiA 402 has it, encoder counts from the factory.
    machine : StateMachine
        Says what to do, and is told of standstill.
    """

    def __init__(self, plant: Plant, dictionary: ObjectDictionary, machine: StateMachine) -> None:
        self.plant = plant
        self._od = dictionary
        self._machine = machine
        self._block = max(1, round(0.001 / plant.servo.step_s))
        self._done = 0
        self._blocked = 0  # direction in which a software limit holds the joint: -1, 0, 1
        self._clamped = False
        self.runaway: Runaway | None = None
        self.braking_share = 1.0  # of what the ramps ask for
        self.mode = int(Mode.PROFILE_VELOCITY)
        self._follower: Follower | None = None
        self._follows = False
        for index in OBJECTS:
            dictionary.on_write(index, 0, self.refresh)
        for index in PAIRS:
            for subindex in (1, 2):
                dictionary.on_write(index, subindex, self.refresh)
        self.refresh()

    @property
    def internal_limit_active(self) -> bool:
        """Return whether a limit of the drive overrides the target velocity."""
        return self._blocked != 0 or self._clamped

    def set_mode(self, mode: int) -> None:
        """Take a mode of operation over (0x6060); from standstill, as drives want it."""
        self.mode = mode
        self._follower = follower(mode, self._od, self.plant, 1.0 / self.units_per_rad)
        self._follows = False

    def command(self, controlword: int) -> None:
        """Hear the controlword bits that belong to the mode."""
        if self._follower is not None:
            self._follower.command(controlword)

    def synced(self) -> None:
        """Hear that a SYNC's set-points have been taken over."""
        if self._follower is not None and self._follows:
            self._follower.synced()

    @property
    def mode_word(self) -> int | None:
        """Return the mode's own bits 10 and 12 of the statusword; None in profile velocity."""
        if self._follower is None:
            return None
        return self._follower.word if self._follows else 0

    @property
    def target_reached(self) -> bool:
        """Return whether the speed is what is asked for."""
        plant = self.plant
        return abs(plant.velocity_measured_rad_s - plant.target_rad_s) < AT_REST_RAD_S

    @property
    def is_at_rest(self) -> bool:
        """Return whether the profile has ended and the motor stands."""
        plant = self.plant
        stands = abs(plant.velocity_measured_rad_s) < AT_REST_RAD_S
        return stands and (not plant.powered or plant.reference_rad_s == 0.0)

    def refresh(self, _value: int = 0) -> None:
        """Take the objects' numbers over, in SI units."""
        number = self._od.number
        ratio = number(GEAR_RATIO, 2) / number(GEAR_RATIO, 1)
        per_rev = ratio * number(FEED_CONSTANT, 1) / number(FEED_CONSTANT, 2)
        self.units_per_count = per_rev / self.plant.servo.encoder_counts_per_rev
        self.units_per_rad = per_rev / (2.0 * math.pi)
        per_count = 1.0 / self.units_per_rad
        if self._follower is not None:
            self._follower.per_count = per_count
        fastest = number(0x607F) * per_count
        wanted = number(0x60FF) * per_count
        self._target = min(max(wanted, -fastest), fastest)
        self._too_fast = abs(wanted) > fastest
        self._accelerate = number(0x6083) * per_count
        self._decelerate = number(falling_ramp(self._od)) * per_count
        self._quick = number(0x6085) * per_count
        self.plant.torque_limit_nm = number(0x6072) * number(0x6076) * 1e-6
        low, high = number(0x607D, 1), number(0x607D, 2)
        self._has_limits = low < high
        self._low, self._high = low * per_count, high * per_count

    def advance(self, steps: int) -> None:
        """Run the plant for `steps` integration steps, steering once every millisecond.

        However a caller cuts its time: frames come in the middle of a millisecond, too.
        """
        plant, machine = self.plant, self._machine
        while steps > 0:
            part = min(steps, self._block - self._done % self._block)
            if self._done % self._block == 0:
                self._steer(machine.motion)
            plant.advance(part)
            self._done += part
            steps -= part
            if machine.state is not State.SWITCH_ON_DISABLED and self.is_at_rest:
                machine.at_rest()

    def _steer(self, motion: Motion) -> None:
        plant = self.plant
        if motion is not Motion.FOLLOW:
            self._follows = False
        if motion is Motion.NO_TORQUE:
            if plant.powered:
                plant.power_off()
            plant.target_rad_s = 0.0
            self._blocked, self._clamped = 0, False
            return
        if not plant.powered:
            plant.power_on()
        runaway = self.runaway
        if runaway is not None and (motion is Motion.FOLLOW or not runaway.obeys_ramps):
            plant.target_rad_s = runaway.velocity_rad_s
            plant.rise_rad_s2 = plant.fall_rad_s2 = self._quick
        elif motion is Motion.FOLLOW and self._follower is not None:
            self._follow(self._follower)
        elif motion is Motion.FOLLOW and self.mode == Mode.PROFILE_VELOCITY:
            plant.rise_rad_s2, plant.fall_rad_s2 = self._accelerate, self._decelerate
            self._clamped = self._too_fast
            plant.target_rad_s = self._limited(self._target) if self._has_limits else self._target
            if not self._has_limits:
                self._blocked = 0
        else:
            plant.target_rad_s = 0.0
            asked = {Motion.PROFILE_RAMP: self._decelerate, Motion.QUICK_RAMP: self._quick}
            plant.fall_rad_s2 = self.braking_share * asked.get(motion, INSTANT_RAD_S2)

    def _follow(self, mode: Follower) -> None:
        """Let the mode decide the velocity loop's target."""
        plant = self.plant
        if not self._follows:
            self._follows = True
            mode.restart()
        mode.tick()
        self._blocked, self._clamped = 0, mode.limited
        plant.rise_rad_s2 = plant.fall_rad_s2 = INSTANT_RAD_S2
        plant.target_rad_s = mode.velocity_rad_s

    def _limited(self, target: float) -> float:
        """Brake in time to stop in front of a software limit, and stay until asked to go back."""
        plant = self.plant
        velocity = plant.reference_rad_s
        way = velocity * velocity / (2.0 * self._decelerate) + abs(velocity) * LIMIT_LEAD_S
        way += LIMIT_MARGIN_RAD
        position = plant.motor_position_rad
        heading = velocity if velocity != 0.0 else target
        if self._blocked * target <= 0.0:
            self._blocked = 0
        if heading > 0.0 and position + way >= self._high:
            self._blocked = 1
        elif heading < 0.0 and position - way <= self._low:
            self._blocked = -1
        return 0.0 if self._blocked * target > 0.0 else target
