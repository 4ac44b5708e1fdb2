"""`stribeck simulate`: what a twin says of a recording's own motion, as a column beside it."""

from __future__ import annotations

from pathlib import Path

import typer

from agent.acquisition import Acquisition
from agent.cli.terminal.talk import talker
from agent.conclude.driven import driven
from agent.errors import InputError, UsageError
from agent.identify.signals.arrays import Signals
from agent.identify.signals.simulated import simulated_torque_nm
from agent.identify.thermal.stand_in import with_stand_in
from agent.physics.effects import unix_s
from agent.physics.learnt_over import beyond, known_to
from agent.physics.twin import Twin, TwinError, parse_twin
from agent.record.reading import read
from agent.record.recording import Recording
from agent.record.writing import write
from drivers.errors import why_unreadable

COLUMN = "torque_simulated_nm"


def run_simulate(twin_path: Path, recording_path: str, out: Path) -> None:
    """Write the recording with the twin's torque beside it, and print the file's name.

    Raises
    ------
    agent.errors.InputError
        Twin or recording cannot be used, or are not of one axis.
    """
    if out.suffix.lower() not in (".parquet", ".csv"):
        raise UsageError(f"--out: expected a name that ends in .parquet or .csv, got {out}.")
    twin = read_twin(twin_path)
    recording = read(recording_path)
    written = write(simulated(twin, recording, str(twin_path)), out)
    for where in beyond(known_to(twin), driven([recording])):
        talker().print(
            f"{recording_path} goes beyond what {twin_path.name} was learnt over: {where}. Its "
            "laws are carried on there, and not known."
        )
    talker().print(f"{COLUMN} is what {twin_path.name} predicts for {recording_path}.")
    typer.echo(str(written))


def read_twin(path: Path) -> Twin:
    """Return the twin of a file, or refuse with the file's name."""
    try:
        return parse_twin(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: the twin cannot be read: {why_unreadable(error)}.") from error
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
        recording.columns,
        about.gear_ratio,
        name=Path(recording.source).name,
        acquisition=Acquisition.from_metadata(about.extra, recording.source),
    )
    try:
        torque = simulated_torque_nm(
            twin,
            signals,
            with_stand_in(recording.columns),
            _instant_unix_s(about.started_at),
            about.payload_kg,
        )
    except TwinError as error:
        raise InputError(f"{where}: {error}") from error
    return recording.with_columns({COLUMN: torque})


def _instant_unix_s(started_at: str) -> float | None:
    """Return when a recording began; None for a label that is no instant, as it may be.

    Only a drift needs it, and says so where it is missing.
    """
    try:
        return unix_s(started_at)
    except ValueError:
        return None
