"""CELL.toml: one robot cell, its bus and its axes, as a frozen and validated description.

Units are in the names. Unknown keys are refused, and every mistake is reported at once. Its parts
are beside this module: `agent.cell.bus`, `agent.cell.axis`, `agent.cell.devices`.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from agent.cell.axis import Axis, claimed_beside
from agent.cell.bus import REPLAY, Bus, Drive
from agent.cell.devices import ContactRelease, Part, Release, shared_places
from agent.errors import InputError
from drivers.described import validated
from drivers.errors import why_unreadable

__all__ = ["REPLAY", "SCHEMA", "Axis", "Bus", "Cell", "Drive", "parse_cell", "read_cell"]

SCHEMA = "stribeck.cell/1"


def _a_name(text: str) -> str:
    """Return `text` when it can stand in a file name on every system."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", text):
        raise ValueError(
            "expected letters, digits, '.', '_' or '-', starting with a letter or digit"
        )
    return text


Name = Annotated[str, AfterValidator(_a_name)]


class Recording(Part):
    """Where and how often samples are kept."""

    folder: str = "recordings"
    sample_rate_hz: Annotated[float, Field(ge=50.0, le=1000.0)] = 500.0
    disk_reserve_mb: Annotated[float, Field(ge=0.0)] = 200.0


class Cell(Part):
    """One robot cell."""

    schema_: Literal["stribeck.cell/1"] = Field(alias="schema")
    robot: Name
    robot_model: str = ""
    bus_: Bus | None = Field(default=None, alias="bus")
    recording: Recording = Recording()
    release: Release | None = None
    axis: tuple[Axis, ...] = Field(strict=False)

    @model_validator(mode="after")
    def _axes_are_distinct(self) -> Self:
        if not self.axis:
            raise ValueError("a cell needs at least one [[axis]]")
        drives = [axis.drive_ for axis in self.axis if axis.drive_ is not None]
        if drives and self.bus_ is None:
            raise ValueError("[bus] is missing: how the drives are reached")
        by_job = [str(axis.number) for axis in self.axis if axis.job is not None]
        if self.bus_ is not None and self.bus_.replays and by_job:
            # Somebody who believes that all is replayed would be driving a robot.
            raise ValueError(f"a replay has drives only: axis {', '.join(by_job)} has [axis.job]")
        if isinstance(self.release, ContactRelease) and not drives:
            raise ValueError("a release on a CAN input needs a drive on [bus] beside it")
        for what in ("number", "node_id"):
            values = [a.number for a in self.axis]
            if what == "node_id":
                values = [drive.node_id for drive in drives]
            twice = sorted({v for v in values if values.count(v) > 1})
            if twice:
                raise ValueError(f"{what} {twice[0]} is given to more than one axis")
        return self

    @model_validator(mode="after")
    def _nodes_are_distinct(self) -> Self:
        for axis in self.axis:
            drive = axis.drive_
            node = None if drive is None else drive.node_id
            shared = shared_places(node, axis.temperature, axis.job, self.release)
            if shared:
                raise ValueError(f"axis {axis.number}: {'; '.join(shared)}")
            if drive is not None and axis.supervision.agent_node_id == drive.node_id:
                raise ValueError(f"axis {axis.number}: agent_node_id is the drive's own node_id")
            others = [a for a in self.axis if a is not axis]
            if taken := claimed_beside(axis, others, self.release):
                raise ValueError(f"axis {axis.number}: {'; '.join(taken)}")
        return self

    @property
    def bus(self) -> Bus:
        """Return the CAN bus, or refuse where the cell has none."""
        if self.bus_ is None:
            raise InputError(f"The cell {self.robot} has no CAN bus.")
        return self.bus_

    def axis_numbered(self, number: int) -> Axis:
        """Return the axis with this number, or refuse, naming those there are."""
        for axis in self.axis:
            if axis.number == number:
                return axis
        known = ", ".join(str(a.number) for a in self.axis)
        raise InputError(f"The cell {self.robot} has no axis {number}; it has {known}.")


def parse_cell(text: str, source: str = "CELL.toml", folder: Path | None = None) -> Cell:
    """Parse and validate a cell description.

    Parameters
    ----------
    text : str
        TOML.
    source : str
        What to call it in messages.
    folder : pathlib.Path, optional
        What the files that the cell names are relative to.

    Raises
    ------
    agent.errors.InputError
        With every mistake on a line of its own.
    """
    return validated(Cell, text, source, InputError, whole="the cell", context={"folder": folder})


def read_cell(path: Path) -> Cell:
    """Read and validate CELL.toml.

    Raises
    ------
    agent.errors.InputError
        Where the file cannot be read, or with every mistake in it.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"The cell description {path} cannot be read: {why_unreadable(error)}.",
            "`stribeck example-cell` prints one to begin with.",
        ) from error
    return parse_cell(text, source=str(path), folder=path.parent)
