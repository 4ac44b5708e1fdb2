"""Recordings and a twin in, their explanation out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path

from agent.acquisition import Acquisition
from agent.errors import InputError
from agent.explain.answer.result import Explanation
from agent.explain.explain import explain
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.physics.effects.library import numbers_of
from agent.physics.twin import Twin, TwinError
from agent.record.recording import Recording
from trajectories import AxisLimits


def explained(
    twin: Twin,
    where: Path,
    recordings: Sequence[Recording],
    unseen: Sequence[Recording],
    limits: AxisLimits | None = None,
) -> Explanation:
    """Return the explanation of recordings; a twin that cannot predict them is refused."""
    _known(twin, where)
    try:
        return explain(twin, runs_of(recordings), runs_of(unseen), limits)
    except TwinError as error:
        raise InputError(f"{where}: {error}") from error


def _known(twin: Twin, where: Path) -> None:
    """Refuse a twin whose effects no law predicts, whatever the recordings hold."""
    for effect in twin.effects:
        try:
            numbers_of(effect.id, effect.parameters)
        except ValueError as error:
            raise InputError(f"{where}: effects: {error}") from error


def runs_of(recordings: Sequence[Recording]) -> tuple[Run, ...]:
    """Return recordings as the explanation takes them; names are the files', made unique."""
    names = [Path(r.source).name for r in recordings]
    return tuple(
        Run.from_columns(
            _numbers(recording),
            recording.metadata.gear_ratio,
            name=name if names.count(name) == 1 else recording.source,
            started_s=_started(recording),
            payload_kg=(
                math.nan
                if recording.metadata.payload_kg is None
                else float(recording.metadata.payload_kg)
            ),
            acquisition=Acquisition.from_metadata(recording.metadata.extra, recording.source),
        )
        for recording, name in zip(recordings, names, strict=True)
    )


def _numbers(recording: Recording) -> Mapping[str, Floats]:
    """Return the columns of numbers that the contract knows."""
    from agent.record.recording import FLOAT_COLUMNS

    return {name: recording[name] for name in FLOAT_COLUMNS if name in recording}


def _started(recording: Recording) -> float:
    try:
        return datetime.fromisoformat(recording.metadata.started_at).timestamp()
    except ValueError:
        return math.nan
