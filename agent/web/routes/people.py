"""Logging in and out, the lock, the first user, everybody else, and who did what."""

from __future__ import annotations

from typing import Annotated

import anyio
from fastapi import APIRouter, Depends, Form, Query, Request, Response
from starlette.responses import RedirectResponse

from agent.errors import AgentError
from agent.web.access import (
    TurnedAwayError,
    cookie_name,
    insist_on_our_own_form,
    local_path,
    need,
    page_of,
    session_of,
    token_of,
)
from agent.web.rendering import LANGUAGE_COOKIE, render
from agent.web.roles import Role
from agent.web.sessions import LONGEST_S, Session
from agent.web.words.language import LANGUAGES

router = APIRouter()
# Hashing takes 64 MiB a time on purpose: two at once are enough for a shop floor.
_hashing = anyio.CapacityLimiter(2)

Name = Annotated[str, Form(max_length=64)]
Secret = Annotated[str, Form(max_length=200)]
Back = Annotated[str, Query(max_length=300)]


@router.get("/login")
async def ask_to_log_in(request: Request, back: Back = "/") -> Response:
    """Show the form; the very first visitor is shown the way to the first user."""
    if not page_of(request).users.all():
        return RedirectResponse("/welcome", 303)
    return render(request, "login.html.j2", back=local_path(back), name="", trouble="", wait_s=0)


@router.post("/login")
async def log_in(request: Request, name: Name, password: Secret, back: Back = "/") -> Response:
    """Begin a session, or say that name and password do not fit, never which of them."""
    insist_on_our_own_form(request)
    page, address = page_of(request), _address(request)
    keys = (f"name {name.casefold()}", f"address {address}")
    back = local_path(back)
    wait_s = page.attempts.wait_s(*keys)
    if wait_s > 0.0:
        return render(
            request,
            "login.html.j2",
            status=429,
            back=back,
            name=name,
            trouble="too_many",
            wait_s=round(wait_s + 0.5),
        )
    page.attempts.failed(*keys)  # before it is known: tries that come together count, too
    user = await anyio.to_thread.run_sync(page.users.authenticate, name, password, limiter=_hashing)
    if user is None:
        page.audit.add("nobody", "log-in refused", name=name, address=address)
        return render(
            request, "login.html.j2", status=401, back=back, name=name, trouble="wrong", wait_s=0
        )
    page.attempts.worked(*keys)
    page.sessions.end(token_of(request))
    token, _session = page.sessions.begin(user.name, user.role)
    page.audit.add(user.name, "logged in", address=address)
    return _with_session(request, RedirectResponse(back, 303), token)


@router.get("/unlock")
async def ask_to_unlock(request: Request, back: Back = "/") -> Response:
    """Ask the user of a locked session for the password again."""
    session = session_of(request)
    if session is None:
        return RedirectResponse("/login", 303)
    return render(
        request,
        "login.html.j2",
        back=local_path(back),
        name=session.name,
        trouble="locked",
        wait_s=0,
    )


@router.post("/lock")
async def lock(
    request: Request, session: Annotated[Session, Depends(need(Role.VIEWER))]
) -> Response:
    """Lock the session now: the tablet is put down."""
    page_of(request).sessions.lock(token_of(request))
    page_of(request).audit.add(session.name, "session locked")
    return RedirectResponse("/unlock", 303)


@router.post("/logout")
async def log_out(
    request: Request, session: Annotated[Session, Depends(need(Role.VIEWER))]
) -> Response:
    """End the session."""
    page_of(request).sessions.end(token_of(request))
    page_of(request).audit.add(session.name, "logged out")
    answer = RedirectResponse("/login", 303)
    answer.delete_cookie(cookie_name(request))
    return answer


@router.get("/welcome")
async def ask_for_token(request: Request) -> Response:
    """Ask for a one-time token, a name and a password."""
    return render(request, "welcome.html.j2", trouble="", name="", fresh=_nobody_yet(request))


