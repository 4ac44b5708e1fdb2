"""A cycle: its dry run, its start, its course, its stop."""

from __future__ import annotations

import logging
import math
from typing import Annotated

import anyio
from fastapi import APIRouter, Depends, Form, Header, Query, Request, Response
from fastapi.responses import JSONResponse, StreamingResponse
from starlette.responses import RedirectResponse

from agent.cell.cell import Axis, Cell
from agent.cycle.stage import Stage
from agent.errors import AgentError, InputError
from agent.record.atomic import storage_error
from agent.web.access import TurnedAwayError, need, page_of, session_of
from agent.web.cycles import (
    CYCLES,
    Cycle,
    DryRun,
    Judgement,
    cycles_of,
    dry_run,
    judgements,
)
from agent.web.live import MOST_VIEWERS, state_of
from agent.web.locks import ask_to_stop
from agent.web.looking import Look
from agent.web.rendering import chosen_language, render
from agent.web.roles import Role
from agent.web.sessions import Session
from agent.web.tail import POINT_PERIOD_S
from agent.web.words.language import say

router = APIRouter()
log = logging.getLogger(__name__)
STAGES = ("begin", "connect", "prove", *(stage.value for stage in Stage), "stopping")
"""Everything that a cycle's progress may say, and our own word for a stop."""
PLAN_POINTS = 1500

Viewer = Annotated[Session, Depends(need(Role.VIEWER))]
Polling = Annotated[Session, Depends(need(Role.VIEWER, used=False))]
Technician = Annotated[Session, Depends(need(Role.TECHNICIAN))]
PollingTechnician = Annotated[Session, Depends(need(Role.TECHNICIAN, used=False))]
Word = Annotated[str, Query(alias="cycle", max_length=20)]


@router.get("/axes/{number}/start")
async def ask_to_start(
    request: Request, _session: Technician, number: int, word: Word = "stair"
) -> Response:
    """Show what would be driven, and what must hold before."""
    cell, axis, cycle = _asked(request, number, word)
    run = await anyio.to_thread.run_sync(dry_run, cell, axis, cycle)
    look = await _looked_at(request, axis)
    return render(
        request,
        "start.html.j2",
        axis=axis,
        cycle=cycle,
        cycles=cycles_of(axis),
        run=run,
        conditions=await _judged(request, cell, axis, cycle, look),
        look=look,
        persons_word=_persons_word(cell, axis),
        plan=_plan(run),
    )


@router.get("/axes/{number}/preconditions")
async def show_preconditions(
    request: Request, _session: PollingTechnician, number: int, word: Word = "stair"
) -> Response:
    """Show the preconditions as they stand now; the start page asks every two seconds."""
    cell, axis, cycle = _asked(request, number, word)
    look = await _looked_at(request, axis)
    conditions = await _judged(request, cell, axis, cycle, look)
    return render(request, "preconditions.html.j2", conditions=conditions, look=look)


@router.post("/axes/{number}/start")
async def start(
    request: Request,
    session: Technician,
    number: int,
    word: Annotated[str, Form(alias="cycle", max_length=20)],
    confirmed: Annotated[str, Form(max_length=3)] = "",
) -> Response:
    """Start a cycle, once a person has confirmed; refused where a precondition does not hold.

    What was only seen of the devices refuses nothing here: the cycle asks them itself.
    """
    page = page_of(request)
    cell, axis, cycle = _asked(request, number, word)
    if confirmed != "yes":
        raise TurnedAwayError(422, "confirm_first")
    if page.attendant.active is not None:
        raise TurnedAwayError(409, "already_running")
    refused = [
        c.reason for c in await _judged(request, cell, axis, cycle) if c.verdict == "refused"
    ]
    trajectory = dry_run(cell, axis, cycle).trajectory
    if refused or trajectory is None:
        page.audit.add(session.name, "start refused", axis=number, cycle=cycle.word)
        raise TurnedAwayError(409, "preconditions_refuse", "; ".join(refused))
    page.audit.add(session.name, "start", axis=number, cycle=cycle.word, confirmed="yes")
    await anyio.to_thread.run_sync(page.looking.end)
    try:
        started = page.attendant.start(cell, axis, cycle, trajectory, session.name)
    except OSError as error:
        raise storage_error(error, "The run's folder or process cannot be made") from error
    if started is None:
        raise TurnedAwayError(409, "already_running")
    return RedirectResponse("/run", 303)


@router.get("/run")
async def show_run(request: Request, _session: Viewer) -> Response:
    """Show the running cycle, or how the last one ended."""
    run = page_of(request).attendant.run
    stages = {word: say(chosen_language(request), f"stage_{word}") for word in STAGES}
    state = None if run is None else state_of(run)
    return render(request, "run.html.j2", run=run, state=state, stages=stages)


