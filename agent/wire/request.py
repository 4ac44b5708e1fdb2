"""What somebody asks of the composition root: one cycle."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agent.cell.cell import Axis, Cell
from trajectories import Trajectory


@dataclass(frozen=True)
class CycleRequest:
    """One cycle that somebody has asked for.

    Parameters
    ----------
    cell, axis : Cell, Axis
        Whose joint.
    folder : pathlib.Path
        Where the recording goes.
    reverse : bool
        Whether to drive the reversed stair (validation run).
    trajectory : Trajectory, optional
        What to drive in place of the cell's stair; it passes the same checks and the same gate.
    journal_folder : pathlib.Path, optional
        Where a killed run leaves how it had found the drive. The same for every run of a cell,
        wherever its recordings go, or the next run would not find it; `folder` unless given.
    """

    cell: Cell
    axis: Axis
    folder: Path
    reverse: bool = False
    trajectory: Trajectory | None = None
    journal_folder: Path | None = None
