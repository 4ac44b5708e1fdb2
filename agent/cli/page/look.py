"""The page's look at an axis before a start: a child that reads, while somebody asks for it.

The page's process touches no bus. Each byte that it writes to our standard input asks for another
few seconds of looks; what was seen last stands in a file. Between two looks the axis and its bus
are nobody's, and a cycle that wants them waits for the end of a look.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import sys
import threading
from pathlib import Path

from agent.cell.cell import read_cell
from agent.cycle.axis_lock import looked_at
from agent.cycle.plan import plan_cycle
from agent.errors import AgentError
from agent.record.atomic import publish
from agent.wire.look import Seen, look
from drivers.clock import MonotonicClock
from drivers.errors import DriverError
from trajectories import TrajectoryError

PERIOD_S = 3.0
WANTED_S = 10.0
"""So long after the last byte nobody looks at the page any more."""


def serve_look(cell_path: Path, number: int, out: Path) -> None:
    """Look at an axis until standard input ends or says nothing more; see `agent.wire.look`."""
    cell = read_cell(cell_path)
    axis = cell.axis_numbered(number)
    wanted = _Wanted()
    clock = MonotonicClock()
    for count in itertools.count():
        if not wanted.still():
            return
        try:
            plan = plan_cycle(cell, axis)
            with looked_at(cell, axis) as free:
                seen = look(cell, axis, plan, clock) if free else Seen((), "")
        except (AgentError, DriverError, TrajectoryError) as error:
            seen = Seen((), str(error))
        publish({out: _document(seen, count)}, overwrite=True)
        wanted.wait(PERIOD_S)


def _document(seen: Seen, number: int) -> bytes:
    conditions = [[c.name, c.holds, "" if c.holds else c.reason] for c in seen.conditions]
    told = {"look": number, "conditions": conditions, "untold": seen.untold}
    return json.dumps(told).encode()


class _Wanted:
    """Whether somebody still wants looks; a thread reads standard input."""

    def __init__(self) -> None:
        self._clock = MonotonicClock()
        self._until_s = self._clock.now() + WANTED_S
        self._over = threading.Event()
        threading.Thread(target=self._listen, name="wanted", daemon=True).start()

    def still(self) -> bool:
        return not self._over.is_set() and self._clock.now() < self._until_s

    def wait(self, seconds: float) -> None:
        self._over.wait(seconds)

    def _listen(self) -> None:
        with contextlib.suppress(OSError, ValueError):  # a line that is broken or was never there
            while os.read(sys.stdin.fileno(), 64):
                self._until_s = self._clock.now() + WANTED_S
        self._over.set()
