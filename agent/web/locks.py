"""Who holds an axis, seen without getting in anybody's way, and asked to stop."""

from __future__ import annotations

import json
import os
import re
import signal
import sys

from agent.cell.cell import Axis, Cell
from agent.cycle.axis_lock import Holder, holders, lock_folder, lock_names, owned
from agent.errors import StorageError


def holder(cell: Cell, axis: Axis) -> str:
    """Return who holds an axis, in the lock's own words; empty when it is free.

    The lock itself is tried only where its file names a living process: a page that looks every
    two seconds must not be what a cycle finds in its way.
    """
    if not any(_names_the_living(name) for name in lock_names(cell, axis)):
        return ""
    try:
        with owned(cell, axis) as free:
            return "" if free.holds else free.reason
    except StorageError as error:
        return str(error)


def others(cell: Cell, axis: Axis, own_pid: int | None) -> tuple[Holder, ...]:
    """Return the programs of this machine that hold an axis, other than the page's own cycle."""
    names = [name for name in lock_names(cell, axis) if _names_the_living(name)]
    found = holders(lock_folder(), names) if names else ()
    return tuple(holder for holder in found if holder.pid != own_pid)


def ask_to_stop(holder: Holder) -> bool:
    """Ask another program's cycle to stop, as `stribeck stop` does; False where it may not be."""
    if sys.platform == "win32":
        return False
    try:
        os.kill(holder.pid, signal.SIGINT)
    except ProcessLookupError:
        return True  # it has just ended
    except PermissionError:
        return False
    return True


def _names_the_living(name: str) -> bool:
    path = lock_folder() / f"stribeck.{re.sub(r'[^A-Za-z0-9._-]', '_', name)}.lock"
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        pid = int(told["pid"])
        if pid == os.getpid() or told.get("looks"):  # our own look of a moment ago
            return False
        if sys.platform == "win32":
            return True  # there `os.kill` ends a process, whatever the signal; the lock tells
        os.kill(pid, 0)
    except PermissionError:
        return path.exists()  # somebody else's process, or file
    except (OSError, ValueError, KeyError, TypeError, OverflowError):
        return False
    return True
