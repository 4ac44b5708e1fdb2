"""From finished recordings to what a technician reads: sentence, JSON, report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from agent.identify.estimate import estimate
from agent.identify.result import Estimate
from agent.identify.signals import Signals
from agent.record.atomic import publish
from agent.record.recording import Recording


@dataclass(frozen=True)
class Outcome:
    """The estimate and the files that hold it."""

    estimate: Estimate
    json_path: Path
    report_path: Path


def signals_of(recording: Recording) -> Signals:
    """Return a recording's arrays for the estimators."""
    return Signals.from_columns(
        recording.columns,
        recording.metadata.gear_ratio,
        name=Path(recording.source).name,
        samples_lost=recording.metadata.samples_lost or 0,
    )


def conclude(
    recordings: Sequence[Recording], stem: Path, *, validation: Recording | None = None
) -> Outcome:
    """Estimate, and write STEM.estimate.json and STEM.report.html.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one axis.
    stem : pathlib.Path
        Folder and name that the files get.
    validation : Recording, optional
        A run of its own that the rigid body must predict.
    """
    signals = [signals_of(r) for r in recordings]
    unseen = None if validation is None else signals_of(validation)
    result = estimate(signals, validation=unseen)
    json_path = stem.with_name(f"{stem.name}.estimate.json")
    text = json.dumps(result.to_json(), indent=2) + "\n"
    publish({json_path: text.encode()}, overwrite=True)
    report_path = stem.with_name(f"{stem.name}.report.html")
    write_report(report_path, result, recordings, validation=validation)
    return Outcome(result, json_path, report_path)