@router.post("/welcome")
async def accept_token(
    request: Request,
    token: Annotated[str, Form(max_length=100)],
    password: Secret,
    again: Secret,
    name: Name = "",
) -> Response:
    """Make the user whom a token invites, and log them in."""
    insist_on_our_own_form(request)
    page, key = page_of(request), f"token {_address(request)}"
    fresh = _nobody_yet(request)
    trouble, status = "", 422
    if (wait_s := page.attempts.wait_s(key)) > 0.0:
        trouble, status = f"{wait_s:.0f} s", 429
    elif password != again:
        trouble = "The two passwords differ."
    else:
        try:
            page.attempts.failed(key)
            user = await anyio.to_thread.run_sync(
                page.users.accept, token.strip(), name.strip(), password, limiter=_hashing
            )
        except AgentError as error:
            trouble = str(error)
    if trouble:
        return render(
            request, "welcome.html.j2", status=status, trouble=trouble, name=name, fresh=fresh
        )
    page.attempts.worked(key)
    page.sessions.end_all_of(user.name)
    session_token, _session = page.sessions.begin(user.name, user.role)
    page.audit.add(user.name, "password chosen", role=user.role.word, address=_address(request))
    return _with_session(request, RedirectResponse("/", 303), session_token)


@router.get("/users")
async def show_users(
    request: Request, _session: Annotated[Session, Depends(need(Role.ENGINEER))]
) -> Response:
    """Show everybody who may log in."""
    return render(
        request, "users.html.j2", users=page_of(request).users.all(), token="", name="", trouble=""
    )


@router.post("/users")
async def invite(
    request: Request,
    session: Annotated[Session, Depends(need(Role.ENGINEER))],
    name: Name,
    role: Annotated[str, Form(max_length=20)],
) -> Response:
    """Make a one-time token for somebody; it is shown once."""
    page, token, trouble = page_of(request), "", ""
    try:
        if not name:
            raise TurnedAwayError(422, "form_unusable")
        token = page.users.invite(name, Role.of(role))
        page.audit.add(session.name, "user invited", name=name, role=role)
    except (AgentError, ValueError) as error:
        trouble = str(error)
    return render(
        request,
        "users.html.j2",
        status=422 if trouble else 200,
        users=page.users.all(),
        token=token,
        name=name,
        trouble=trouble,
    )


@router.post("/users/{name}/disable")
async def disable(
    request: Request, session: Annotated[Session, Depends(need(Role.ENGINEER))], name: str
) -> Response:
    """Let somebody log in no more."""
    page = page_of(request)
    page.users.disable(name)
    page.sessions.end_all_of(name)
    page.audit.add(session.name, "user disabled", name=name)
    return RedirectResponse("/users", 303)


@router.get("/audit")
async def show_audit(
    request: Request, _session: Annotated[Session, Depends(need(Role.ENGINEER))]
) -> Response:
    """Show the newest lines of the audit trail."""
    return render(request, "audit.html.j2", entries=page_of(request).audit.newest(200))


@router.get("/language/{language}")
async def choose_language(request: Request, language: str, back: Back = "/") -> Response:
    """Remember the reader's language in this browser."""
    if language not in LANGUAGES:
        raise TurnedAwayError(404, "not_there")
    answer = RedirectResponse(local_path(back), 303)
    answer.set_cookie(
        LANGUAGE_COOKIE,
        language,
        max_age=365 * 86400,
        samesite="strict",
        httponly=True,
        secure=page_of(request).settings.secure,
    )
    return answer


def _with_session(request: Request, answer: Response, token: str) -> Response:
    answer.set_cookie(
        cookie_name(request),
        token,
        max_age=int(LONGEST_S),
        path="/",
        httponly=True,
        samesite="strict",
        secure=page_of(request).settings.secure,
    )
    return answer


def _nobody_yet(request: Request) -> bool:
    return not page_of(request).users.all()


def _address(request: Request) -> str:
    return request.client.host if request.client is not None else "unknown"
