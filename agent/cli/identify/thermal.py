"""`stribeck thermal`: how the gearbox cools, and what temperature does to its friction."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import typer

from agent.cli.identify.thermal_history import History, history_of, temperatures_of
from agent.cli.identify.thermal_oil import oils_for, unknown_oil
from agent.cli.terminal.pictures import write_picture
from agent.conclude.comparable import one_axis
from agent.conclude.outcome import signals_of
from agent.identify.estimate import estimate
from agent.identify.friction.oil_change import ASSUMPTION, OilComparison, compare_oils
from agent.identify.friction.surface import Surface, fit_surface
from agent.identify.friction.surface_law import SurfacePoints
from agent.identify.result import Floats, Parameter
from agent.identify.thermal.cooling import Cooling, estimate_cooling
from agent.identify.thermal.integral import IntegralOverTemperature, integral_over_temperature
from agent.identify.thermal.trend import TemperatureOrTime, temperature_or_time
from agent.numbers import parameter_label, parameter_unit, scale_for, written
from agent.record.reading import read_all
from agent.record.recording import Recording

SCHEMA = "stribeck.thermal/1"
_HOUR_S = 3600.0
_SPEEDS = 60


@dataclass(frozen=True)
class Thermal:
    """What the recordings of one axis say about temperature.

    `curve` is (time in s from the first recording's start, temperature).
    """

    recordings: tuple[str, ...]
    sensor: str
    cooling: Cooling
    forecasts: dict[float, Parameter]
    target_degc: float
    reaches: Parameter
    surface: Surface
    points: SurfacePoints | None
    trend: TemperatureOrTime
    curve: tuple[Floats, Floats]
    oils: OilComparison | None = None
    oils_reason: str = ""
    integral: IntegralOverTemperature | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.thermal/1` document."""
        return {
            "schema": SCHEMA,
            "recordings": list(self.recordings),
            "temperature": self.sensor,
            "cooling": self.cooling.to_json(),
            "forecast_degc": [
                {"at_s": at_s, **value.to_json()} for at_s, value in self.forecasts.items()
            ],
            "reaches": {"temperature_degc": self.target_degc, "at_s": self.reaches.to_json()},
            "friction_surface": self.surface.to_json(),
            "friction_integral": None if self.integral is None else self.integral.to_json(),
            "oils": None if self.oils is None else self.oils.to_json(),
            "temperature_or_time": self.trend.to_json(),
        }


def run_thermal(
    patterns: Sequence[str],
    until_degc: float,
    oil: str,
    picture: Path | None,
    *,
    as_json: bool,
) -> None:
    """Identify the thermal laws from recordings and print them.

    Raises
    ------
    agent.errors.InputError
        A recording cannot be used, they are not of one axis, or none has a temperature.
    """
    recordings = read_all(patterns)
    one_axis(recordings)
    found = thermal_of(recordings, until_degc, oil)
    if picture is not None:
        from agent.report.figures.thermal import figure_thermal

        drawn = figure_thermal(*found.curve, found.cooling, found.surface, found.points, found.oils)
        write_picture(picture, drawn)
    typer.echo(json.dumps(found.to_json(), indent=2) if as_json else thermal_text(found))


def thermal_of(recordings: Sequence[Recording], until_degc: float, oil: str = "") -> Thermal:
    """Identify the thermal laws of one axis.

    Raises
    ------
    agent.errors.InputError
        No recording has a temperature, two overlap in time, or they are of different oils.
    """
    name, oils = oils_for(oil, recordings)
    history = history_of(recordings)
    cooling = _cooling(history)
    end_s = float(np.ptp(history.time_s)) if history.time_s.size else 0.0
    forecasts = {
        end_s + h * _HOUR_S: cooling.forecast(end_s + h * _HOUR_S) for h in (0.5, 1.0, 2.0)
    }
    points = _points(recordings, history.sensor)
    surface = _surface(points, name)
    trend = temperature_or_time(
        [signals_of(r) for r in recordings],
        temperatures_of(recordings, history.sensor),
        history.starts_s,
    )
    compared = None
    if oils and surface.identified and points is not None:
        speeds = np.geomspace(points.speed_rad_s.min(), points.speed_rad_s.max(), _SPEEDS)
        compared = compare_oils(surface, name, oils, speeds, points.levels_degc())
    return Thermal(
        tuple(Path(r.source).name for r in recordings),
        history.sensor,
        cooling,
        forecasts,
        until_degc,
        cooling.time_to(until_degc),
        surface,
        points,
        trend,
        (history.time_s, history.temperature_degc),
        compared,
        "" if oils or not name else unknown_oil(name),
        None if points is None else integral_over_temperature(points),
    )


def _cooling(history: History) -> Cooling:
    if history.reason:
        return Cooling.not_identified(history.reason)
    return estimate_cooling(history.time_s, history.temperature_degc, history.ambient_degc)


def _points(recordings: Sequence[Recording], sensor: str) -> SurfacePoints | None:
    """Return every recording's friction curve, each speed at the temperature it was passed at."""
    rows = []
    temperatures = temperatures_of(recordings, sensor)
    for number, (recording, temperature) in enumerate(zip(recordings, temperatures, strict=True)):
        if temperature is None:
            continue
        signals = replace(signals_of(recording), gearbox_temperature_degc=temperature)
        curve = estimate([signals]).friction_curve
        if curve is None:
            continue
        half = 0.5 * (curve.ci95_nm[:, 1] - curve.ci95_nm[:, 0])
        for speed, warmth, friction, error in zip(
            np.abs(curve.velocity_rad_s),
            curve.temperature_degc,
            np.abs(curve.friction_nm),
            half,
            strict=True,
        ):
            if np.isfinite(error) and error > 0.0 and np.isfinite(warmth):
                rows.append((speed, warmth, friction, error / 1.96, number))
    if not rows:
        return None
    # A speed whose interval came out tiny by luck must not rule the fit.
    table = np.array(rows)
    table[:, 3] = np.maximum(table[:, 3], np.median(table[:, 3]))
    speed, warmth, friction, error, number = table.T
    return SurfacePoints(speed, warmth, friction, error, number.astype(np.int64))


def _surface(points: SurfacePoints | None, oil: str) -> Surface:
    if points is None:
        return Surface(
            oil,
            False,
            "not identified: none of the recordings carries a friction curve; drive the stair both "
            "ways at several temperatures",
        )
    return fit_surface(points, oil=oil)


def thermal_text(found: Thermal) -> str:
    """Return what a technician reads."""
    cooling = found.cooling
    lines = [f"Temperature over time ({found.sensor.removesuffix('_degc').replace('_', ' ')}):"]
    if cooling.identified:
        names = ("rate_per_s", "settled_degc", "initial_degc", "ambient_degc", "added_degc")
        lines += [_row(name, getattr(cooling, name)) for name in names]
        lines += [
            _row(f"after {at_s / _HOUR_S:.2f} h", value, unit="°C")
            for at_s, value in found.forecasts.items()
        ]
    else:
        lines.append(f"  {cooling.reason}.")
    if cooling.identified and found.reaches.identified and found.reaches.ci95 is not None:
        low, high = (end / _HOUR_S for end in found.reaches.ci95)
        lines.append(
            f"  at {found.target_degc:g} °C {found.reaches.value / _HOUR_S:.2f} h after the start "
            f"({low:.2f} to {high:.2f} h)"
        )
    elif cooling.identified:
        lines.append(f"  at {found.target_degc:g} °C: {found.reaches.reason}.")
    lines += ["", "Friction over velocity and temperature:"]
    if found.surface.law:
        lines.append(f"  {found.surface.law}; on unseen temperatures {_rms(found.surface)} rms")
        lines += [_row(name, p) for name, p in found.surface.parameters.items()]
    if found.surface.reason:
        lines.append(f"  {found.surface.reason}.")
    lines += _integral_lines(found.integral)
    lines += [*_oil_lines(found), "", f"Temperature or time: {found.trend.sentence}"]
    return "\n".join(lines)


def _integral_lines(integral: IntegralOverTemperature | None) -> list[str]:
    """Return how much friction over all speeds changes with a kelvin (thesis Figure A.1)."""
    if integral is None:
        return []
    low, high = integral.speeds_rad_s
    label = f"Integral {low:.3g} to {high:.3g} rad/s, per K"
    return [_row(label, integral.slope_w_per_k, "W/K")]


def _oil_lines(found: Thermal) -> list[str]:
    """Return what each oil would make of the friction, at the fastest speed that was driven."""
    if found.oils_reason:
        return ["", f"Other oils: {found.oils_reason}"]
    if found.oils is None:
        return []
    oils = found.oils
    speed = float(oils.speed_rad_s[-1])
    lines = ["", f"With each oil at {oils.temperature_degc:.0f} °C, at {speed:.3g} rad/s:"]
    for curve in oils.curves:
        label = f"{curve.name} (in use)" if curve.in_use else curve.name
        if curve.reason:
            lines.append(f"  {label:<40} {curve.reason}.")
        else:
            low, high = (float(end) for end in curve.ci95_nm[-1])
            lines.append(_row(label, Parameter(float(curve.friction_nm[-1]), (low, high)), "N m"))
    return [*lines, f"  ({ASSUMPTION}.)"]


def _rms(surface: Surface) -> str:
    scale = scale_for("N m", (surface.heldout_rmse_nm,))
    return f"{surface.heldout_rmse_nm * scale.factor:.3g} {scale.unit}"


def _row(name: str, parameter: Parameter, unit: str | None = None) -> str:
    label = parameter_label(name) if unit is None else name
    if not parameter.identified:
        return f"  {label:<40} not identified: {parameter.reason}"
    scale = scale_for(parameter_unit(name) if unit is None else unit, (parameter.value,))
    if name == "rate_per_s":
        low, high = parameter.ci95 if parameter.ci95 is not None else (np.nan, np.nan)
        text = f"{1e5 * parameter.value:.3f}e-5 1/s ({1e5 * low:.3f} to {1e5 * high:.3f})"
        return f"  {'Cooling rate r':<40} {text}"
    value, interval, _ = written(parameter, scale.factor)
    return f"  {label:<40} {value:>10} {scale.unit:<12} ({interval})"
