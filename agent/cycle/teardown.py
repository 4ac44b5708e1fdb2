"""The one clean-up path: taken once on every way out of a cycle, and it never gives up halfway.

Stop the joint, take torque away and restore the drive, finish the recording. Each step is tried
whatever became of the one before; what failed is in the `Aftermath`, in words.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from agent.errors import AgentError, StorageError
from drivers.clock import Clock
from drivers.errors import DriverError, JointSinksError
from drivers.ports import Sample, StopReport, SyncAccount

STOP_TIMEOUT_S = 5.0
LOOSE_RAD = 1.0
"""Of the motor. A soft gear that unwinds moves it by a tenth of that once its torque is gone."""

SHOWN = 3
"""So many of the objects that somebody has changed are named; a restart has changed them all."""


class Stoppable(Protocol):
    """What the clean-up needs of an axis, or of a controller that drives one."""

    def stop(self, deadline_s: float) -> StopReport:
        """As `drivers.ports.Axis.stop`."""
        ...

    def close(self) -> SyncAccount:
        """As `drivers.ports.Axis.close`."""
        ...


@dataclass(frozen=True)
class Aftermath:
    """How the clean-up went.

    Parameters
    ----------
    at_rest : bool
        Whether standstill was measured, or nothing had been enabled; and it has not begun to sink
        since its torque was taken away.
    restored : bool
        Whether every register is as it was found.
    account : SyncAccount or None
        Samples asked for and received.
    recording : pathlib.Path or None
        The recording, as far as it got.
    problems : tuple of str
        What failed, in words.
    unfinished : StorageError or None
        Why the recording could not be finished, where it is the disk.
    rest_after_s : float or None
        From the beginning of the stop to the measured standstill; None where nothing was stopped,
        or no standstill was seen.
    """

    at_rest: bool
    restored: bool
    account: SyncAccount | None
    recording: Path | None
    problems: tuple[str, ...]
    unfinished: StorageError | None = None
    rest_after_s: float | None = None


def tear_down(
    axis: Stoppable,
    clock: Clock,
    *,
    has_torque: bool,
    keep: Callable[[tuple[Sample, ...]], None],
    finish: Callable[[SyncAccount | None], Path | None],
) -> Aftermath:
    """Bring the joint to rest, the drive to how it was found, the recording to the disk.

    Parameters
    ----------
    axis : Stoppable
        Opened or half opened.
    clock : Clock
        For the deadline of the stop.
    has_torque : bool
        Whether the drive may be enabled; False skips the stop.
    keep : callable
        Records the samples that arrive during the stop.
    finish : callable
        Finishes the recording, given the account of samples; returns its path.
    """
    problems: list[str] = []
    at_rest = not has_torque
    rest_after_s: float | None = None
    if has_torque:
        at_rest, rest_after_s = _stop(axis, clock, keep, problems)
    account: SyncAccount | None = None
    restored = True
    try:
        account = axis.close()
    except JointSinksError as error:
        at_rest, account = False, error.account
        restored = error.__cause__ is None
        problems += [str(each) for each in (error, error.__cause__) if each is not None]
    except DriverError as error:
        restored = False
        problems.append(str(error))
    if account is not None and account.changed:
        problems.append(_changed(account.changed))
    recording: Path | None = None
    unfinished: StorageError | None = None
    try:
        recording = finish(account)
    except AgentError as error:
        problems.append(str(error))
        unfinished = error if isinstance(error, StorageError) else None
    return Aftermath(
        at_rest, restored, account, recording, tuple(problems), unfinished, rest_after_s
    )


def _stop(
    axis: Stoppable,
    clock: Clock,
    keep: Callable[[tuple[Sample, ...]], None],
    problems: list[str],
) -> tuple[bool, float | None]:
    """Bring the joint to rest; return whether it is, and after how long."""
    began_s = clock.now()
    report = axis.stop(began_s + STOP_TIMEOUT_S)
    rest_after_s = clock.now() - began_s if report.at_rest else None
    if not report.at_rest:
        problems.append(f"standstill was not seen: {report.reason}")
    elif report.unbraked:
        problems.append(
            f"while stopping {report.unbraked}, so its voltage was taken away: have the drive's"
            " loop, its encoder and its ramps looked at before anything moves again"
        )
    if report.loose_rad > LOOSE_RAD:
        problems.append(
            f"while stopping the motor moved by {report.loose_rad:.1f} rad without torque: what"
            " holds the joint then? Have its brake looked after"
        )
    try:
        keep(report.samples)
    except AgentError as error:
        problems.append(str(error))
    return report.at_rest, rest_after_s


def _changed(what: tuple[str, ...]) -> str:
    """Return in words that somebody has changed what was set for the cycle."""
    more = f", and {len(what) - SHOWN} more" if len(what) > SHOWN else ""
    return (
        f"The drive was no longer set in the end as at the beginning: {'; '.join(what[:SHOWN])}"
        f"{more}. Find out who else changes this drive; what was recorded may be something else "
        "than it is called"
    )
