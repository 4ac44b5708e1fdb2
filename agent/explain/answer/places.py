"""Where a region lies, in the words that begin or end a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from agent.explain.answer.result import Region
from agent.numbers import significant

_AXES: Mapping[str, tuple[str, float, str]] = MappingProxyType(
    {
        "velocity_rad_s": ("at motor speeds", 1.0, "rad/s"),
        "acceleration_rad_s2": ("at accelerations", 1.0, "rad/s²"),
        "arm_position_rad": ("at arm angles", math.degrees(1.0), "degrees"),
        "load_torque_nm": ("under loads", 1.0, "N m"),
        "torque_nm": ("at torques", 1.0, "N m"),
        "gearbox_temperature_degc": ("at gearbox temperatures", 1.0, "°C"),
        "motor_temperature_degc": ("at motor temperatures", 1.0, "°C"),
        "time_s": ("at times", 1.0, "s"),
        "frequency_hz": ("at frequencies", 1.0, "Hz"),
    }
)
_NOTHING = 0.01  # of the fastest speed
_ZERO = 1e-3  # of an axis' other end: at rest, but for noise
_LINE = 1.2  # of the lowest frequency: what is wider is a resonance, which the motion excites
_EVERYWHERE: Mapping[str, str] = MappingProxyType(
    {
        "velocity_rad_s": "at all speeds",
        "acceleration_rad_s2": "while the joint accelerates",
        "load_torque_nm": "under load",
        "recording": "from recording to recording",
    }
)
_FILLS: Mapping[str, str] = MappingProxyType(
    {
        "direction-asymmetry": "velocity_rad_s",
        "torque-offset": "velocity_rad_s",
        "viscous-nonlinear": "velocity_rad_s",
        "load-dependent-friction": "load_torque_nm",
        "measurement-delay": "acceleration_rad_s2",
        "inertia-error": "acceleration_rad_s2",
        "friction-drift": "recording",
    }
)


def place_in_words(region: Region | None, effect: str = "") -> str:
    """Return where a region lies, in lower case: ``below 7.6 rad/s``, ``3 times per motor turn``.

    Parameters
    ----------
    region : Region or None
        None: over the whole cycle.
    effect : str
        One that fills its axis is said to: ``at all speeds``.
    """
    if region is None or region.everywhere:
        return "over the whole cycle"
    name, low, high = region.variable, region.lower, region.upper
    if _FILLS.get(effect) == name:
        return _EVERYWHERE[name]
    if name == "velocity_rad_s" and low < 0.0 < high:
        fastest = max(-low, high)
        if min(-low, high) < _NOTHING * fastest:
            return f"up to {_short(fastest)} rad/s {'forward' if high > -low else 'backward'}"
        return f"below {_short(fastest)} rad/s"
    if name.startswith("order_per_"):
        per = "motor turn" if name.endswith("motor_rev") else "arm turn"
        return f"{_times(0.5 * (low + high))} per {per}"
    if name == "recording":
        first, last = round(low) + 1, round(high) + 1
        return f"in recording {first}" if first == last else f"from recording {first} to {last}"
    if effect == "backlash" and name == "load_torque_nm":
        return "while the load on the gear changes sides"
    if name == "after_reversal_s":
        scale, unit = (1e3, "ms") if high < 1.0 else (1.0, "s")
        return _after_reversal(scale * low, scale * high, unit)
    if name == "after_reversal_rad":
        return _after_reversal(low, high, "rad of the motor")
    if name == "frequency_hz":
        return _at_frequencies(low, high, effect)
    said, scale, unit = _AXES.get(name, (f"at {name}", 1.0, ""))
    low, high = (end if abs(end) > _ZERO * max(-low, high) else 0.0 for end in (low, high))
    if _short(scale * low) == _short(scale * high):
        return f"{said} around {_short(scale * low)} {unit}".rstrip()
    return f"{said} from {_short(scale * low)} to {_short(scale * high)} {unit}".rstrip()


def _at_frequencies(low: float, high: float, effect: str) -> str:
    if effect:
        return f"around the resonance ({_short(low)} to {_short(high)} Hz)"
    if high < _LINE * low:
        return f"at {_short(0.5 * (low + high))} Hz, whatever the joint does"
    return f"between {_short(low)} and {_short(high)} Hz"


def _after_reversal(low: float, high: float, unit: str) -> str:
    if low <= 0.1 * high:
        return f"in the first {_short(high)} {unit} after a start or a reversal"
    return f"from {_short(low)} to {_short(high)} {unit} after a start or a reversal"


def _times(order: float) -> str:
    whole = round(order)
    if whole == 1 and math.isclose(order, 1.0, abs_tol=0.01):
        return "once"
    return f"{whole if math.isclose(order, whole, abs_tol=0.01) else significant(order, 3)} times"


def _short(value: float) -> str:
    digits = 2 if abs(value) < 100.0 else 3
    text = significant(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text else text
