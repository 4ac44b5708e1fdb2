"""A thread that saves packed rows, so that the control tick never waits for a disk.

The tick hands over and looks; it does neither wait nor write. What waits is bounded, by number here
and by age in `StreamWriter`. The first failure ends the thread, and is there to be seen at the next
look: whatever was handed over after it is not saved.
"""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable

from agent.record.rows import PackedRows

PENDING_MAX = 16


class BackgroundSaver:
    """Saves what it is handed, in order, in a thread of its own.

    Parameters
    ----------
    save : callable
        Saves some rows; called from the thread alone.
    name : str
        Of the thread.
    """

    def __init__(self, save: Callable[[PackedRows], None], name: str) -> None:
        self._save = save
        self._handed: queue.SimpleQueue[PackedRows | None] = queue.SimpleQueue()
        self._pending: deque[PackedRows] = deque()
        self.failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def oldest_s(self) -> float | None:
        """Return the time of the oldest row that was handed over and is not yet saved."""
        try:
            return self._pending[0].first_s
        except IndexError:  # the thread may take the last away between two looks
            return None

    @property
    def full(self) -> bool:
        """Tell whether no more rows may be handed over now."""
        return len(self._pending) >= PENDING_MAX

    def hand(self, rows: PackedRows) -> None:
        """Have `rows` saved; never waits."""
        self._pending.append(rows)
        self._handed.put(rows)

    def finish(self) -> None:
        """Wait until everything that was handed over is saved or has failed; may be repeated."""
        self._handed.put(None)
        self._thread.join()

    def _run(self) -> None:
        try:
            while (rows := self._handed.get()) is not None:
                self._save(rows)
                self._pending.popleft()
        except BaseException as error:  # noqa: BLE001 - a thread has nobody else to tell it to
            self.failure = error
