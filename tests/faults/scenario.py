"""What a fault is in the campaign: a frozen value with ranges, and one variation drawn of it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fakes.fault import Fault
from fakes.faults import fault_from_mapping

PHASES = ("standstill", "approach", "ramp", "plateau", "reversal", "return", "teardown")
MOVING = ("approach", "ramp", "plateau", "reversal", "return")
BEFORE_TEARDOWN = ("standstill", *MOVING)

COMES_TO_REST_S = 0.6
"""The longest reaction (0.17 s), braking from 80 rad/s at 500 rad/s2 (0.16 s), ringing (0.2 s)."""

COASTS_S = 4.0
"""Without torque and without a holding brake friction alone stops the joint."""


@dataclass(frozen=True)
class Between:
    """A number drawn uniformly."""

    low: float
    high: float

    def draw(self, random: np.random.Generator) -> float:
        return float(random.uniform(self.low, self.high))


@dataclass(frozen=True)
class OneOf:
    """One of several values, all equally likely."""

    values: tuple[Any, ...]

    def draw(self, random: np.random.Generator) -> Any:
        return self.values[int(random.integers(len(self.values)))]


@dataclass(frozen=True)
class Scenario:
    """One fault, how it may vary, and what must follow.

    Parameters
    ----------
    name : str
        As the table calls it.
    script : tuple of mapping
        Faults as `fakes.faults.fault_from_mapping` reads them, with `Between` and `OneOf` for what
        varies; `at_s` is set to the onset, to which a script's own `after_s` is added.
    act : str
        What is done to the cell at the onset, by `tests.faults.acts.ACTS`; "" for nothing.
    lasts_s : Between
        Handed to `act`.
    outcome : str
        ``stops``: the cycle must end with an error; ``bears``: it must run to its end; ``either``:
        it depends on the moment and the strength, and both must be clean.
    codes : tuple of int
        Exit codes that a stop may have.
    says : str
        A regular expression that the message of a stop must match.
    phases : tuple of str
        When it may strike.
    within_s : float
        From the onset (where a stop is sure) or the agent's decision (where it is not) to
        standstill of the motor, at most.
    samples_true : bool
        Whether every recorded position must be the joint's own at that time, unless the recording
        says that it holds doubtful ones, of which, but for a few, no estimate is made.
    """

    name: str
    script: tuple[Mapping[str, Any], ...] = ()
    act: str = ""
    lasts_s: Between = Between(0.0, 0.0)
    outcome: str = "stops"
    codes: tuple[int, ...] = (4,)
    says: str = ""
    phases: tuple[str, ...] = BEFORE_TEARDOWN
    within_s: float = COMES_TO_REST_S
    samples_true: bool = True

    def faults(self, onset_s: float, random: np.random.Generator) -> tuple[Fault, ...]:
        """Draw one variation of the script that begins at `onset_s`."""
        made = []
        for entry in self.script:
            drawn = {
                key: value.draw(random) if isinstance(value, Between | OneOf) else value
                for key, value in entry.items()
            }
            after_s = drawn.pop("after_s", 0.0)
            made.append(fault_from_mapping({**drawn, "at_s": onset_s + after_s}))
        return tuple(made)


@dataclass(frozen=True)
class Run:
    """What became of one variation.

    Parameters
    ----------
    scenario, phase, onset_s, seed
        Which one.
    code : int
        Exit code: 0 where the cycle ran to its end.
    message : str
        The error with its notes; "" where there was none.
    rest_after_s : float
        From the onset until the motor was last seen to move, by the plant; 0 where it stood. Where
        a fault is one that may be borne for a while, from the moment at which the agent stopped.
    moves : bool
        Whether it still moved at the end.
    handed_over, committed, kept : int
        Rows that the recorder was given; rows of them that it must keep (all, unless the disk is
        full: then those older than its flush period); rows that can be read afterwards.
    lost : int or None
        `samples_lost` of the recording; None where it says that this is not known.
    misplaced_rad : float
        The largest distance of a recorded position from the joint's own at that time.
    doubtful : int
        Rows of which the recording itself says that their time is not sure, and objects of which
        it says that somebody has changed them.
    troubles : tuple of str
        Everything else that was not as it must be.
    """

    scenario: Scenario
    phase: str
    onset_s: float
    seed: int
    code: int
    message: str
    rest_after_s: float
    moves: bool
    handed_over: int
    committed: int
    kept: int
    lost: int | None
    misplaced_rad: float
    doubtful: int
    troubles: tuple[str, ...]

    @property
    def stopped(self) -> bool:
        return self.code != 0


MISPLACED_RAD = 0.005
"""Encoder, and interpolation of the truth; one tick too early or late is 0.04 rad at 4 rad/s."""


def objections(run: Run) -> list[str]:
    """Return everything against a run; none where all was as it must be."""
    scenario, found = run.scenario, list(run.troubles)
    expected = {"stops": True, "bears": False}.get(scenario.outcome, run.stopped)
    if run.stopped is not expected:
        found.append(f"expected that it {scenario.outcome}, exit code {run.code}")
    if run.moves:
        found.append("the joint still moves")
    if run.stopped:
        if run.code not in scenario.codes:
            found.append(f"exit code {run.code}, expected one of {scenario.codes}")
        if run.rest_after_s > scenario.within_s:
            found.append(f"rest after {run.rest_after_s:.2f} s, stated {scenario.within_s:.2f} s")
        if not re.search(scenario.says, run.message):
            found.append(f"the message does not say {scenario.says!r}")
    if not run.committed <= run.kept <= run.handed_over:
        found.append(f"{run.kept} rows can be read of {run.committed} that were committed")
    true = run.misplaced_rad <= MISPLACED_RAD or run.doubtful > 0
    if scenario.samples_true and not true:
        found.append(f"a recorded position is {run.misplaced_rad:.4f} rad from the joint's own")
    return found
