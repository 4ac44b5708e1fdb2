"""Who holds an axis, seen without getting in anybody's way."""

from __future__ import annotations

import json
import os
import re

from agent.cell import Axis, Cell
from agent.cycle.axis_lock import lock_folder, lock_names, owned
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


def _names_the_living(name: str) -> bool:
    path = lock_folder() / f"stribeck.{re.sub(r'[^A-Za-z0-9._-]', '_', name)}.lock"
    try:
        pid = int(json.loads(path.read_text(encoding="utf-8"))["pid"])
        if pid == os.getpid():  # our own look of a moment ago
            return False
        os.kill(pid, 0)
    except PermissionError:
        return path.exists()  # somebody else's process, or file
    except (OSError, ValueError, KeyError, TypeError, OverflowError):
        return False
    return True
