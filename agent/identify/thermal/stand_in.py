"""A motor's temperature in the gearbox's place, where no gearbox temperature was recorded."""

from __future__ import annotations

from collections.abc import Mapping

from agent.identify.result import Floats

GEARBOX, MOTOR = "gearbox_temperature_degc", "motor_temperature_degc"


def lacks_gearbox_temperature(columns: Mapping[str, Floats]) -> bool:
    """Return whether only the motor's temperature is known."""
    return GEARBOX not in columns and MOTOR in columns


def with_stand_in(columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the columns with the motor's temperature as the gearbox's, where that is missing.

    The two are one casting in an actuator, and in a robot they warm up together: what friction does
    with temperature shows, at another temperature than the oil's.
    """
    if not lacks_gearbox_temperature(columns):
        return dict(columns)
    return {**columns, GEARBOX: columns[MOTOR]}
