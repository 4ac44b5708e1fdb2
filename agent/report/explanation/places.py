"""Where a mismatch lives, in words: axes as they are written, and ranges along them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from agent.explain.answer.result import Region
from agent.identify.result import Floats
from agent.numbers import parameter_label, parameter_unit
from agent.report.explanation.words import share, short
from trajectories import lasting


@dataclass(frozen=True)
class Variable:
    """An axis of the recordings as it is written: shown = `factor` x value + `shift`."""

    label: str
    unit: str = ""
    factor: float = 1.0
    shift: float = 0.0

    @property
    def title(self) -> str:
        """Return the label with its unit, as an axis of a picture carries it."""
        return f"{self.label}, {self.unit}" if self.unit else self.label

    def shown(self, values: Floats) -> Floats:
        """Return values of the recording's unit, shape (n,), in the unit written."""
        return self.factor * np.asarray(values, dtype=np.float64) + self.shift


_DEGREES = math.degrees(1.0)
_VARIABLES: Mapping[str, Variable] = MappingProxyType(
    {
        "time_s": Variable("time", "s"),
        "elapsed_s": Variable("time since the first recording", "s"),
        "velocity_rad_s": Variable("motor velocity", "rad/s"),
        "speed_rad_s": Variable("motor speed", "rad/s"),
        "acceleration_rad_s2": Variable("motor acceleration", "rad/s²"),
        "position_rad": Variable("motor position", "rad"),
        "arm_position_rad": Variable("arm position", "degrees", _DEGREES),
        "position_arm_rad": Variable("arm position", "degrees", _DEGREES),
        "torque_nm": Variable("motor torque", "N m"),
        "load_torque_nm": Variable("load torque", "N m"),
        "gearbox_temperature_degc": Variable("gearbox temperature", "°C"),
        "motor_temperature_degc": Variable("motor temperature", "°C"),
        "ambient_temperature_degc": Variable("ambient temperature", "°C"),
        "recording": Variable("recording", "", 1.0, 1.0),  # counted from 1 for people
        "order_per_motor_rev": Variable("order per motor turn"),
        "order_per_arm_rev": Variable("order per arm turn"),
        "motor_phase_rad": Variable("angle within a motor turn", "degrees", _DEGREES),
        "frequency_hz": Variable("frequency", "Hz"),
        "after_reversal_s": Variable("time since the reversal", "s"),
        "after_reversal_rad": Variable("motor travel since the reversal", "rad"),
    }
)

_PLACES = 4  # that are said one by one


def variable(name: str) -> Variable:
    """Return how an axis is written; one that is not known keeps its own name and unit.

    An order may be part of the name, as ``order_per_motor_rev 12``.
    """
    if name in _VARIABLES:
        return _VARIABLES[name]
    kind, _, order = name.partition(" ")
    if order and kind == "frequency_hz":
        return Variable(f"time at {order} Hz")
    if order and kind.startswith("order_per_") and kind in _VARIABLES:
        return Variable(f"order {order}{_VARIABLES[kind].label.removeprefix('order')}")
    label = parameter_label(name.replace("-", "_"))
    return Variable(label[:1].lower() + label[1:], parameter_unit(name))


def regions_in_words(regions: Sequence[Region], recordings: Sequence[str] = ()) -> tuple[str, ...]:
    """Say where a mismatch lives, the places with most of it, and how many others there are.

    See `region_in_words`.
    """
    said = tuple(region_in_words(region, recordings) for region in regions[:_PLACES])
    others = len(regions) - len(said)
    places = "place" if others == 1 else "places"
    return (*said, f"and in {others} smaller {places}") if others else said


def region_in_words(region: Region, recordings: Sequence[str] = ()) -> str:
    """Say where a mismatch lives: axis, range, and how much of it lies there.

    Of a finding that is the finding's own share of the mismatch, not all of it: an effect of 1 %
    may lie in one place with 99 %.

    Parameters
    ----------
    region : Region
    recordings : sequence of str
        Names, for a region along `recording`, which counts them from 0.
    """
    place = _place(region, recordings)
    beside = []
    if math.isfinite(region.seconds):
        beside.append(lasting(region.seconds))
    if math.isfinite(region.share):
        beside.append(f"{share(region.share)} of it lies there")
    return f"{place} ({', '.join(beside)})" if beside else place


def _place(region: Region, recordings: Sequence[str]) -> str:
    axis = variable(region.variable)
    low, high = (float(end) for end in axis.shown(np.array([region.lower, region.upper])))
    unit = f" {axis.unit}" if axis.unit else ""
    if region.variable == "recording":
        names = [_recording(end, recordings) for end in (region.lower, region.upper)]
        return f"in {names[0]}" if names[0] == names[1] else f"from {names[0]} to {names[1]}"
    if region.variable in ("order_per_motor_rev", "order_per_arm_rev"):
        return f"{axis.label} {short(0.5 * (low + high))}"
    if not math.isfinite(low) or not math.isfinite(high):
        if math.isfinite(high):
            return f"{axis.label} below {short(high)}{unit}"
        return f"{axis.label} above {short(low)}{unit}"
    if low < 0.0 and math.isclose(low, -high, rel_tol=0.02):
        return f"{axis.label} within ±{short(high)}{unit}"
    if short(low) == short(high):
        return f"{axis.label} {short(high)}{unit}"
    return f"{axis.label} {short(low)} to {short(high)}{unit}"


def _recording(index: float, recordings: Sequence[str]) -> str:
    at = round(index) if math.isfinite(index) else -1
    return recordings[at] if 0 <= at < len(recordings) else f"recording {at + 1}"
