"""Who may: the session of a request, its role, and proof that our own form sent it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from urllib.parse import urlsplit

from fastapi import Request
from starlette.datastructures import FormData

from agent.web.guard import host_name
from agent.web.page import Page
from agent.web.roles import Role
from agent.web.sessions import Session

PLAIN_COOKIE = "stribeck_session"
SECURE_COOKIE = "__Host-stribeck_session"
READING = ("GET", "HEAD")


class TurnedAwayError(Exception):
    """A request that is not let through.

    Parameters
    ----------
    status : int
        HTTP's word for it: 401 log in first, 403 not for you, 404 not there, 409 not now, ...
    key : str
        What the page says, in `agent.web.words.language`.
    detail : str
        The engine's own sentence (English), where it has one.
    locked : bool
        Whether the session is only locked.
    """

    def __init__(self, status: int, key: str, detail: str = "", *, locked: bool = False) -> None:
        super().__init__(key)
        self.status = status
        self.key = key
        self.detail = detail
        self.locked = locked


def page_of(request: Request) -> Page:
    """Return what the application stands on."""
    page: Page = request.app.state.page
    return page


def cookie_name(request: Request) -> str:
    """Return the session cookie's name: with TLS, one that no other site can set."""
    return SECURE_COOKIE if page_of(request).settings.secure else PLAIN_COOKIE


def token_of(request: Request) -> str | None:
    """Return the session token that the browser sent."""
    return request.cookies.get(cookie_name(request))


def session_of(request: Request, *, used: bool = False) -> Session | None:
    """Return the session of a request, locked or not; None for somebody without log-in."""
    return page_of(request).sessions.find(token_of(request), used=used)


def need(role: Role, *, used: bool = True) -> Callable[[Request], Awaitable[Session]]:
    """Return the dependency that lets through who has at least this role.

    Parameters
    ----------
    role : Role
        The least.
    used : bool
        False for what a page asks by itself: that keeps no session alive.
    """

    async def insist(request: Request) -> Session:
        session = session_of(request, used=used)
        if session is None:
            raise TurnedAwayError(401, "log_in_first")
        if session.locked:
            raise TurnedAwayError(401, "session_locked", locked=True)
        if request.method not in READING:
            insist_on_our_own_form(request)
            if not session.carries(await _csrf(request)):
                raise TurnedAwayError(403, "form_not_ours")
        user = page_of(request).users.find(session.name)
        if user is None or user.disabled:
            page_of(request).sessions.end_all_of(session.name)
            raise TurnedAwayError(401, "log_in_first")
        if user.role < role:
            raise TurnedAwayError(403, "not_your_role")
        return session

    return insist


def insist_on_our_own_form(request: Request) -> None:
    """Refuse a request that a page of another origin sent; browsers say where a form came from."""
    if request.headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        raise TurnedAwayError(403, "form_not_ours")
    origin = request.headers.get("origin")
    if origin is not None and _host(origin) != host_name(request.headers.get("host", "")):
        raise TurnedAwayError(403, "form_not_ours")


def local_path(path: str) -> str:
    """Return `path` when it leads to this page; its beginning otherwise."""
    printable = path.isascii() and path.isprintable()
    local = printable and path.startswith("/") and not path.startswith("//") and "\\" not in path
    return path if local else "/"


def _host(origin: str) -> str:
    try:
        return (urlsplit(origin).hostname or "").lower()
    except ValueError:
        return ""


async def _csrf(request: Request) -> str:
    header = request.headers.get("x-csrf-token")
    if header is not None:
        return header
    form: FormData = await request.form()
    value = form.get("csrf", "")
    return value if isinstance(value, str) else ""
