"""An axis over time, what happened to it, and the alarms that somebody has to look at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import anyio
from fastapi import APIRouter, Depends, Form, Request, Response
from starlette.responses import RedirectResponse

from agent.record.events_file import Event, append_event
from agent.web.access import TurnedAwayError, need, page_of
from agent.web.page import Page
from agent.web.rendering import render
from agent.web.roles import Role
from agent.web.routes.run import axis_numbered
from agent.web.sessions import Session
from agent.web.shelf import Shelved
from agent.web.verdicts import finding
from drivers.clock import wall_time_utc

router = APIRouter()

Viewer = Annotated[Session, Depends(need(Role.VIEWER))]
Technician = Annotated[Session, Depends(need(Role.TECHNICIAN))]
KINDS = ("swap", "oil-change", "relubrication", "other")
"""What people note: the monitor's words for what starts a new baseline."""
SAME = {"oil": "oil-change"}
"""What `stribeck catalogue note` calls otherwise."""
ACKNOWLEDGED = "acknowledged"
SHOWN = 400


@dataclass(frozen=True)
class Alarm:
    """A cycle whose verdict is bad news, and who has looked at it."""

    cycle: Shelved
    acknowledged: Event | None


@router.get("/axes/{number}")
async def show_history(request: Request, _session: Viewer, number: int) -> Response:
    """Show an axis over time."""
    page = page_of(request)
    axis = axis_numbered(page.cell, number)
    own = await anyio.to_thread.run_sync(page.shelf.look, page.recordings, page.cell.robot, number)
    events = [
        replace(event, kind=SAME.get(event.kind, event.kind))
        for event in page.shelf.events(page.recordings, page.cell.robot, number)
        if SAME.get(event.kind, event.kind) in KINDS
    ]
    chosen = page.baseline(number)
    return render(
        request,
        "history.html.j2",
        axis=axis,
        events=events,
        kinds=KINDS,
        cycles=[finding(cycle, own, chosen) for cycle in own[:SHOWN]],
        chart=trend_of(own, events),
    )


@router.post("/axes/{number}/events")
async def note_event(
    request: Request,
    session: Technician,
    number: int,
    kind: Annotated[str, Form(max_length=20)],
    note: Annotated[str, Form(max_length=500)] = "",
) -> Response:
    """Note what was done to an axis; from now on its cycles belong to another baseline."""
    page = page_of(request)
    axis_numbered(page.cell, number)
    if kind not in KINDS:
        raise TurnedAwayError(422, "form_unusable")
    text = " ".join(note.split())
    page.recordings.mkdir(parents=True, exist_ok=True)
    append_event(
        page.recordings,
        Event(wall_time_utc(), kind, text, page.cell.robot, number, by=session.name),
    )
    page.audit.add(session.name, "event noted", axis=number, kind=kind, note=text)
    return RedirectResponse(f"/axes/{number}", 303)


@router.get("/alarms")
async def show_alarms(request: Request, _session: Viewer) -> Response:
    """Show every alarm, those that nobody has acknowledged first."""
    alarms = await anyio.to_thread.run_sync(alarms_of, page_of(request))
    return render(request, "alarms.html.j2", alarms=alarms)


@router.post("/alarms/{name}")
async def acknowledge(
    request: Request,
    session: Technician,
    name: str,
    note: Annotated[str, Form(max_length=500)],
) -> Response:
    """Acknowledge an alarm with a note: what was seen, what will be done."""
    page = page_of(request)
    text = " ".join(note.split())
    alarm = next((a for a in alarms_of(page) if a.cycle.name == name), None)
    if alarm is None:
        raise TurnedAwayError(404, "not_there")
    if not text:
        raise TurnedAwayError(422, "note_first")
    if alarm.acknowledged is not None:
        raise TurnedAwayError(409, "acknowledged_already")
    cycle = alarm.cycle
    hash_ = cycle.verdict.recording_sha256 if cycle.verdict is not None else ""
    append_event(
        page.recordings,
        Event(
            wall_time_utc(),
            ACKNOWLEDGED,
            text,
            cycle.metadata.robot,
            cycle.axis,
            hash_,
            session.name,
            {"name": name},
        ),
    )
    page.audit.add(session.name, "alarm acknowledged", recording=name, note=text)
    return RedirectResponse("/alarms", 303)


def alarms_of(page: Page) -> list[Alarm]:
    """Return every alarm of the cell: unacknowledged first, then the newest first."""
    robot = page.cell.robot
    looked_at = {
        str(event.details.get("name", "")): event
        for event in page.shelf.events(page.recordings, robot)
        if event.kind == ACKNOWLEDGED
    }
    alarms = [
        Alarm(cycle, looked_at.get(cycle.name))
        for cycle in page.shelf.look(page.recordings, robot)
        if cycle.verdict is not None and cycle.verdict.alarm
    ]
    return sorted(alarms, key=lambda alarm: alarm.acknowledged is not None)


def trend_of(own: Sequence[Shelved], events: Sequence[Event]) -> dict[str, Any] | None:
    """Return an axis over time for the browser; None with fewer than two decidable cycles.

    N m, N m s/rad and degC, with the ends of the 95 % intervals; null is unknown.
    """
    good = sorted((c for c in own if c.decidable), key=lambda c: c.started_at)[-SHOWN:]
    if len(good) < 2:
        return None
    chart: dict[str, Any] = {
        "at": [c.started_at for c in good],
        "name": [c.name for c in good],
        "temperature": [c.temperature_degc for c in good],
        "alarm": [c.verdict is not None and c.verdict.alarm for c in good],
        "events": [{"at": e.at, "kind": e.kind, "text": e.text} for e in events],
    }
    for parameter in ("coulomb_nm", "viscous_nm_s_per_rad"):
        chart[parameter] = [_plain(c, parameter) for c in good]
    return chart


def _plain(cycle: Shelved, parameter: str) -> list[float | None]:
    """Return value, lower and upper end of a parameter of the plain law, the same for all."""
    models = (cycle.estimate or {}).get("friction_models")
    for model in models if isinstance(models, list) else ():
        if isinstance(model, dict) and model.get("model") == "coulomb-viscous":
            found = (model.get("parameters") or {}).get(parameter) or {}
            ends = found.get("ci95") or [None, None]
            return [_number(found.get("value")), _number(ends[0]), _number(ends[1])]
    return [None, None, None]


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None
