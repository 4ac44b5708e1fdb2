"""`stribeck thermal`: how the gearbox cools, and what temperature does to its friction."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import typer

from agent.cli.outcome import signals_of
from agent.cli.ripple import one_axis, write_picture
from agent.errors import InputError
from agent.identify.estimate import estimate
from agent.identify.friction_surface import Surface, fit_surface
from agent.identify.result import Floats, Parameter
from agent.identify.surface_law import SurfacePoints
from agent.identify.thermal import Cooling, estimate_cooling
from agent.identify.thermal_trend import TemperatureOrTime, temperature_or_time
from agent.numbers import parameter_label, parameter_unit, scale_for, written
from agent.record.reading import read_all
from agent.record.recording import Recording

SCHEMA = "stribeck.thermal/1"
_SENSORS = ("gearbox_temperature_degc", "motor_temperature_degc")
_AMBIENT = "ambient_temperature_degc"
_HOUR_S = 3600.0


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
        from agent.report.figure_thermal import figure_thermal

        write_picture(
            picture, figure_thermal(*found.curve, found.cooling, found.surface, found.points)
        )
    typer.echo(json.dumps(found.to_json(), indent=2) if as_json else thermal_text(found))


def thermal_of(recordings: Sequence[Recording], until_degc: float, oil: str = "") -> Thermal:
    """Identify the thermal laws of one axis.

    Raises
    ------
    agent.errors.InputError
        No recording has a temperature.
    """
    sensor = next((s for s in _SENSORS if any(s in r for r in recordings)), None)
    if sensor is None:
        raise InputError(
            "None of the recordings has a temperature.",
            f"Record the column {_SENSORS[0]} (oil or housing).",
        )
    time_s, temperature, ambient = _curve(recordings, sensor)
    cooling = estimate_cooling(time_s, temperature, ambient)
    end_s = float(time_s[-1] - time_s[0]) if time_s.size else 0.0
    forecasts = {
        end_s + h * _HOUR_S: cooling.forecast(end_s + h * _HOUR_S) for h in (0.5, 1.0, 2.0)
    }
    points = _points(recordings, sensor)
    return Thermal(
        tuple(Path(r.source).name for r in recordings),
        sensor,
        cooling,
        forecasts,
        until_degc,
        cooling.time_to(until_degc),
        _surface(points, oil),
        points,
        temperature_or_time([signals_of(r) for r in recordings], _temperatures(recordings, sensor)),
        (time_s, temperature),
    )


def _temperatures(recordings: Sequence[Recording], sensor: str) -> list[Floats | None]:
    """Return each recording's temperature on the samples that the estimators see."""
    out: list[Floats | None] = []
    for recording in recordings:
        if sensor not in recording:
            out.append(None)
            continue
        at = np.asarray(recording["time_s"], dtype=np.float64)
        values = np.asarray(recording[sensor], dtype=np.float64)
        kept = np.isfinite(values)
        seen = signals_of(recording).time_s
        out.append(np.interp(seen, at[kept], values[kept]) if kept.any() else None)
    return out


def _curve(recordings: Sequence[Recording], sensor: str) -> tuple[Floats, Floats, Floats | None]:
    """Return time, temperature and ambient of all recordings, one after another by their start."""
    own = [r for r in recordings if sensor in r]
    starts = [_start_s(r) for r in own]
    if len(own) > 1 and any(s is None for s in starts):
        own, starts = own[:1], starts[:1]
    first = min((s for s in starts if s is not None), default=0.0)
    pieces = sorted(
        ((0.0 if s is None else s - first, r) for s, r in zip(starts, own, strict=True)),
        key=lambda piece: piece[0],
    )
    time = np.concatenate([offset + np.asarray(r["time_s"], dtype=float) for offset, r in pieces])
    temperature = np.concatenate([np.asarray(r[sensor], dtype=float) for _, r in pieces])
    measured = all(_AMBIENT in r for _, r in pieces)
    ambient = (
        np.concatenate([np.asarray(r[_AMBIENT], dtype=float) for _, r in pieces])
        if measured
        else None
    )
    kept = np.isfinite(temperature) & np.isfinite(time)
    # Recordings that overlap in wall time (copies, a clock set back) leave no curve behind them.
    kept &= time >= np.maximum.accumulate(np.where(np.isfinite(time), time, -np.inf))
    index = np.flatnonzero(kept)
    index = index[np.diff(time[index], prepend=-np.inf) > 0.0]
    return time[index], temperature[index], None if ambient is None else ambient[index]


def _start_s(recording: Recording) -> float | None:
    """Return when a recording started, in seconds, where it says so."""
    text = recording.metadata.started_at
    if not text:
        return None
    try:
        return datetime.fromisoformat(text).timestamp()
    except ValueError:
        return None


def _points(recordings: Sequence[Recording], sensor: str) -> SurfacePoints | None:
    """Return every recording's friction curve at its mean temperature."""
    rows = []
    for recording in recordings:
        if sensor not in recording:
            continue
        curve = estimate([signals_of(recording)]).friction_curve
        temperature = float(np.nanmean(np.asarray(recording[sensor], dtype=float)))
        if curve is None or not np.isfinite(temperature):
            continue
        half = 0.5 * (curve.ci95_nm[:, 1] - curve.ci95_nm[:, 0])
        for speed, friction, error in zip(
            np.abs(curve.velocity_rad_s), np.abs(curve.friction_nm), half, strict=True
        ):
            if np.isfinite(error) and error > 0.0:
                rows.append((float(speed), temperature, float(friction), float(error) / 1.96))
    if not rows:
        return None
    # A speed whose interval came out tiny by luck must not rule the fit.
    table = np.array(rows)
    table[:, 3] = np.maximum(table[:, 3], np.median(table[:, 3]))
    return SurfacePoints(*table.T)


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
    lines += ["", f"Temperature or time: {found.trend.sentence}"]
    return "\n".join(lines)


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
