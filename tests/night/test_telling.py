"""Webhook and mail against real servers, and what a sink that fails may cost."""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import http.server
import json
import re
import ssl
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from email import message_from_bytes
from pathlib import Path
from typing import Any

import pytest
from aiosmtpd.controller import Controller
from aiosmtpd.smtp import AuthResult, LoginPassword

from agent.errors import InputError
from agent.night.description import Email, Webhook, secret
from agent.night.mail import MailSink
from agent.night.telling import Delivery, UndeliveredError, tell
from agent.night.webhook import EVENT_ID, SIGNATURE, WebhookSink
from agent.record.events_file import Event
from tests.servers import self_signed

ALARM = Event(
    "2026-06-02T00:10:00.000Z",
    "alarm",
    "Reibung um 30 % gewachsen.",
    "cell7",
    1,
    "ab" * 32,
    "night",
    {"night": "2026-06-01", "file": "run.parquet"},
)
NOW_S = 1_780_000_000.7


@dataclass
class Receiver:
    """An HTTP server that answers with the statuses it was given, the last one for ever."""

    statuses: list[int]
    requests: list[tuple[dict[str, str], bytes]] = field(default_factory=list)
    url: str = ""

    @contextlib.contextmanager
    def running(self) -> Iterator[Receiver]:
        receiver = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                receiver.requests.append((dict(self.headers.items()), body))
                statuses = receiver.statuses
                status = statuses.pop(0) if len(statuses) > 1 else statuses[0]
                if status == 0:  # hang up without an answer
                    return
                self.send_response(status)
                self.send_header("Location", receiver.url)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_args: Any) -> None:
                pass

        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        self.url = f"http://127.0.0.1:{server.server_port}/hooks/geheimer-pfad"
        try:
            yield self
        finally:
            server.shutdown()
            server.server_close()
            thread.join()


def webhook(url: str, key: str = "s3cret", **more: Any) -> WebhookSink:
    described = Webhook.model_validate({"kind": "webhook", "url": url, "timeout_s": 2.0, **more})
    return WebhookSink(described, key, lambda: NOW_S)


def told(sink: Any, event: Event = ALARM) -> tuple[Delivery, list[float]]:
    pauses: list[float] = []
    (delivery,) = tell(event, [sink], pauses.append)
    return delivery, pauses


def test_a_webhook_gets_the_event_once_and_can_check_who_sent_it() -> None:
    with Receiver([204]).running() as receiver:
        delivery, pauses = told(webhook(receiver.url))
    assert delivery.arrived
    assert not pauses
    ((headers, body),) = receiver.requests
    document = json.loads(body)
    assert document["schema"] == "stribeck.event/1"
    assert (document["text"], document["axis"]) == (ALARM.text, 1)
    match = re.fullmatch(r"t=(\d+),v1=([0-9a-f]{64})", headers[SIGNATURE])
    assert match is not None
    assert match[1] == "1780000000"
    expected = hmac.new(b"s3cret", match[1].encode() + b"." + body, hashlib.sha256).hexdigest()
    assert hmac.compare_digest(match[2], expected)
    assert "s3cret" not in str(receiver.requests)


@pytest.mark.parametrize(
    ("statuses", "arrived", "tries"),
    [
        ([503, 429, 200], True, 3),
        ([0, 200], True, 2),
        ([500], False, 3),
        ([401], False, 1),  # refused for good: another try would end the same way
        ([302], False, 1),  # a redirect is not followed: the signature was not meant for there
    ],
)
def test_a_webhook_is_tried_as_often_as_makes_sense_and_no_oftener(
    statuses: list[int], arrived: bool, tries: int
) -> None:
    with Receiver(statuses).running() as receiver:
        delivery, pauses = told(webhook(receiver.url))
    assert (delivery.arrived, delivery.tries) == (arrived, tries)
    assert len(receiver.requests) == tries
    assert pauses == [2.0, 4.0][: tries - 1]
    assert len({headers[EVENT_ID] for headers, _ in receiver.requests}) == 1
    assert "geheimer-pfad" not in delivery.sentence


def test_nobody_there_is_a_sentence_and_the_others_are_told() -> None:
    with Receiver([200]).running() as receiver:
        gone = receiver.url
    with Receiver([200]).running() as receiver:
        sinks = [webhook(gone), webhook(receiver.url), webhook(receiver.url, tell=["run"])]
        deliveries = tell(ALARM, sinks, lambda _s: None)
    assert [d.arrived for d in deliveries] == [False, True]  # the third did not ask for alarms
    assert "NOT told, tried 3 times: ConnectError" in deliveries[0].sentence
    assert "geheimer-pfad" not in deliveries[0].sentence


def test_a_receiver_that_never_answers_costs_its_time_out_and_no_more() -> None:
    listening = http.server.HTTPServer(("127.0.0.1", 0), http.server.BaseHTTPRequestHandler)
    with listening:
        sink = webhook(f"http://127.0.0.1:{listening.server_port}/", timeout_s=0.1, tries=2)
        delivery, _ = told(sink)
    assert (delivery.arrived, delivery.tries) == (False, 2)
    assert "Timeout" in delivery.why


