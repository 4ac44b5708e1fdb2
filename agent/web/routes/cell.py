"""The cell: its axes as cards."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import anyio
from fastapi import APIRouter, Depends, Request, Response

from agent.cell.cell import Axis
from agent.errors import AgentError
from agent.night.description import night_path, read_night
from agent.night.windows import windows_between
from agent.web.access import need, page_of
from agent.web.locks import holder
from agent.web.page import Page
from agent.web.rendering import render
from agent.web.roles import Role
from agent.web.sessions import Session
from agent.web.shelf import Shelved
from agent.web.verdicts import Finding, finding
from drivers.clock import wall_time_utc

router = APIRouter()
AHEAD_DAYS = 8


@dataclass(frozen=True)
class Card:
    """One axis as the cell view shows it."""

    axis: Axis
    newest: Shelved | None
    finding: Finding | None
    age_days: float | None
    next_run: str
    held_by: str
    running: bool


@router.get("/")
async def show_cell(
    request: Request, _session: Annotated[Session, Depends(need(Role.VIEWER))]
) -> Response:
    """Show every axis."""
    cards = await anyio.to_thread.run_sync(cards_of, page_of(request))
    return render(request, "cell.html.j2", cards=cards)


@router.get("/cards")
async def show_cards(
    request: Request, _session: Annotated[Session, Depends(need(Role.VIEWER, used=False))]
) -> Response:
    """Show the cards alone; the cell view asks every five seconds."""
    cards = await anyio.to_thread.run_sync(cards_of, page_of(request))
    return render(request, "cards.html.j2", cards=cards)


def cards_of(page: Page) -> list[Card]:
    """Return a card for each axis of the cell."""
    cell, active = page.cell, page.attendant.active
    shelved = page.shelf.look(page.recordings, cell.robot)
    cards = []
    for axis in cell.axis:
        own = [cycle for cycle in shelved if cycle.axis == axis.number]
        newest = own[0] if own else None
        running = active is not None and active.asked.axis == axis.number
        cards.append(
            Card(
                axis=axis,
                newest=newest,
                finding=None
                if newest is None
                else finding(newest, own, page.baseline(axis.number)),
                age_days=None if newest is None else age_days(newest.started_at, wall_time_utc()),
                next_run=next_run(page.settings.cell_path, axis.number, wall_time_utc()),
                held_by="" if running else holder(cell, axis),
                running=running,
            )
        )
    return cards


def next_run(cell_path: Path, number: int, now: str) -> str:
    """Return when an axis's next quiet window begins, ISO 8601; empty where none is described."""
    path = night_path(cell_path)
    if not path.exists():
        return ""
    try:
        night = read_night(path)
        since = datetime.datetime.fromisoformat(now)
    except (AgentError, ValueError):
        return ""
    until = since + datetime.timedelta(days=AHEAD_DAYS)
    begins = [
        window.begins
        for axis in night.axis
        if axis.number == number
        for window in windows_between(axis, night.zone, since, until)
        if window.begins > since
    ]
    return min(begins).isoformat() if begins else ""


def age_days(then: str, now: str) -> float | None:
    """Return how many days lie between two labels of ISO 8601; None where one is none."""
    try:
        ends = [datetime.datetime.fromisoformat(text) for text in (then, now)]
    except ValueError:
        return None
    earlier, later = (e if e.tzinfo is not None else e.replace(tzinfo=datetime.UTC) for e in ends)
    return (later - earlier).total_seconds() / 86400.0
