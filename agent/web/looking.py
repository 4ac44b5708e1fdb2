"""What the devices say before a start: asked by a child, because the page touches no bus.

The child looks while somebody has a start page open, and for ten seconds longer
(`agent.cli.page.look`). What it saw is shown; whether a cycle may run is the cycle's to judge.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from drivers.clock import Clock

OLDEST_S = 15.0
"""What was seen longer ago is not shown: the child writes every three seconds."""
_ENDS_S = 5.0


@dataclass(frozen=True)
class Look:
    """What was seen: reasons by condition (empty where it holds), and why the rest was not."""

    conditions: Mapping[str, str] = field(default_factory=dict)
    untold: str = ""


@dataclass
class _Child:
    out: Path
    process: subprocess.Popen[bytes]
    told: bytes = b""
    told_s: float = 0.0


class Looking:
    """Looks at the axes whose start page somebody has open; threads may ask together.

    Parameters
    ----------
    state, cell_path : pathlib.Path
        The page's folder, where the child writes; the cell.
    clock : drivers.clock.Clock
        Monotonic.
    command : sequence of str
        Starts the child; empty looks at nothing.
    """

    def __init__(
        self,
        state: Path,
        cell_path: Path,
        clock: Clock,
        command: Sequence[str] = (sys.executable, "-m", "agent.cli"),
    ) -> None:
        self._state = state
        self._cell_path = cell_path
        self._clock = clock
        self._command = command
        self._children: dict[int, _Child] = {}
        self._lock = threading.Lock()

    def ask(self, axis: int) -> Look | None:
        """Return what was seen of an axis, and have it looked at again; None: nothing yet."""
        if not self._command:
            return None
        with self._lock:
            child = self._children.get(axis)
            if child is None or child.process.poll() is not None:
                self._let_go(self._children.pop(axis, None))
                child = self._begin(axis)
            if child is None:
                return None
            self._children[axis] = child
            with contextlib.suppress(OSError):  # it has just ended: the next poll begins another
                if child.process.stdin is not None:
                    child.process.stdin.write(b".")
                    child.process.stdin.flush()
            return self._seen(child)

    def end(self) -> None:
        """Have the looks end, before a cycle wants an axis; waits until the bus is let go."""
        with self._lock:
            while self._children:
                self._let_go(self._children.popitem()[1])

    def _let_go(self, child: _Child | None) -> None:
        if child is None:
            return
        with contextlib.suppress(OSError):  # it has ended by itself
            if child.process.stdin is not None:
                child.process.stdin.close()
        try:
            child.process.wait(_ENDS_S)
        except subprocess.TimeoutExpired:
            child.process.kill()
            child.process.wait()

    def _begin(self, axis: int) -> _Child | None:
        out = self._state / f"look-axis{axis}.json"
        out.unlink(missing_ok=True)
        arguments = ["serve-look", str(self._cell_path), "--axis", str(axis), "--out", str(out)]
        try:
            process = subprocess.Popen(
                [*self._command, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
        except OSError:
            return None
        return _Child(out, process)

    def _seen(self, child: _Child) -> Look | None:
        """Return what the child has written last; None where that is nothing, or old."""
        now_s = self._clock.now()
        try:
            told = child.out.read_bytes()
            if told != child.told:  # each look has its number
                child.told, child.told_s = told, now_s
            document = json.loads(told)
            found = {str(n): "" if holds else str(why) for n, holds, why in document["conditions"]}
            look = Look(found, str(document["untold"]))
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return look if now_s - child.told_s <= OLDEST_S else None