# -- mail ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return self_signed(tmp_path_factory.mktemp("tls"))


@dataclass
class Postman:
    """What a mail server got; it refuses the receivers that it is told to."""

    refuses: str = "550 nobody of this name"
    unknown: tuple[str, ...] = ()
    mails: list[Any] = field(default_factory=list)
    logins: list[tuple[bytes, bytes]] = field(default_factory=list)

    async def handle_RCPT(  # noqa: N802 - the library's name
        self, _server: Any, _session: Any, envelope: Any, address: str, _options: Any
    ) -> str:
        if address in self.unknown:
            return self.refuses
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(  # noqa: N802 - as above
        self, _server: Any, session: Any, envelope: Any
    ) -> str:
        assert session.ssl is not None, "a mail came over a line that is not encrypted"
        self.mails.append(message_from_bytes(envelope.content))
        return "250 taken"

    def authenticate(
        self, _server: Any, _session: Any, _envelope: Any, _mechanism: str, data: Any
    ) -> AuthResult:
        assert isinstance(data, LoginPassword)
        self.logins.append((data.login, data.password))
        return AuthResult(success=data.password == b"right", handled=False)


@contextlib.contextmanager
def mail_server(postman: Postman, certificate: tuple[Path, Path] | None) -> Iterator[int]:
    options: dict[str, Any] = {}
    if certificate is not None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate[1], certificate[0])
        options = {
            "tls_context": context,
            "require_starttls": True,
            "authenticator": postman.authenticate,
            "auth_required": True,
        }
    controller = Controller(postman, hostname="127.0.0.1", port=0, **options)
    controller.port = _free_port()
    controller.start()
    try:
        yield controller.port
    finally:
        controller.stop()


def _free_port() -> int:
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def mail(port: int, folder: Path, password: str = "right", **more: Any) -> MailSink:
    described = Email.model_validate(
        {
            "kind": "email",
            "host": "localhost",
            "port": port,
            "sender": "stribeck@cell7.example",
            "to": ["a@x.example", "b@x.example"],
            "user": "stribeck",
            "ca_file": "cert.pem",
            "timeout_s": 5.0,
            "tries": 2,
            **more,
        }
    )
    return MailSink(described, password, folder)


def test_a_mail_goes_over_an_encrypted_line_to_a_server_that_is_believed(
    certificate: tuple[Path, Path],
) -> None:
    postman = Postman()
    with mail_server(postman, certificate) as port:
        delivery, _ = told(mail(port, certificate[1].parent))
    assert delivery.arrived, delivery.sentence
    assert postman.logins == [(b"stribeck", b"right")]
    (got,) = postman.mails
    assert got["Subject"] == "cell7 axis 1: ALARM"
    assert got["To"] == "a@x.example, b@x.example"
    text = got.get_payload(decode=True).decode()
    assert text.startswith(ALARM.text)
    assert "run.parquet sha256 abab" in text


def test_a_mail_that_cannot_go_says_why_and_gives_no_secret_away(
    certificate: tuple[Path, Path], tmp_path: Path
) -> None:
    folder = certificate[1].parent
    postman = Postman(unknown=("b@x.example",))
    with mail_server(postman, certificate) as port:
        cases = {
            "user or password are not accepted": mail(port, folder, "wr0ng"),
            "refused for b@x.example": mail(port, folder),
            "no encrypted line": mail(port, folder, ca_file=""),  # nobody vouches for it
            "cannot be used": mail(port, tmp_path),  # no such file
        }
        for why, sink in cases.items():
            delivery, pauses = told(sink)
            assert not delivery.arrived
            assert why in delivery.why
            assert not pauses, "it would end the same way again"
            assert "wr0ng" not in delivery.sentence
    with mail_server(Postman(), None) as port:  # a server that cannot encrypt
        delivery, _ = told(mail(port, folder))
    assert "the server cannot do what it must" in delivery.why
    delivery, pauses = told(mail(_free_port(), folder))
    assert (delivery.arrived, delivery.tries, pauses) == (False, 2, [2.0])


def test_a_password_never_goes_over_an_open_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="needs starttls"):
        mail(25, tmp_path, starttls=False)


def test_a_secret_is_named_and_never_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "key").write_text("from a file\n")
    monkeypatch.setenv("KEY_OF_A_TEST", "from outside")
    assert secret("x", "KEY_OF_A_TEST", "", tmp_path) == "from outside"
    assert secret("x", "", "key", tmp_path) == "from a file"
    assert secret("x", "", "", tmp_path) == ""
    for env, file in (("NO_SUCH_KEY", ""), ("", "nowhere")):
        with pytest.raises(InputError, match="The secret: "):
            secret("The secret", env, file, tmp_path)


def test_what_a_sink_raises_otherwise_is_a_fault_of_ours_and_not_hidden() -> None:
    class Broken(WebhookSink):
        def deliver(self, event: Event) -> None:
            raise ZeroDivisionError(event.kind)

    with pytest.raises(ZeroDivisionError):
        tell(ALARM, [Broken(webhook("http://x/").described, "", lambda: 0.0)], lambda _s: None)
    assert not UndeliveredError("x").for_good
