"""What can be started from the page, and what it would do: the dry run as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from agent.cell.cell import Axis, Cell
from agent.cycle.plan import NAMED, CyclePlan, plan_cycle
from agent.cycle.preconditions import Judged, preconditions
from agent.cycle.preflight import Condition, before_the_bus
from agent.errors import AgentError
from agent.web.locks import holder
from agent.web.looking import Look
from trajectories import Trajectory, TrajectoryError, summarise
from trajectories.summary import Summary


@dataclass(frozen=True)
class Cycle:
    """One kind of cycle: what `stribeck run` is asked for."""

    word: str
    reverse: bool = False
    trajectory: str = ""

    @property
    def arguments(self) -> list[str]:
        """Return the options of the command line."""
        named = ["--trajectory", self.trajectory] if self.trajectory else []
        return [*named, *(["--reverse"] if self.reverse else [])]


CYCLES: Mapping[str, Cycle] = MappingProxyType(
    {
        "stair": Cycle("stair"),
        "reversed": Cycle("reversed", reverse=True),
        "triangle": Cycle("triangle", trajectory="triangle"),
    }
)


def cycles_of(axis: Axis) -> list[Cycle]:
    """Return what this axis can be asked for; a controller with a job of its own has its stair."""
    return [c for c in CYCLES.values() if axis.job is None or not c.trajectory]


def planned(cell: Cell, axis: Axis, cycle: Cycle) -> CyclePlan:
    """Return the plan of a cycle, as `stribeck run` makes it.

    Raises
    ------
    trajectories.TrajectoryError
        The axis cannot drive it.
    """
    given = NAMED[cycle.trajectory](axis) if cycle.trajectory else None
    return plan_cycle(cell, axis, reverse=cycle.reverse, trajectory=given)


@dataclass(frozen=True)
class DryRun:
    """What would be driven; `trouble` says why nothing can be, and then there is no summary."""

    trajectory: Trajectory | None
    summary: Summary | None
    trouble: str = ""


def dry_run(cell: Cell, axis: Axis, cycle: Cycle) -> DryRun:
    """Return what a cycle would do, with its margins."""
    try:
        plan = planned(cell, axis, cycle)
    except (TrajectoryError, AgentError) as error:
        return DryRun(None, None, str(error))
    summary = summarise(
        plan.trajectory, axis.motor_limits, axis.torque_model, gear_ratio=axis.gear_ratio
    )
    return DryRun(plan.trajectory, summary)


@dataclass(frozen=True)
class Judgement:
    """One precondition as it stands now.

    Parameters
    ----------
    name : str
        As `agent.cycle.preconditions` calls it.
    verdict : str
        "holds", "refused", "person" (somebody must guarantee it) or "later".
    reason : str
        Why it is refused, in the engine's words (English).
    judged : str
        Name of `agent.cycle.preconditions.Judged`, for those that the cycle judges after its start,
        whatever was seen before.
    """

    name: str
    verdict: str
    reason: str = ""
    judged: str = ""


def judgements(
    cell: Cell, axis: Axis, cycle: Cycle, folder: Path, look: Look | None = None
) -> list[Judgement]:
    """Return every precondition: what is judged without the bus is judged now; nothing is opened.

    Parameters
    ----------
    cell, axis : Cell, Axis
    cycle : Cycle
        What would be driven.
    folder : pathlib.Path
        Where the recording would go.
    look : Look, optional
        What the devices said a moment ago of those that the cycle will judge.
    """
    seen = {} if look is None else look.conditions
    try:
        now = list(before_the_bus(cell, axis, planned(cell, axis, cycle), folder))
    except (TrajectoryError, AgentError) as error:
        now = [Condition("inside limits", False, str(error))]
    held_by = holder(cell, axis)
    now.append(Condition("no other owner", not held_by, held_by))
    known = {condition.name: condition for condition in now}
    out = []
    for asked in preconditions(cell, axis):
        condition = known.get(asked.name)
        if condition is not None:
            verdict = "holds" if condition.holds else "refused"
            reason = "" if condition.holds else condition.reason
            out.append(Judgement(asked.name, verdict, reason))
        elif asked.judged is Judged.BY_CELL and cell.release is None:
            out.append(Judgement(asked.name, "person"))
        elif asked.name in seen:
            reason = seen[asked.name]
            verdict = "refused" if reason else "holds"
            out.append(Judgement(asked.name, verdict, reason, asked.judged.name))
        else:
            out.append(Judgement(asked.name, "later", judged=asked.judged.name))
    return out
