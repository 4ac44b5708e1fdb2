"""The drive's live objects: statusword and what is measured, as the bus shows it."""

from __future__ import annotations

import math

import numpy as np

from fakes.breakage import Breakage
from fakes.drive_loop import DriveLoop
from fakes.object_dictionary import ObjectDictionary
from fakes.state_machine import StateMachine
from fakes.thermal import NO_SENSOR_DECIDEGC

VOLTAGE, REMOTE, TARGET_REACHED = 0x0010, 0x0200, 0x0400
INTERNAL_LIMIT, AT_STANDSTILL = 0x0800, 0x1000

STATUSWORD, VELOCITY_DEMAND, TEMPERATURE = 0x604100, 0x606B00, 0x210001
POSITION, VELOCITY, TORQUE, CURRENT = 0x606400, 0x606C00, 0x607700, 0x607800

NOISE_BLOCK = 4096


class LiveValues:
    """Writes statusword, position, velocity, torque and temperature into the dictionary.

    Parameters
    ----------
    dictionary, loop, machine, breakage
        Where the values go, and where they come from.
    seed : int
        Of the noise on the reported torque.
    """

    def __init__(
        self,
        dictionary: ObjectDictionary,
        loop: DriveLoop,
        machine: StateMachine,
        breakage: Breakage,
        seed: int,
    ) -> None:
        self._od = dictionary
        self._loop = loop
        self._machine = machine
        self._breakage = breakage
        self._random = np.random.default_rng(seed)
        self._noise_nm: list[float] = []
        self._measured_at_step = -1

    def publish(self, step: int) -> None:
        """Bring the live objects up to date.

        Parameters
        ----------
        step : int
            Integration steps so far. What is measured is measured once a step, so that two
            readers of one moment see the same noise.
        """
        self._od.values[STATUSWORD] = self._statusword()
        if step != self._measured_at_step:
            self._measured_at_step = step
            self._measure()

    def _measure(self) -> None:
        values, loop = self._od.values, self._loop
        plant, units_per_rad = loop.plant, loop.units_per_rad
        if not self._breakage.position_frozen:
            position = math.floor(plant.counts * loop.units_per_count)
            values[POSITION] = (position + 0x80000000) % 0x100000000 - 0x80000000
        values[VELOCITY] = _clip(plant.velocity_measured_rad_s * units_per_rad, 0x7FFFFFFF)
        demand = plant.reference_rad_s if plant.powered else 0.0
        values[VELOCITY_DEMAND] = _clip(demand * units_per_rad, 0x7FFFFFFF)
        if not self._noise_nm:
            drawn = self._random.standard_normal(NOISE_BLOCK) * plant.servo.torque_noise_nm
            self._noise_nm = drawn.tolist()
        permille_per_nm = 1e6 / self._od.number(0x6076)
        torque = (plant.torque_nm + self._noise_nm.pop()) * permille_per_nm
        # Rated current belongs to rated torque, so both read the same per mille.
        values[TORQUE] = values[CURRENT] = _clip(torque, 0x7FFF)
        lost = self._breakage.sensor_lost
        values[TEMPERATURE] = NO_SENSOR_DECIDEGC if lost else plant.gearbox.sensor_decidegc

    def _statusword(self) -> int:
        word = self._machine.state | VOLTAGE | (0 if self._machine.taken_over else REMOTE)
        loop = self._loop
        if loop.internal_limit_active:
            word |= INTERNAL_LIMIT
        of_mode = loop.mode_word
        if of_mode is not None:
            return word | of_mode
        if loop.is_at_rest:
            word |= AT_STANDSTILL
        if loop.plant.powered and loop.target_reached:
            word |= TARGET_REACHED
        return word


def _clip(value: float, largest: int) -> int:
    """Return the nearest integer that the object can hold."""
    return min(max(round(value), -largest - 1), largest)
