"""What must hold before anything moves: each condition blocks, and each says why.

Two halves: `before_the_bus` needs only the cell and the disk; `at_standstill` needs what the drive
says while it has no torque. Both return *all* reasons, so that a technician walks once.
"""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from agent.cell.cell import Axis, Cell
from agent.cycle.gate import temperature_refusals
from agent.cycle.plan import CyclePlan
from agent.errors import RefusedError
from drivers.ports import DriveState, Sample, WatchdogProof
from trajectories import check

# A joint that only reports noise stays below this; one that is being pushed does not.
STANDSTILL_RAD_S = 1.0
BYTES_PER_SAMPLE = 120


@dataclass(frozen=True)
class Condition:
    """One precondition: what it is, whether it holds, and why not."""

    name: str
    holds: bool
    reason: str = ""


def before_the_bus(cell: Cell, axis: Axis, plan: CyclePlan, folder: Path) -> tuple[Condition, ...]:
    """Return the preconditions that can be judged before a bus is opened; nothing is written.

    Parameters
    ----------
    cell, axis : Cell, Axis
        The description.
    plan : CyclePlan
        What would be driven.
    folder : pathlib.Path
        Where the recording would go.
    """
    return (
        Condition(
            "commissioned",
            axis.commissioned,
            f"axis {axis.number} of {cell.robot} is not commissioned: a responsible person must "
            "check its limits and set commissioned = true and commissioned_by in the cell",
        ),
        Condition(
            "payload confirmed",
            axis.payload_kg is not None,
            f"nobody has said what axis {axis.number} of {cell.robot} carries: set payload_kg in "
            "the cell, 0.0 for a bare flange",
        ),
        _inside_limits(axis, plan),
        _disk_space(folder, plan, cell.recording.disk_reserve_mb),
    )


def _inside_limits(axis: Axis, plan: CyclePlan) -> Condition:
    excesses = check(plan.trajectory, axis.motor_limits, axis.torque_model)
    text = "; ".join(excess.sentence for excess in excesses)
    return Condition(
        "inside limits", not excesses, f"the stair does not fit the axis's limits: {text}"
    )


def _disk_space(folder: Path, plan: CyclePlan, reserve_mb: float) -> Condition:
    needed_mb = reserve_mb + plan.trajectory.duration_s / plan.tick_s * BYTES_PER_SAMPLE / 1e6
    try:
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        if not (there.is_dir() and os.access(there, os.W_OK)):
            return Condition("disk space", False, f"nothing can be written to {there}")
        free_mb = shutil.disk_usage(there).free / 1e6
    except OSError as error:
        return Condition("disk space", False, f"the folder {folder} cannot be used: {error}")
    return Condition(
        "disk space",
        free_mb >= needed_mb,
        f"{folder} has {free_mb:.0f} MB free; recording and reserve need {needed_mb:.0f} MB",
    )


def at_standstill(plan: CyclePlan, samples: Sequence[Sample]) -> tuple[Condition, ...]:
    """Return the preconditions that need the drive, judged while it has no torque.

    Parameters
    ----------
    plan : CyclePlan
        What would be driven.
    samples : sequence of Sample
        A fifth of a second or so, oldest first.
    """
    if not samples:
        return (Condition("answers SYNC", False, "the drive does not answer SYNC"),)
    newest = samples[-1]
    # NaN first: `max` would pass over one that follows a number.
    fastest = max((abs(s.velocity_rad_s) for s in samples), key=lambda v: (math.isnan(v), v))
    limits = plan.limits
    inside = limits.position_min_rad <= newest.position_rad <= limits.position_max_rad
    arm_deg = math.degrees(newest.position_rad / plan.gear_ratio)
    temperature = temperature_refusals(limits, newest)
    return (
        Condition("answers SYNC", True),
        Condition(
            "without torque",
            newest.state is DriveState.OFF,
            f"the drive is '{newest.state.value}' although nobody has enabled it",
        ),
        Condition(
            "at standstill",
            math.isfinite(fastest) and fastest <= STANDSTILL_RAD_S,
            f"the joint moves ({fastest:.2f} rad/s) although it has no torque",
        ),
        Condition(
            "inside its window",
            inside,
            f"the arm stands at {arm_deg:.1f} deg, outside its window: jog it back inside",
        ),
        Condition("gearbox temperature", not temperature, "; ".join(temperature)),
    )


def watchdog_proven(proof: WatchdogProof) -> Condition:
    """Return whether the drive has shown that it stops by itself when the agent falls silent.

    Without that a velocity would go on for ever when this computer dies: nothing of the velocity
    modes is for such a drive, only moves that the drive itself ends.
    """
    return Condition(
        "watchdog proven",
        proof.reacted,
        f"the drive's watchdog does not work: it was still enabled {proof.still_enabled_s:.2f} s "
        f"after our last heartbeat, told to react after {proof.timeout_s:.2f} s (0x1016, 0x6007); "
        "in a velocity mode the joint would go on when this computer dies, so this drive is for "
        "bounded moves (profile position) only",
    )


def insist(conditions: Sequence[Condition]) -> None:
    """Refuse unless every condition holds.

    Raises
    ------
    agent.errors.RefusedError
        With every reason.
    """
    reasons = tuple(c.reason for c in conditions if not c.holds)
    if reasons:
        text = "; ".join(reasons)
        raise RefusedError(f"Refused, nothing has moved: {text}.", reasons)
