"""How a cycle or a job ends: its result, or the one error that says what a technician must know."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agent.cycle.teardown import Aftermath
from agent.errors import StoppedError, StorageError
from drivers.ports import AxisEvidence, SyncAccount

LEFT = {
    "cycle": "The drive's settings were not all restored; the next run will restore them.",
    "job": "The controller may still hold the job; the next run will let go of it first.",
}
"""What is left to do for the next run, by what has ended."""


@dataclass(frozen=True)
class CycleResult:
    """A cycle that ran to its end."""

    recording: Path
    evidence: AxisEvidence
    account: SyncAccount


def conclude(
    failure: BaseException | None,
    aftermath: Aftermath,
    evidence: AxisEvidence | None,
    *,
    what: str,
    moved: bool,
) -> CycleResult:
    """Return the result of what ran to its end, or raise why it is none.

    Parameters
    ----------
    failure : BaseException or None
        What ended it before its end.
    aftermath : Aftermath
        How the clean-up went.
    evidence : AxisEvidence or None
        What was found when the axis was opened.
    what : str
        "cycle" or "job".
    moved : bool
        Whether the joint may have moved.

    Raises
    ------
    BaseException
        `failure`, with notes; a StorageError where only the recording could not be finished; a
        StoppedError for everything else that went wrong after the end.
    """
    if failure is None and aftermath.problems:
        failure = _after_the_end(aftermath, what)
        moved = True
    if failure is not None:
        annotate(failure, aftermath, what=what, moved=moved)
        raise failure
    if aftermath.recording is None or aftermath.account is None or evidence is None:
        raise AssertionError(f"a {what} that ran to its end has a recording and an account")
    return CycleResult(aftermath.recording, evidence, aftermath.account)


def _after_the_end(aftermath: Aftermath, what: str) -> StoppedError | StorageError:
    """Return what went wrong after the motion: the disk alone is no matter of safety."""
    unfinished = aftermath.unfinished
    if unfinished is not None and len(aftermath.problems) == 1:
        error = StorageError(
            f"The {what} ran to its end, but its recording could not be finished: "
            f"{unfinished.what.rstrip('.')}.",
            unfinished.do,
        )
        error.__cause__ = unfinished
        return error
    return StoppedError(f"The {what} ran to its end, but: {'; '.join(aftermath.problems)}.")


def annotate(error: BaseException, aftermath: Aftermath, *, what: str, moved: bool) -> None:
    """Add to `error` what a technician must know after a cycle that did not end well."""
    if moved:
        error.add_note(
            "The joint is at rest (measured)."
            if aftermath.at_rest
            else "The joint was NOT seen to come to rest: use the E-stop before you go near it."
        )
    if aftermath.rest_after_s is not None:
        error.add_note(
            f"Standstill was measured {aftermath.rest_after_s:.2f} s after the agent began to stop."
        )
    for problem in aftermath.problems:
        if isinstance(error, StorageError) and error.__cause__ is aftermath.unfinished:
            continue  # it is what the error itself says
        error.add_note(problem if problem.endswith(".") else f"{problem}.")
    if not aftermath.restored:
        error.add_note(LEFT[what])
    if aftermath.recording is not None:
        error.add_note(f"What had been recorded is kept in {aftermath.recording}.")
