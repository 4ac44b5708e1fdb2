"""The stages of a cycle, and what one of its ticks sends."""

from __future__ import annotations

import enum
from typing import NamedTuple

from drivers.ports import Command, Goal

AT_REST = Command(Goal.ON, 0.0)
OFF = Command(Goal.OFF, 0.0)


class Stage(enum.Enum):
    """What the cycle is doing; the value is the word that the recording's `phase` uses."""

    ENABLE = "enable"
    APPROACH = "approach"
    STAIR = "stair"
    RETURN = "return"
    DISABLE = "disable"
    DONE = "done"


class Step(NamedTuple):
    """What one tick sends, and how the recording labels it."""

    command: Command
    phase: str
    position_command_rad: float
