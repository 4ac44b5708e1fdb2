"""`stribeck simulate`: what a twin says of a recording's own motion, as a column beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import typer
from numpy.typing import NDArray

from agent.cli.talk import talker
from agent.errors import InputError
from agent.identify.lowpass import lowpass
from agent.identify.preprocess import direction_of, read_motion, shared_cutoff
from agent.identify.signals import Signals
from agent.physics.effects import unix_s
from agent.physics.twin import Twin, TwinError, parse_twin
from agent.record.reading import read
from agent.record.recording import Recording
from agent.record.writing import write

Floats = NDArray[np.float64]

COLUMN = "torque_simulated_nm"
_SHORTEST_PERIODS = 2.0  # of the cutoff: a shorter stretch has no acceleration to speak of
_SHARE = 0.5  # of the torque's noise may come from the acceleration: together 12 % more
_SEEN = 0.01  # of the acceleration's range: a difference that a plot would show


def run_simulate(twin_path: Path, recording_path: str, out: Path) -> None:
    """Write the recording with the twin's torque beside it, and print the file's name.

    Raises
    ------
    agent.errors.InputError
        Twin or recording cannot be used, or are not of one axis.
    """
    if out.suffix.lower() not in (".parquet", ".csv"):
        raise InputError(f"--out: expected a name that ends in .parquet or .csv, got {out}.")
    twin = read_twin(twin_path)
    recording = read(recording_path)
    written = write(simulated(twin, recording, str(twin_path)), out)
    talker().print(f"{COLUMN} is what {twin_path.name} predicts for {recording_path}.")
    typer.echo(str(written))


def read_twin(path: Path) -> Twin:
    """Return the twin of a file, or refuse with the file's name."""
    try:
        return parse_twin(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: the twin cannot be read: {error}.") from error
    except TwinError as error:
        raise InputError(f"{path}: {error}") from error


def simulated(twin: Twin, recording: Recording, where: str) -> Recording:
    """Return the recording with the twin's torque; NaN where the motion is not known."""
    about = recording.metadata
    for name, own, other in (
        ("axis", twin.axis, about.axis),
        ("gear ratio", twin.gear_ratio, about.gear_ratio),
    ):
        if own != other:
            raise InputError(f"{where} has {name} {own:g}, but {recording.source} has {other:g}.")
    signals = Signals.from_columns(
        recording.columns, about.gear_ratio, name=Path(recording.source).name
    )
    try:
        return recording.with_columns({COLUMN: _torque_nm(twin, signals, recording)})
    except TwinError as error:
        raise InputError(f"{where}: {error}") from error


def _torque_nm(twin: Twin, signals: Signals, recording: Recording) -> Floats:
    """Return the twin's torque at the recording's samples, stretch by stretch, shape (n,).

    Only the acceleration is low-passed: the torque that stands beside it is unfiltered, too. NaN
    in gaps, and where the acceleration leans on what was not recorded.
    """
    motion = read_motion(signals)
    direction_hz = shared_cutoff([motion]).frequency_hz
    torque = np.full(signals.time_s.shape, np.nan)
    started_at = recording.metadata.started_at
    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
        period_s = stretch.period_s
        if velocity.shape[0] * period_s * direction_hz < _SHORTEST_PERIODS:
            continue
        quiet_nm = _noise(stretch.on_grid(signals, signals.torque_nm))
        cutoff_hz = _cutoff_hz(
            1.0 / period_s, motion.velocity_noise_rad_s * twin.inertia_kg_m2, quiet_nm, direction_hz
        )
        acceleration, known = _acceleration(
            velocity, period_s, cutoff_hz, _SHARE * quiet_nm, twin.inertia_kg_m2
        )
        noise = motion.velocity_noise_rad_s
        direction = direction_of(velocity, period_s, direction_hz, noise)

        def column(name: str, at: NDArray[np.int64] = stretch.index) -> Floats | None:
            there = name in recording
            return np.asarray(recording[name], dtype=np.float64)[at] if there else None

        predicted = twin.predict_torque(
            column("position_rad"),
            stretch.off_grid(signals, velocity),
            stretch.off_grid(signals, acceleration),
            np.sign(np.round(stretch.off_grid(signals, direction))),
            time_s=signals.time_s[stretch.index],
            gearbox_temperature_degc=column("gearbox_temperature_degc"),
            motor_temperature_degc=column("motor_temperature_degc"),
            started_at_unix_s=unix_s(started_at) if started_at else None,
        )
        unknown = stretch.off_grid(signals, (~known).astype(np.float64)) > 0.0
        torque[stretch.index] = np.where(unknown, np.nan, predicted)
    return torque


def _cutoff_hz(rate_hz: float, noise: float, quiet_nm: float, least_hz: float) -> float:
    """Return the widest low-pass whose acceleration is quieter than the torque beside it.

    White velocity noise of standard deviation s, differentiated and low-passed at f, is an
    acceleration noise of ``s 2 pi sqrt(2 f^3/(3 rate))``. A narrower low-pass would take away the
    ringing of a soft arm.

    Parameters
    ----------
    rate_hz : float
        Sampling rate.
    noise : float
        s times the inertia, N m s.
    quiet_nm : float
        Standard deviation of the torque's own noise.
    least_hz : float
        The cutoff that the motion itself asks for.
    """
    if noise == 0.0:
        return rate_hz
    if quiet_nm == 0.0:
        return least_hz
    share = _SHARE * quiet_nm / (2.0 * np.pi * noise)
    return float(max((1.5 * rate_hz * share**2) ** (1.0 / 3.0), least_hz))


def _acceleration(
    velocity: Floats, period_s: float, cutoff_hz: float, quiet_nm: float, inertia_kg_m2: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the acceleration, shape (n,), and where it is known.

    It is taken twice, with the velocity continued past its ends by its slope and by its mirror
    image. Where the two differ by a torque that can be seen, it depends on what was not recorded.
    """
    pad = min(velocity.shape[0] - 1, int(np.ceil(3.0 / (cutoff_hz * period_s))))
    sloped, mirrored = (
        np.gradient(
            lowpass(np.pad(velocity, pad, "reflect", reflect_type=kind), period_s, cutoff_hz)
        )[pad : pad + velocity.shape[0]]
        / period_s
        for kind in ("odd", "even")
    )
    seen_nm = max(quiet_nm, _SEEN * inertia_kg_m2 * float(np.ptp(sloped)))
    return sloped, inertia_kg_m2 * np.abs(sloped - mirrored) <= seen_nm


def _noise(torque_nm: Floats) -> float:
    """Return the standard deviation of white noise, from the median of second differences."""
    curvature = np.abs(np.diff(torque_nm, n=2))
    return float(np.median(curvature) / (0.6745 * np.sqrt(6.0)))
