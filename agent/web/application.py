"""The page put together: settings in, an ASGI application out; nothing happens on import."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.resources
from collections.abc import AsyncIterator

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles

from agent.record.audit import AuditTrail
from agent.web import failures
from agent.web.attended import Attendant, Launch
from agent.web.guard import Guard
from agent.web.limits import Attempts
from agent.web.live import Live
from agent.web.looking import Looking
from agent.web.page import Page
from agent.web.passwords import Argon2, Hasher
from agent.web.roles import Role
from agent.web.routes import cell, history, people, results, run
from agent.web.sessions import Sessions
from agent.web.settings import PageSettings
from agent.web.shelf import Shelf
from agent.web.store import Store
from agent.web.users import Users
from drivers.clock import Clock, MonotonicClock

STOP_PATIENCE_S = 15.0
"""How long an ending server waits until its cycle is at rest and recorded."""


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
    for module in (people, cell, run, results, history):
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
        with contextlib.suppress(asyncio.CancelledError):  # by the line above
            await watching
        page.store.close()
