"""What becomes of a sample in a cycle: joined with its own tick's set-points, and written down."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from agent.cycle.stage import Step
from drivers.ports import Sample, SyncAccount, WatchdogProof

PROBE_COLUMNS = ("gearbox_temperature_age_s", "gearbox_temperature_quality")
"""What a recording has besides where another device than the drive measures a temperature."""


class Writer(Protocol):
    """What the runner needs of a recording that is being written."""

    def append(self, row: Sequence[float | str]) -> None:
        """Keep one row, in the order of the columns that it was opened with."""
        ...

    def wait_for_disk(self) -> None:
        """Let the disk take its time from now on: what comes after the loop comes at once."""
        ...

    def note(self, proof: WatchdogProof) -> None:
        """Keep the proof of the drive's watchdog with the recording."""
        ...

    def finish(self, *, account: SyncAccount | None, stopped_because: str) -> Path | None:
        """Close the recording and return its file; None where nothing was recorded.

        `account` says what became of every sample; None where that could not be learnt.
        """
        ...


@dataclass(frozen=True)
class _Sent:
    """What was sent in one tick, to label the sample that answers it."""

    time_s: float
    step: Step


class Recorder:
    """Joins each sample with the set-points of its own tick and hands the row to the writer."""

    def __init__(self, writer: Writer, *, with_temperature: bool, with_probe: bool) -> None:
        self._writer = writer
        self._with_temperature = with_temperature
        self._with_probe = with_probe
        self._sent: deque[_Sent] = deque()
        self._origin_s: float | None = None

    def sent(self, time_s: float, step: Step) -> None:
        """Note what was sent in a tick."""
        self._sent.append(_Sent(time_s, step))

    def keep(self, samples: Sequence[Sample]) -> None:
        """Record samples; one from before the first set-point was sent is not part of the run."""
        for sample in samples:
            while len(self._sent) > 1 and self._sent[1].time_s <= sample.time_s:
                self._sent.popleft()
            if not self._sent or sample.time_s < self._sent[0].time_s:
                continue
            if self._origin_s is None:
                self._origin_s = sample.time_s
            step = self._sent[0].step
            row: list[float | str] = [
                sample.time_s - self._origin_s,
                sample.position_rad,
                sample.velocity_rad_s,
                sample.torque_nm,
                step.command.velocity_rad_s,
                step.position_command_rad,
                step.phase,
            ]
            if self._with_temperature:
                row.append(sample.gearbox_temperature_degc)
            if self._with_probe:
                row.append(sample.gearbox_temperature_age_s)
                row.append(sample.gearbox_temperature_quality.value)
            self._writer.append(row)

    def located(self, account: SyncAccount) -> SyncAccount:
        """Return the account with its doubtful intervals in the recording's time, none before 0."""
        origin_s, spans = self._origin_s, account.doubtful_s
        if origin_s is None or spans is None:
            return account
        inside = tuple(
            (max(from_s - origin_s, 0.0), until_s - origin_s)
            for from_s, until_s in spans
            if until_s >= origin_s
        )
        return replace(account, doubtful_s=inside)


def columns(*, with_temperature: bool, with_probe: bool = False) -> tuple[str, ...]:
    """Return the columns of a recording in the order in which the runner writes them.

    Parameters
    ----------
    with_temperature : bool
        Whether the gearbox temperature is measured.
    with_probe : bool
        Whether a device beside the drive measures it: its readings have an age and a quality.
    """
    names: tuple[str, ...] = (
        "time_s",
        "position_rad",
        "velocity_rad_s",
        "torque_nm",
        "velocity_command_rad_s",
        "position_command_rad",
        "phase",
    )
    if with_temperature:
        names = (*names, "gearbox_temperature_degc")
    return (*names, *PROBE_COLUMNS) if with_probe else names
