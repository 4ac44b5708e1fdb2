"""An event as an HTTP POST of JSON, signed so that the receiver knows who has sent it and when.

``Stribeck-Signature: t=UNIX,v1=HEX`` where HEX is HMAC-SHA-256, keyed with the secret, over the
time's digits, a full stop and the body's bytes. The receiver compares in constant time and refuses
what is older than some minutes. ``Stribeck-Event-Id`` is the same for every try of one event.
"""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from urllib.parse import urlsplit

from agent.night.description import Webhook
from agent.night.telling import ByDescription, UndeliveredError
from agent.record.events_file import Event

SCHEMA = "stribeck.event/1"
SIGNATURE, EVENT_ID = "Stribeck-Signature", "Stribeck-Event-Id"


def body_of(event: Event) -> bytes:
    """Return the document that is posted."""
    document = {"schema": SCHEMA, **asdict(event)}
    return json.dumps(document, ensure_ascii=False, sort_keys=True).encode()


def signature(secret: str, at_s: int, body: bytes) -> str:
    """Return the signature's header.

    Parameters
    ----------
    secret : str
        Known to both sides.
    at_s : int
        When it is sent, seconds since 1970 in UTC.
    body : bytes
        As it is posted.
    """
    digest = hmac.new(secret.encode(), f"{at_s}.".encode() + body, hashlib.sha256).hexdigest()
    return f"t={at_s},v1={digest}"


@dataclass(frozen=True)
class WebhookSink(ByDescription):
    """One receiver.

    Parameters
    ----------
    described : Webhook
    secret : str
        Empty: messages are not signed.
    now_s : callable
        The time, seconds since 1970 in UTC, for the signature.
    """

    described: Webhook
    secret: str
    now_s: Callable[[], float]

    @property
    def name(self) -> str:
        """Return host and port; the path may hold a token."""
        parts = urlsplit(self.described.url)
        return f"webhook {parts.hostname}" + (f":{parts.port}" if parts.port else "")

    def deliver(self, event: Event) -> None:
        """Post the event; see `agent.night.telling.Sink`."""
        import httpx

        body = body_of(event)
        headers = {
            "Content-Type": "application/json",
            "User-Agent": "stribeck",
            EVENT_ID: hashlib.sha256(body).hexdigest()[:32],
        }
        if self.secret:
            headers[SIGNATURE] = signature(self.secret, int(self.now_s()), body)
        try:
            with (
                httpx.Client(
                    timeout=self.described.timeout_s, follow_redirects=False, trust_env=False
                ) as client,
                client.stream("POST", self.described.url, content=body, headers=headers) as answer,
            ):  # whatever is answered beyond the status is not read
                status = answer.status_code
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise UndeliveredError(f"{type(error).__name__}: {_plain(str(error), self)}") from error
        if not 200 <= status < 300:
            refused = 300 <= status < 500 and status not in (408, 425, 429)
            raise UndeliveredError(f"it answered with status {status}", for_good=refused)


def _plain(text: str, sink: WebhookSink) -> str:
    """Return a message without the URL, whose path may be a secret."""
    return text.replace(sink.described.url, sink.name).strip() or "no answer"
