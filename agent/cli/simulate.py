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
from agent.physics.twin import Twin, TwinError, parse_twin
from agent.record.reading import read
from agent.record.recording import Recording
from agent.record.writing import write

Floats = NDArray[np.float64]

COLUMN = "torque_simulated_nm"
_SHORTEST_PERIODS = 2.0  # of the cutoff: a shorter stretch has no acceleration to speak of


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

    Only the acceleration is low-passed, at the cutoff that the velocity's own noise asks for: the
    torque that stands beside it is unfiltered, too.
    """
    motion = read_motion(signals)
    cutoff_hz = shared_cutoff([motion]).frequency_hz
    torque = np.full(signals.time_s.shape, np.nan)

    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):

        def column(name: str, at: NDArray[np.int64] = stretch.index) -> Floats | None:
            known = name in recording
            return np.asarray(recording[name], dtype=np.float64)[at] if known else None

        period_s = stretch.period_s
        if velocity.shape[0] * period_s * cutoff_hz < _SHORTEST_PERIODS:
            continue
        smooth = lowpass(velocity, period_s, cutoff_hz)
        noise = motion.velocity_noise_rad_s
        torque[stretch.index] = twin.predict_torque(
            column("position_rad"),
            stretch.off_grid(signals, velocity),
            stretch.off_grid(signals, np.gradient(smooth, period_s)),
            np.sign(
                np.round(
                    stretch.off_grid(signals, direction_of(velocity, period_s, cutoff_hz, noise))
                )
            ),
            time_s=signals.time_s[stretch.index],
            gearbox_temperature_degc=column("gearbox_temperature_degc"),
            motor_temperature_degc=column("motor_temperature_degc"),
        )
    return torque
