"""How the simulated gearbox warms and cools, and what its sensor says of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fakes.checks import require_finite, require_positive

NO_SENSOR_DECIDEGC = -32768


@dataclass(frozen=True)
class ThermalParameters:
    """One lump of steel and oil, cooled by the air around it.

    Newton's law of cooling with a heat source:
    ``C dT/dt = P_friction - r C (T - T_ambient)``.

    Parameters
    ----------
    heat_capacity_j_per_k : float
        C of gearbox and oil.
    cooling_rate_per_s : float
        r; 6.2e-5 1/s is the mean that the seed thesis found for three oils (appendix A.1).
    sensor_lag_s : float
        Time constant between oil and sensor.
    ambient_degc, initial_degc : float
        The air, and the gearbox at the start.
    has_sensor : bool
        Without one the drive reports the sentinel -32768.
    """

    heat_capacity_j_per_k: float = 30_000.0
    cooling_rate_per_s: float = 6.2e-5
    sensor_lag_s: float = 20.0
    ambient_degc: float = 25.0
    initial_degc: float = 25.0
    has_sensor: bool = True

    def __post_init__(self) -> None:
        require_finite(self)
        require_positive(self, "heat_capacity_j_per_k", "cooling_rate_per_s", "sensor_lag_s")


class Gearbox:
    """The gearbox's temperature and its sensor's, stepped exactly for constant power."""

    __slots__ = ("_p", "sensor_degc", "temperature_degc")

    def __init__(self, parameters: ThermalParameters) -> None:
        self._p = parameters
        self.temperature_degc = parameters.initial_degc
        self.sensor_degc = parameters.initial_degc

    def step(self, friction_energy_j: float, dt_s: float) -> None:
        """Take in the friction's energy of the last `dt_s` and let the air take its share.

        The exact solution for constant power within the step, so that one long step equals
        many short ones.
        """
        p = self._p
        if dt_s <= 0.0:
            return
        power_w = friction_energy_j / dt_s
        settled = p.ambient_degc + power_w / (p.cooling_rate_per_s * p.heat_capacity_j_per_k)
        kept = math.exp(-p.cooling_rate_per_s * dt_s)
        self.temperature_degc = settled + (self.temperature_degc - settled) * kept
        # The oil moves 10^4 times slower than the sensor, so it is held within a step.
        self.sensor_degc += (self.temperature_degc - self.sensor_degc) * -math.expm1(
            -dt_s / p.sensor_lag_s
        )

    @property
    def sensor_decidegc(self) -> int:
        """Return what the drive's object holds: 0.1 degC steps, or the sentinel."""
        return round(self.sensor_degc * 10.0) if self._p.has_sensor else NO_SENSOR_DECIDEGC
