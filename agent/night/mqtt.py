"""Events and verdicts to an MQTT broker as Sparkplug B: published, and nothing ever subscribed to.

One session a message: birth of the node (the cell), birth of the device (the axis) with all that
is known of it, the news as data, death. The death is sent with QoS 1 as the last message, so that
the broker's acknowledgement says that all before it has arrived; were the line to break, the
broker would send the same death as our will. A host that asks for a rebirth is not heard; the next
message is one.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import ssl
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agent.errors import InputError, StorageError
from agent.night.description import Mqtt
from agent.night.sparkplug import (
    BOOLEAN,
    DATE_TIME,
    DOUBLE,
    INT64,
    NAMESPACE,
    STRING,
    Metric,
    milliseconds,
    payload,
)
from agent.night.telling import ByDescription, UndeliveredError, trust
from agent.record.atomic import publish
from agent.record.events_file import Event

if TYPE_CHECKING:
    from paho.mqtt.client import Client, MQTTMessageInfo

VERDICTS = ("run", "alarm")
_UNITS = {
    "coulomb_nm": "N m",
    "viscous_nm_s_per_rad": "N m s/rad",
    "inertia_kg_m2": "kg m2",
    "gravity_sin_nm": "N m",
    "gravity_cos_nm": "N m",
}
_BAD_LOGIN = (4, 5, 134, 135)  # MQTT 3.1.1 and 5: bad user or password, not authorised


@dataclass(frozen=True)
class MqttSink(ByDescription):
    """One broker.

    Parameters
    ----------
    described : Mqtt
    robot : str
        The node's name, unless the description gives another.
    password : str
    folder : pathlib.Path
        Of the night's description, which `ca_file` is relative to.
    state : pathlib.Path
        Where the number of the last session is kept.
    now : callable
        The time in UTC.
    last_verdict : callable
        The newest event with a verdict on an axis, or None: a skip must not hide an alarm.
    """

    described: Mqtt
    robot: str
    password: str
    folder: Path
    state: Path
    now: Callable[[], datetime.datetime]
    last_verdict: Callable[[int], Event | None] = lambda _axis: None

    def __post_init__(self) -> None:
        if self.described.user and not self.described.tls and not self._is_here():
            raise InputError(
                "A broker on another machine that asks for a password needs tls = true: the "
                "password would go over the line for everybody to read."
            )

    def _is_here(self) -> bool:
        return self.described.host in ("localhost", "127.0.0.1", "::1")

    @property
    def name(self) -> str:
        """Return where the broker is."""
        return f"MQTT {self.described.host}:{self.described.port}"

    @property
    def node(self) -> str:
        """Return the node's name, as topics have it."""
        plain = "".join("_" if c in "/+#" or c.isspace() else c for c in self.robot)
        return self.described.node or plain

    def topic(self, kind: str, axis: int | None = None) -> str:
        """Return the topic of a message: NBIRTH, NDEATH, DBIRTH or DDATA."""
        device = "" if axis is None else f"/axis{axis}"
        return f"{NAMESPACE}/{self.described.group}/{kind}/{self.node}{device}"

    def deliver(self, event: Event) -> None:
        """Publish the event in a session of its own; see `agent.night.telling.Sink`."""
        at_ms = milliseconds(self.now())
        number = Metric("bdSeq", INT64, self._next_session())
        death = payload([number], at_ms, None)
        session = _Session(self, death)
        try:
            session.publish(self.topic("NBIRTH"), payload([number, *_node(event)], at_ms, 0))
            if event.axis is not None:
                verdict = event if event.kind in VERDICTS else self.last_verdict(event.axis)
                born = [*_news(event), *_verdict(verdict)]
                news = [*_news(event), *(_verdict(event) if event.kind in VERDICTS else ())]
                session.publish(self.topic("DBIRTH", event.axis), payload(born, at_ms, 1))
                session.publish(self.topic("DDATA", event.axis), payload(news, at_ms, 2))
            session.publish(self.topic("NDEATH"), death, qos=1)
        finally:
            session.close()

    def _next_session(self) -> int:
        """Return the number of this session, 0 to 255, one more than that of the last."""
        try:
            last = int(json.loads(self.state.read_text(encoding="utf-8"))["bdSeq"])
        except (OSError, ValueError, KeyError, TypeError):
            last = -1
        number = (last + 1) % 256
        # Where it cannot be kept the number repeats, which tells a host nothing wrong.
        with contextlib.suppress(StorageError):
            publish({self.state: json.dumps({"bdSeq": number}).encode()}, overwrite=True)
        return number


