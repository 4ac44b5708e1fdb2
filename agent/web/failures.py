"""What is said when a request cannot be served: a page for people, never a trace."""

from __future__ import annotations

import logging
from urllib.parse import quote

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import RedirectResponse

from agent.errors import AgentError
from agent.web.access import READING, TurnedAwayError
from agent.web.rendering import render

_KEYS = {404: "not_there", 405: "not_there", 413: "too_large"}
log = logging.getLogger(__name__)


def install(app: FastAPI) -> None:
    """Let the application answer its errors by these pages."""
    app.add_exception_handler(TurnedAwayError, turned_away)
    app.add_exception_handler(RequestValidationError, unusable)
    app.add_exception_handler(HTTPException, other)
    app.add_exception_handler(AgentError, agents_own)
    app.add_exception_handler(Exception, our_fault)


async def turned_away(request: Request, error: Exception) -> Response:
    """Send somebody without log-in there, and tell others why."""
    if not isinstance(error, TurnedAwayError):
        raise error
    if error.status == 401:
        where = "/unlock" if error.locked else "/login"
        to = f"{where}?back={quote(request.url.path)}"
        if "hx-request" in request.headers:
            return Response(status_code=401, headers={"hx-redirect": where})
        accepts = request.headers.get("accept", "*/*")
        if request.method in READING and "text/event-stream" not in accepts:
            return RedirectResponse(to, 303)
    return _problem(request, error.status, error.key, error.detail)


async def unusable(request: Request, _error: Exception) -> Response:
    """Say that a form lacks something; what it held is not repeated."""
    return _problem(request, 422, "form_unusable")


async def other(request: Request, error: Exception) -> Response:
    """Say what the framework found."""
    status = error.status_code if isinstance(error, HTTPException) else 500
    return _problem(request, status, _KEYS.get(status, "form_unusable"))


async def agents_own(request: Request, error: Exception) -> Response:
    """Say what the agent could not use or write."""
    return _problem(request, 409, "not_possible", str(error))


async def our_fault(request: Request, error: Exception) -> Response:
    """Say that it is our own fault; the trace goes to the log alone."""
    log.error("page failed: %s %s", request.method, request.url.path, exc_info=error)
    return _problem(request, 500, "our_fault")


def _problem(request: Request, status: int, key: str, detail: str = "") -> Response:
    return render(request, "problem.html.j2", status=status, key=key, detail=detail)
