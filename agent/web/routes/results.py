"""A finished cycle: what it says, its curve, its files."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Annotated, Any

import anyio
from fastapi import APIRouter, Depends, Request, Response
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask
from starlette.responses import RedirectResponse

from agent.web import convert
from agent.web.access import TurnedAwayError, need, page_of
from agent.web.against import Curve, curve_of
from agent.web.guard import REPORT_POLICY
from agent.web.rendering import render
from agent.web.roles import Role
from agent.web.sessions import Session
from agent.web.shelf import Shelved
from agent.web.verdicts import Finding, finding

router = APIRouter()

Viewer = Annotated[Session, Depends(need(Role.VIEWER))]
MADE = {"csv": "text/csv", "mdf4": "application/octet-stream", "pdf": "application/pdf"}
SUFFIX = {"csv": "csv", "mdf4": "mf4", "pdf": "pdf"}
CONVERSION_S = 120.0
_converting = anyio.CapacityLimiter(1)


@router.get("/results/{name}")
async def show_result(request: Request, _session: Viewer, name: str) -> Response:
    """Show what a cycle says."""
    found = await anyio.to_thread.run_sync(_found, request, name)
    return render(
        request,
        "result.html.j2",
        finding=found,
        cycle=found.cycle,
        chart=chart_of(found),
        rigid=_part(found.cycle, "rigid_body"),
        quality=_part(found.cycle, "quality"),
        model=_selected(found.cycle),
        exports=convert.available(),
    )


@router.get("/results/{name}/report")
async def show_report(request: Request, _session: Viewer, name: str) -> Response:
    """Give the offline report: one file that needs nothing else."""
    cycle = (await anyio.to_thread.run_sync(_found, request, name)).cycle
    if not cycle.report.is_file():
        raise TurnedAwayError(404, "not_there")
    return FileResponse(
        cycle.report, media_type="text/html", headers={"content-security-policy": REPORT_POLICY}
    )


@router.get("/results/{name}/explanation")
async def show_explanation(request: Request, _session: Viewer, name: str) -> Response:
    """Give the explanation page, where there is one."""
    cycle = (await anyio.to_thread.run_sync(_found, request, name)).cycle
    if cycle.explanation is None:
        raise TurnedAwayError(404, "not_there")
    return FileResponse(
        cycle.explanation,
        media_type="text/html",
        headers={"content-security-policy": REPORT_POLICY},
    )


@router.get("/results/{name}/download/{kind}")
async def download(request: Request, _session: Viewer, name: str, kind: str) -> Response:
    """Give a cycle's file: report, recording, estimate as they are; the rest is made for it."""
    cycle = (await anyio.to_thread.run_sync(_found, request, name)).cycle
    there = {
        "report": cycle.report,
        "parquet": cycle.path,
        "estimate": cycle.path.with_suffix(".estimate.json"),
    }
    if kind in there:
        if not there[kind].is_file():
            raise TurnedAwayError(404, "not_there")
        return FileResponse(there[kind], filename=there[kind].name)
    if kind not in MADE or kind not in convert.available():
        raise TurnedAwayError(404, "not_there")
    made = await _made(cycle, kind)
    return FileResponse(
        made,
        filename=f"{cycle.name}.{SUFFIX[kind]}",
        media_type=MADE[kind],
        background=BackgroundTask(made.unlink, missing_ok=True),
    )


@router.post("/results/{name}/baseline")
async def choose_baseline(
    request: Request, session: Annotated[Session, Depends(need(Role.ENGINEER))], name: str
) -> Response:
    """Let this cycle be what others of its axis are held against."""
    page = page_of(request)
    cycle = (await anyio.to_thread.run_sync(_found, request, name)).cycle
    if not cycle.decidable or cycle.stopped_because:
        raise TurnedAwayError(409, "no_baseline")
    page.choose_baseline(cycle.axis, cycle.name, session.name)
    page.audit.add(session.name, "baseline chosen", axis=cycle.axis, recording=cycle.name)
    return RedirectResponse(f"/results/{cycle.name}", 303)


def chart_of(found: Finding) -> dict[str, Any] | None:
    """Return the curves for the browser; rad/s and N m, intervals as lower and upper end."""
    now = curve_of(found.cycle.estimate) if found.cycle.decidable else None
    if now is None:
        return None
    other = found.baseline if found.kind != "baseline" else None
    then = curve_of(other.estimate) if other is not None else None
    return {
        "now": _listed(now),
        "baseline": None if then is None else _listed(then),
        "difference": None if found.change is None else _listed(found.change.difference),
    }


def _listed(curve: Curve) -> dict[str, list[float]]:
    low, high = curve.friction_nm - curve.half_ci95_nm, curve.friction_nm + curve.half_ci95_nm
    columns = {"v": curve.velocity_rad_s, "f": curve.friction_nm, "low": low, "high": high}
    return {name: [round(float(x), 6) for x in values] for name, values in columns.items()}


def _found(request: Request, name: str) -> Finding:
    page = page_of(request)
    shelved = page.shelf.look(page.recordings, page.cell.robot)
    cycle = next((c for c in shelved if c.name == name), None)
    if cycle is None:
        raise TurnedAwayError(404, "not_there")
    own = [c for c in shelved if c.axis == cycle.axis]
    return finding(cycle, own, page.baseline(cycle.axis))


def _part(cycle: Shelved, name: str) -> dict[str, Any]:
    part = (cycle.estimate or {}).get(name)
    return part if isinstance(part, dict) else {}


def _selected(cycle: Shelved) -> dict[str, Any]:
    models = (cycle.estimate or {}).get("friction_models")
    chosen = (m for m in models or () if isinstance(m, dict) and m.get("selected") is True)
    return next(chosen, {})


async def _made(cycle: Shelved, kind: str) -> Path:
    """Make a file in a process of its own: the page stays small and quick beside it."""
    with tempfile.NamedTemporaryFile(suffix=f".{SUFFIX[kind]}", delete=False) as file:
        out = Path(file.name)
    command = [sys.executable, "-m", "agent.web.convert", kind, str(cycle.path), str(out)]
    done = 1
    try:
        async with _converting:
            with anyio.fail_after(CONVERSION_S):
                process = await anyio.run_process(command, check=False)
        done = process.returncode
    except TimeoutError:
        done = 1
    if done != 0:
        out.unlink(missing_ok=True)
        raise TurnedAwayError(409, "cannot_be_made")
    return out
