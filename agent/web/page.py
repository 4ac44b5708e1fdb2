"""What every route of the page stands on: the cell, its people, the running cycle, the shelf."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from fastapi import FastAPI

from agent.cell.cell import Cell, read_cell
from agent.cycle.axis_lock import Holder
from agent.errors import AgentError
from agent.record.audit import AuditTrail
from agent.web.attended import Attendant
from agent.web.limits import Attempts
from agent.web.live import Live
from agent.web.locks import others
from agent.web.looking import Looking
from agent.web.sessions import Sessions
from agent.web.settings import PageSettings
from agent.web.shelf import Shelf
from agent.web.store import Store
from agent.web.users import Users
from drivers.clock import Clock, wall_time_utc


@dataclass
class Page:
    """What the routes stand on."""

    settings: PageSettings
    clock: Clock
    store: Store
    users: Users
    sessions: Sessions
    attempts: Attempts
    attendant: Attendant
    looking: Looking
    live: Live
    audit: AuditTrail
    shelf: Shelf
    app: FastAPI
    _cell: tuple[tuple[int, int], Cell] | None = field(default=None)

    @property
    def cell(self) -> Cell:
        """Return the cell as its file describes it now.

        Raises
        ------
        agent.errors.InputError
            Somebody has spoilt the file meanwhile.
        """
        try:
            status = self.settings.cell_path.stat()
            stamp = (status.st_mtime_ns, status.st_size)
        except OSError:
            stamp = (0, 0)
        if self._cell is None or self._cell[0] != stamp:
            self._cell = (stamp, read_cell(self.settings.cell_path))
        return self._cell[1]

    def baseline(self, axis: int) -> str:
        """Return which recording somebody chose as an axis's baseline; empty: nobody did."""
        with self.store.reading() as connection:
            chosen = connection.execute(
                "SELECT recording FROM baselines WHERE axis = ?", (axis,)
            ).fetchone()
        return str(chosen["recording"]) if chosen is not None else ""

    def choose_baseline(self, axis: int, recording: str, who: str) -> None:
        """Keep which recording is an axis's baseline."""
        with self.store.writing() as connection:
            connection.execute(
                "INSERT OR REPLACE INTO baselines (axis, recording, who, at) VALUES (?, ?, ?, ?)",
                (axis, recording, who, wall_time_utc()),
            )

    def elsewhere(self) -> list[tuple[int, Holder]]:
        """Return axes of this cell that other programs of this machine hold, and who they are.

        Of the cell as it was last read where its file has been spoilt since: a stop must not
        depend on what somebody is typing.
        """
        own = self.attendant.active
        pid = None if own is None else own.process.pid
        try:
            cell = self.cell
        except AgentError:
            if self._cell is None:
                return []
            cell = self._cell[1]
        return [(a.number, holder) for a in cell.axis for holder in others(cell, a, pid)]

    @property
    def recordings(self) -> Path:
        """Return the folder of the cell's recordings."""
        return self.settings.cell_path.parent / self.cell.recording.folder
