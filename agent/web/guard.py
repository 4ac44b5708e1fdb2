"""What every request passes before anything looks at it: host, size, and what every answer says."""

from __future__ import annotations

from collections.abc import Sequence

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LARGEST_BODY = 64 * 1024

CONTENT_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
REPORT_POLICY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
"""For the offline reports: they carry their style and pictures in themselves, and no script."""


class TooLargeError(HTTPException):
    """The body is longer than anything that the page sends."""

    def __init__(self) -> None:
        super().__init__(413)


class Guard:
    """Refuses a foreign host name (DNS rebinding) and a large body; puts the strict headers on.

    Parameters
    ----------
    app : ASGI application
    hosts : sequence of str
        Names by which browsers may call us, in lower case, without port.
    secure : bool
        Whether browsers speak TLS with us or our proxy.
    """

    def __init__(self, app: ASGIApp, hosts: Sequence[str], *, secure: bool) -> None:
        self._app = app
        self._hosts = frozenset(hosts)
        self._secure = secure

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        said = _sender(send, secure=self._secure)
        hosts = headers.getlist("host")
        if len(hosts) != 1 or host_name(hosts[0]) not in self._hosts:
            await PlainTextResponse("This page is not called by that name.\n", 421)(
                scope, receive, said
            )
            return
        length = headers.get("content-length", "0")
        if not length.isdecimal() or int(length) > LARGEST_BODY:
            await _too_large(scope, receive, said)
            return
        await self._app(scope, _limited(receive), said)


def host_name(host: str) -> str:
    """Return a Host header's name in lower case, without its port."""
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.rpartition(":")[0].lower() if ":" in host else host.lower()


async def _too_large(scope: Scope, receive: Receive, send: Send) -> None:
    await PlainTextResponse("That is more than this page takes.\n", 413)(scope, receive, send)


def _limited(receive: Receive) -> Receive:
    taken = 0

    async def limited() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body", b""))
        if taken > LARGEST_BODY:
            raise TooLargeError
        return message

    return limited


def _sender(send: Send, *, secure: bool) -> Send:
    async def with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.setdefault("content-security-policy", CONTENT_POLICY)
            headers.setdefault("cache-control", "no-store")
            headers["x-content-type-options"] = "nosniff"
            headers["x-frame-options"] = "DENY"
            headers["referrer-policy"] = "same-origin"
            headers["permissions-policy"] = "camera=(), microphone=(), geolocation=(), usb=()"
            headers["cross-origin-opener-policy"] = "same-origin"
            headers["cross-origin-resource-policy"] = "same-origin"
            if secure:
                headers["strict-transport-security"] = "max-age=31536000"
        await send(message)

    return with_headers