class _Session:
    """A connection whose will is the node's death."""

    def __init__(self, sink: MqttSink, death: bytes) -> None:
        import paho.mqtt.client as paho
        from paho.mqtt.enums import CallbackAPIVersion

        said = sink.described
        self._timeout_s = said.timeout_s
        self._answered = threading.Event()
        self._refused: Any = None
        self._client: Client = paho.Client(
            CallbackAPIVersion.VERSION2,
            client_id=f"stribeck-{said.group}-{sink.node}",
            protocol=paho.MQTTv311,
            reconnect_on_failure=False,
        )
        self._client.connect_timeout = said.timeout_s
        self._client.on_connect = self._on_connect
        self._client.will_set(sink.topic("NDEATH"), death, qos=1)
        if said.user:
            self._client.username_pw_set(said.user, sink.password)
        if said.tls:
            self._client.tls_set_context(trust(said.ca_file, sink.folder))
        self._connect(said)

    def _connect(self, said: Mqtt) -> None:
        """Reach the broker and wait for its answer.

        Raises
        ------
        UndeliveredError
        """
        try:
            self._client.connect(said.host, said.port, keepalive=30)
        except ssl.SSLError as error:
            raise UndeliveredError(
                f"no encrypted line: {error.reason or error}", for_good=True
            ) from error
        except (OSError, ValueError) as error:
            raise UndeliveredError(f"{type(error).__name__}: {error}") from error
        self._client.loop_start()
        if not self._answered.wait(self._timeout_s):
            self.close()
            raise UndeliveredError(f"the broker did not answer within {self._timeout_s:g} s")
        if self._refused is not None:
            self.close()
            for_good = getattr(self._refused, "value", 0) in _BAD_LOGIN
            raise UndeliveredError(f"the broker refused: {self._refused}", for_good=for_good)

    def _on_connect(self, _client: Any, _data: Any, _flags: Any, code: Any, _props: Any) -> None:
        if code.is_failure:
            self._refused = code
        self._answered.set()

    def publish(self, topic: str, content: bytes, qos: int = 0) -> None:
        """Publish a message that no broker keeps, and wait until it is sent (QoS 1: received).

        Raises
        ------
        UndeliveredError
        """
        try:
            info: MQTTMessageInfo = self._client.publish(topic, content, qos=qos, retain=False)
            info.wait_for_publish(self._timeout_s)
        except (RuntimeError, ValueError) as error:
            raise UndeliveredError(f"{topic}: {error}") from error
        if not info.is_published():
            raise UndeliveredError(f"{topic} was not taken within {self._timeout_s:g} s")

    def close(self) -> None:
        """End the session and its thread; may be repeated."""
        self._client.disconnect()
        self._client.loop_stop()


def _node(event: Event) -> tuple[Metric, ...]:
    return (Metric("Robot", STRING, event.robot),)


def _news(event: Event) -> tuple[Metric, ...]:
    at = datetime.datetime.fromisoformat(event.at)
    return (
        Metric("Event/Kind", STRING, event.kind),
        Metric("Event/Text", STRING, event.text),
        Metric("Event/Time", DATE_TIME, at),
    )


def _verdict(event: Event | None) -> tuple[Metric, ...]:
    """Return the verdict that an event carries; without one everything is null."""
    details = {} if event is None else event.details
    numbers = details.get("numbers")
    found = numbers if isinstance(numbers, dict) else {}
    state = details.get("state")
    return (
        Metric("Verdict/Alarm", BOOLEAN, None if event is None else event.kind == "alarm"),
        Metric("Verdict/State", STRING, state if isinstance(state, str) else None),
        Metric("Verdict/Text", STRING, None if event is None else event.text),
        Metric("Verdict/Recording", STRING, None if event is None else event.recording),
        Metric(
            "Verdict/Time",
            DATE_TIME,
            None if event is None else datetime.datetime.fromisoformat(event.at),
        ),
        *(Metric(f"Verdict/{n}", DOUBLE, found.get(n), unit) for n, unit in _UNITS.items()),
    )
