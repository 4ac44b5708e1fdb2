"""From finished recordings to what a technician reads: sentence, JSON, report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent.acquisition import Acquisition
from agent.conclude.comparable import check_given_once
from agent.cycle.stage import Stage
from agent.errors import InputError
from agent.identify.detail import RecordingDetail
from agent.identify.estimate import Identification, identify
from agent.identify.result import Estimate
from agent.identify.signals.arrays import Signals
from agent.record.atomic import publish
from agent.record.recording import Recording

if TYPE_CHECKING:
    from agent.report.views import RecordingView


@dataclass(frozen=True)
class Conclusion:
    """What was identified from which recordings.

    Parameters
    ----------
    recordings : tuple of Recording
        All of one axis.
    validation : Recording or None
        A run of its own that was predicted.
    identification : Identification
        The estimate, and the arrays that it came from.
    """

    recordings: tuple[Recording, ...]
    validation: Recording | None
    identification: Identification

    @property
    def estimate(self) -> Estimate:
        """Return the estimate."""
        return self.identification.estimate

    def json(self) -> str:
        """Return the `stribeck.estimate/1` document; what is not decidable has next steps.

        `advice` says what the steps are about, a word for each.
        """
        more = {"next_steps": self.next_steps(), "advice": self.advice()}
        return json.dumps(self.estimate.to_json() | more, indent=2)

    def next_steps(self) -> list[str]:
        """Return what to record instead; empty where the estimate is decidable."""
        if self.estimate.decidable:
            return []
        from agent.report.advice import next_steps

        return list(next_steps(self.estimate.reasons))

    def advice(self) -> list[str]:
        """Return what the next steps are about; empty where the estimate is decidable."""
        if self.estimate.decidable:
            return []
        from agent.report.advice import advised

        return list(advised(self.estimate.reasons))

    def write_json(self, path: Path) -> Path:
        """Write the document, whole or not at all."""
        publish({path: f"{self.json()}\n".encode()}, overwrite=True)
        return path

    def write_report(self, path: Path) -> Path:
        """Write the offline report, whole or not at all."""
        from agent.report.estimate import write_estimate_report
        from agent.report.views import EstimateViews

        found = self.identification
        views = [_view(r, d) for r, d in zip(self.recordings, found.details, strict=True)]
        if self.validation is not None and found.validation_detail is not None:
            views.append(_view(self.validation, found.validation_detail, validation=True))
        metadata = self.recordings[0].metadata
        return write_estimate_report(
            path,
            self.estimate,
            EstimateViews(tuple(views)),
            robot=metadata.robot,
            axis=metadata.axis,
            metadata=metadata.to_json(),
        )


def conclude(recordings: Sequence[Recording], validation: Recording | None = None) -> Conclusion:
    """Identify one axis from its recordings.

    Raises
    ------
    agent.errors.InputError
        Where the recordings are not all of one axis, or one is given twice.
    """
    everything = [*recordings, *([] if validation is None else [validation])]
    joints = {(r.metadata.robot, r.metadata.axis, r.metadata.gear_ratio) for r in everything}
    if len(joints) > 1:
        names = "; ".join(
            f"{robot} axis {axis} (gear {gear:g})" for robot, axis, gear in sorted(joints)
        )
        raise InputError(
            f"These recordings are not all of one axis: {names}.", "Estimate each axis by itself."
        )
    check_given_once(recordings)
    found = identify(
        [signals_of(r) for r in recordings],
        validation=None if validation is None else signals_of(validation),
    )
    return Conclusion(tuple(recordings), validation, found)


def signals_of(recording: Recording) -> Signals:
    """Return a recording's arrays for the estimators.

    What the cycle did to get to its trajectory and back is left out: those passes have no partner
    in the other direction, and one law's misfit there would look like gravity.
    """
    columns = recording.columns
    if "phase" in columns:
        around = [stage.value for stage in Stage if stage is not Stage.STAIR]
        own = ~np.isin(columns["phase"], around)
        columns = {name: values[own] for name, values in columns.items()}
    return Signals.from_columns(
        columns,
        recording.metadata.gear_ratio,
        name=Path(recording.source).name,
        samples_lost=recording.metadata.samples_lost or 0,
        acquisition=Acquisition.from_metadata(recording.metadata.extra, recording.source),
    )


def _view(
    recording: Recording, detail: RecordingDetail, *, validation: bool = False
) -> RecordingView:
    from agent.report.views import RecordingView

    return RecordingView(
        signals=signals_of(recording),
        windows=detail.windows,
        velocity_rad_s=detail.velocity_rad_s,
        torque_nm=detail.torque_nm,
        torque_predicted_nm=detail.torque_predicted_nm,
        compared=detail.compared,
        validation=validation,
        started_at=recording.metadata.started_at,
    )
