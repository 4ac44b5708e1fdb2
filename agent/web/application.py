"""The page put together: settings in, an ASGI application out; nothing happens on import."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.resources
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles

from agent.cell import Cell, read_cell
from agent.cycle.axis_lock import Holder
from agent.errors import AgentError
from agent.record.audit import AuditTrail
from agent.web import (
    failures,
    routes_cell,
    routes_history,
    routes_people,
    routes_results,
    routes_run,
)
from agent.web.attended import Attendant, Launch
from agent.web.guard import Guard
from agent.web.limits import Attempts
from agent.web.live import Live
from agent.web.locks import others
from agent.web.looking import Looking
from agent.web.passwords import Argon2, Hasher
from agent.web.roles import Role
from agent.web.sessions import Sessions
from agent.web.settings import PageSettings
from agent.web.shelf import Shelf
from agent.web.store import Store
from agent.web.users import Users
from drivers.clock import Clock, MonotonicClock, wall_time_utc

STOP_PATIENCE_S = 15.0
"""How long an ending server waits until its cycle is at rest and recorded."""


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


def create_page(
    settings: PageSettings,
    *,
    clock: Clock | None = None,
    hasher: Hasher | None = None,
    launch: Launch | None = None,
    looking: Looking | None = None,
) -> Page:
    """Build the page of one cell.

    Parameters
    ----------
    settings : PageSettings
    clock : drivers.clock.Clock, optional
        For sessions and limits; the machine's own unless given.
    hasher : Hasher, optional
        For passwords; argon2 unless given.
    launch : Launch, optional
        Starts a cycle's process; `stribeck serve-run` unless given.
    looking : Looking, optional
        Looks at the devices before a start; by `stribeck serve-look` unless given.
    """
    clock = clock or MonotonicClock()
    store = Store(settings.state)
    attendant = Attendant(launch or Launch(settings.state, settings.cell_path), clock)
    app = FastAPI(
        title="Stribeck", docs_url=None, redoc_url=None, openapi_url=None, lifespan=_lifespan
    )
    page = Page(
        settings=settings,
        clock=clock,
        store=store,
        users=Users(store, hasher or Argon2()),
        sessions=Sessions(clock, settings.idle_s),
        attempts=Attempts(clock),
        attendant=attendant,
        looking=looking or Looking(settings.state, settings.cell_path, clock),
        live=Live(attendant),
        audit=AuditTrail(settings.state),
        shelf=Shelf(),
        app=app,
    )
    app.state.page = page
    app.add_middleware(Guard, hosts=settings.allowed_hosts, secure=settings.secure)
    failures.install(app)
    for module in (routes_people, routes_cell, routes_run, routes_results, routes_history):
        app.include_router(module.router)
    static = importlib.resources.files("agent.web") / "static"
    app.mount("/static", StaticFiles(directory=str(static)), name="static")
    return page


def first_token(page: Page) -> str:
    """Return the one-time token of the first engineer; empty once there is a user."""
    return "" if page.users.all() else page.users.invite("", Role.ENGINEER)


@contextlib.asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Look after the running cycle; on the way out, stop it and wait until it is at rest."""
    page: Page = app.state.page
    watching = asyncio.create_task(page.live.keep_looking(), name="live")
    try:
        yield
    finally:
        stopped = page.attendant.stop()
        if stopped is not None:
            page.audit.add("page", "stop: the server ends", axis=stopped.asked.axis)
            deadline_s = page.clock.now() + STOP_PATIENCE_S
            while page.attendant.active and page.clock.now() < deadline_s:
                await asyncio.sleep(0.05)
        page.looking.end()
        watching.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await watching
        page.store.close()
