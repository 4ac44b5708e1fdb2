"""What a night is asked for: a cell and the description of its nights, which belong together."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agent.cell.cell import Cell, read_cell
from agent.night.description import NightDescription, night_path, read_night


@dataclass(frozen=True)
class Asked:
    """A cell and its night, read and checked against each other."""

    path: Path
    cell: Cell
    description: NightDescription
    night_file: Path

    @property
    def folder(self) -> Path:
        """Return where the cell's recordings go."""
        return self.path.parent / self.cell.recording.folder


def asked_for(cell_path: Path, night_file: Path | None) -> Asked:
    """Read a cell and its night.

    Raises
    ------
    agent.errors.InputError
        One cannot be read, or the night speaks of an axis that the cell does not have.
    """
    cell = read_cell(cell_path)
    file = night_file or night_path(cell_path)
    description = read_night(file)
    for axis in description.axis:
        cell.axis_numbered(axis.number)
    return Asked(cell_path, cell, description, file)