@router.get("/run/live")
async def stream_run(
    request: Request,
    _session: Polling,
    last_event_id: Annotated[str, Header(max_length=100)] = "",
) -> Response:
    """Stream the running cycle; a browser that comes back goes on where it was cut off."""
    page = page_of(request)
    run = page.attendant.run
    if run is None:
        return Response(status_code=204)  # nothing to come back for
    if page.live.viewers >= MOST_VIEWERS:
        raise TurnedAwayError(503, "too_many_viewers")
    identity, _, count = last_event_id.rpartition(".")
    known = identity == run.identity and count.isdecimal() and len(count) < 9
    seen = int(count) if known else 0
    return StreamingResponse(
        page.live.events(run, seen),
        media_type="text/event-stream",
        headers={"x-accel-buffering": "no"},
    )


@router.post("/stop")
async def stop(
    request: Request, sec_fetch_site: Annotated[str, Header(max_length=40)] = ""
) -> Response:
    """Ask the running cycle to stop: by anybody, without log-in, from every page.

    Not an E-stop. Only a page of another site, of which the browser tells, is refused.
    """
    if sec_fetch_site not in ("", "same-origin", "same-site", "none"):
        raise TurnedAwayError(403, "form_not_ours")
    page = page_of(request)
    run = page.attendant.stop()  # first of all: what comes next only tells of it
    elsewhere = [(holder, ask_to_stop(holder)) for _axis, holder in page.elsewhere()]
    session = session_of(request)
    address = request.client.host if request.client is not None else "unknown"
    who = "nobody" if session is None else session.name
    try:
        if run is not None:
            page.audit.add(who, "stop", axis=run.asked.axis, run=run.identity, address=address)
        for holder, asked in elsewhere:
            page.audit.add(who, "stop", of=holder.who, asked=asked, address=address)
    except AgentError as error:  # a stop that was asked for must not be told as one that was not
        log.error("the stop is not in the audit trail: %s", error)
    if not all(asked for _holder, asked in elsewhere):
        raise TurnedAwayError(409, "stop_of_others")
    return RedirectResponse("/stopped", 303)


@router.get("/stopped")
async def show_stopped(request: Request) -> Response:
    """Show, without log-in, what became of the stop."""
    page = page_of(request)
    return render(request, "stopped.html.j2", run=page.attendant.run, elsewhere=page.elsewhere())


@router.get("/status")
async def status(request: Request) -> Response:
    """Say, without log-in, whether a cycle runs, so that its stop can be shown on every page."""
    page = page_of(request)
    run = page.attendant.active
    if run is None:
        held = page.elsewhere()
        return JSONResponse({"active": True, "axis": held[0][0]} if held else {"active": False})
    state = state_of(run)
    return JSONResponse({"active": True, "axis": run.asked.axis, "stopping": state["stopping"]})


def axis_numbered(cell: Cell, number: int) -> Axis:
    """Return one axis, or say that it is not there."""
    try:
        return cell.axis_numbered(number)
    except InputError as error:
        raise TurnedAwayError(404, "not_there") from error


def _asked(request: Request, number: int, word: str) -> tuple[Cell, Axis, Cycle]:
    cell = page_of(request).cell
    axis = axis_numbered(cell, number)
    cycle = CYCLES.get(word)
    if cycle is None or cycle not in cycles_of(axis):
        raise TurnedAwayError(404, "not_there")
    return cell, axis, cycle


async def _looked_at(request: Request, axis: Axis) -> Look | None:
    """Return what the devices say; nobody is asked while a cycle of this page has them."""
    page = page_of(request)
    if page.attendant.active is not None:
        return None
    return await anyio.to_thread.run_sync(page.looking.ask, axis.number)


async def _judged(
    request: Request, cell: Cell, axis: Axis, cycle: Cycle, look: Look | None = None
) -> list[Judgement]:
    page = page_of(request)
    found = await anyio.to_thread.run_sync(judgements, cell, axis, cycle, page.recordings, look)
    if page.attendant.active is not None:
        found.append(Judgement("nothing else runs", "refused", "a cycle of this page is running"))
    return found


def _plan(run: DryRun) -> dict[str, list[float]] | None:
    """Return the planned velocity for the browser: s and rad/s."""
    if run.trajectory is None:
        return None
    points = min(PLAN_POINTS, math.ceil(run.trajectory.duration_s / POINT_PERIOD_S) + 1)
    step_s = run.trajectory.duration_s / (points - 1)
    times = [step_s * i for i in range(points)]
    velocity = run.trajectory.sample(times).velocity_rad_s
    return {"t": [round(t, 3) for t in times], "v": [round(float(v), 2) for v in velocity]}


def _persons_word(cell: Cell, axis: Axis) -> bool:
    """Return whether nobody but a person guarantees mode and stops of this cell."""
    return cell.release is None and axis.job is None
