"""Sparkplug B against a real broker: what arrives, in which order, and nothing is asked for."""

from __future__ import annotations

import datetime
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import paho.mqtt.client as paho
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paho.mqtt.enums import CallbackAPIVersion

from agent.errors import InputError
from agent.night.description import Mqtt
from agent.night.mqtt import MqttSink
from agent.night.sparkplug import BOOLEAN, DATE_TIME, DOUBLE, INT64, STRING, Metric, payload
from agent.night.telling import tell
from agent.record.events_file import Event
from tests.night.protobuf import fields, metrics
from tests.servers import mosquitto, self_signed

NOW = datetime.datetime(2026, 6, 2, 0, 10, 0, 250_000, tzinfo=datetime.UTC)
NOW_MS = 1_780_359_000_250
RUN = Event(
    "2026-06-02T00:10:00.000Z",
    "run",
    "As before.",
    "cell 7",
    2,
    "ab" * 32,
    "night",
    {"state": "NF", "numbers": {"coulomb_nm": 0.61, "viscous_nm_s_per_rad": 0.011}},
)
ALARM = Event("2026-06-01T00:10:00.000Z", "alarm", "Grown.", "cell 7", 2, "cd" * 32, "night")
GOLDEN = (
    "0880d095ffbc3112120a0562645365711880d095ffbc3120045807120e0a01611880d095ffbc31200b700112"
    "0e0a016e1880d095ffbc31200a380112290a01741880d095ffbc31200a4a120a07656e67556e69741207080c"
    "42034e206d69000000000000e03f12100a01731880d095ffbc31200c7a02c3bc1803"
)
SKIP = Event("2026-06-03T00:10:00.000Z", "skip", "Refused: no permit.", "cell 7", 2, by="night")


def test_bytes_as_the_published_schema_has_them() -> None:
    # GOLDEN is what `protoc --encode` makes of the same values with sparkplug_b.proto's fields
    said = payload(
        [
            Metric("bdSeq", INT64, 7),
            Metric("a", BOOLEAN, True),
            Metric("n", DOUBLE, None),
            Metric("t", DOUBLE, 0.5, "N m"),
            Metric("s", STRING, "ü"),
        ],
        1_700_000_000_000,
        3,
    )
    assert said.hex() == GOLDEN


@given(
    text=st.text(st.characters(exclude_categories=["Cs"])),
    number=st.floats(allow_nan=False),
    whole=st.integers(-(2**63), 2**63 - 1),
    flag=st.booleans(),
    at_ms=st.integers(0, 2**53),
    seq=st.integers(0, 255),
)
def test_every_value_comes_back_from_its_bytes(
    text: str, number: float, whole: int, flag: bool, at_ms: int, seq: int
) -> None:
    said = payload(
        [
            Metric("s", STRING, text),
            Metric("d", DOUBLE, number, "N m"),
            Metric("i", INT64, whole),
            Metric("b", BOOLEAN, flag),
            Metric("none", STRING, None),
        ],
        at_ms,
        seq,
    )
    outer = fields(said)
    assert outer[0] == (1, at_ms)
    assert outer[-1] == (3, seq)
    found = metrics(said)
    assert found["s"][15].decode() == text
    assert found["d"][13] == number
    assert found["i"][11] == whole % 2**64
    assert found["b"][14] == int(flag)
    assert found["none"][7] == 1
    assert not {10, 11, 12, 13, 14, 15} & found["none"].keys()
    assert all(metric[3] == at_ms for metric in found.values())


@pytest.mark.parametrize(
    "metric", [Metric("x", BOOLEAN, 1), Metric("x", INT64, True), Metric("x", DATE_TIME, "now")]
)
def test_a_value_of_another_type_is_refused(metric: Metric) -> None:
    with pytest.raises(ValueError, match="is not of data type"):
        payload([metric], 0, 0)


@pytest.fixture(scope="module")
def broker() -> Iterator[int]:
    with mosquitto() as port:
        yield port


@contextmanager
def listening(port: int) -> Iterator[list[tuple[str, bytes, int, bool]]]:
    """Yield what arrives at the broker: topic, payload, QoS, retained."""
    got: list[tuple[str, bytes, int, bool]] = []
    subscribed = threading.Event()
    client = paho.Client(CallbackAPIVersion.VERSION2)
    client.on_subscribe = lambda *_args: subscribed.set()
    client.on_message = lambda _c, _d, m: got.append((m.topic, bytes(m.payload), m.qos, m.retain))
    client.connect("127.0.0.1", port)
    client.loop_start()
    client.subscribe("#", qos=1)
    assert subscribed.wait(60.0)
    try:
        yield got
    finally:
        client.disconnect()
        client.loop_stop()


def sink(port: int, folder: Path, password: str = "", **more: Any) -> MqttSink:
    described = Mqtt.model_validate(
        {
            "kind": "mqtt",
            "host": "127.0.0.1",
            "port": port,
            "group": "plant1",
            "timeout_s": 5.0,
            "tries": 2,
            **more,
        }
    )
    return MqttSink(
        described,
        "cell 7",
        password,
        folder,
        folder / "state.json",
        lambda: NOW,
        lambda axis: ALARM if axis == 2 else None,
    )


def published(port: int, folder: Path, event: Event) -> list[tuple[str, dict[str, Any], bytes]]:
    with listening(port) as got:
        (delivery,) = tell(event, [sink(port, folder)], lambda _s: None)
        assert delivery.arrived, delivery.sentence
        _await(lambda: any("NDEATH" in topic for topic, *_ in got))
    assert all(not retained for *_, retained in got)
    assert [qos for *_, qos, _ in got] == [0] * (len(got) - 1) + [1]
    return [(topic, metrics(body), body) for topic, body, *_ in got]


def _await(ready: Any) -> None:
    pause = threading.Event()
    for _ in range(6000):
        if ready():
            return
        pause.wait(0.01)
    raise AssertionError("nothing arrives")


def test_a_session_is_births_data_and_death_in_order(broker: int, tmp_path: Path) -> None:
    messages = published(broker, tmp_path, RUN)
    assert [topic for topic, *_ in messages] == [
        "spBv1.0/plant1/NBIRTH/cell_7",
        "spBv1.0/plant1/DBIRTH/cell_7/axis2",
        "spBv1.0/plant1/DDATA/cell_7/axis2",
        "spBv1.0/plant1/NDEATH/cell_7",
    ]
    born, device, data, death = (found for _, found, _ in messages)
    sequence = [dict(fields(body)).get(3) for *_, body in messages]
    assert sequence == [0, 1, 2, None]  # a death has none
    assert born["bdSeq"][11] == death["bdSeq"][11] == 0
    assert all(dict(fields(body))[1] == NOW_MS for *_, body in messages)
    assert data["Verdict/coulomb_nm"][13] == 0.61
    assert data["Verdict/Alarm"][14] == 0
    assert data["Event/Time"][11] == NOW_MS - 250
    unit = dict(fields(data["Verdict/coulomb_nm"][9]))
    assert (unit[1], dict(fields(unit[2]))[8]) == (b"engUnit", b"N m")
    assert data.keys() <= device.keys(), "data must have been born"
    assert data["Verdict/inertia_kg_m2"][7] == 1  # nobody knows: null, not zero

    (_, again, _), *_ = published(broker, tmp_path, RUN)
    assert again["bdSeq"][11] == 1  # another session


def test_a_skip_does_not_hide_the_alarm_before_it(broker: int, tmp_path: Path) -> None:
    _, (_, device, _), (_, data, _), _ = published(broker, tmp_path, SKIP)
    assert device["Verdict/Alarm"][14] == 1
    assert device["Verdict/Text"][15] == b"Grown."
    assert data.keys() == {"Event/Kind", "Event/Text", "Event/Time"}


def test_a_session_that_breaks_off_ends_with_the_same_death_as_will(
    broker: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(self: Any, _topic: str, _content: bytes, qos: int = 0) -> None:
        assert qos == 0
        self._client.socket().shutdown(2)  # the line breaks before anything is said
        raise OSError("cut")

    monkeypatch.setattr("agent.night.mqtt._Session.publish", cut)
    monkeypatch.setattr("agent.night.mqtt._Session.close", lambda self: self._client.loop_stop())
    with listening(broker) as got:
        with pytest.raises(OSError, match="cut"):
            sink(broker, tmp_path).deliver(RUN)
        _await(lambda: got)
    ((topic, body, qos, retained),) = got
    assert (topic, qos, retained) == ("spBv1.0/plant1/NDEATH/cell_7", 1, False)
    assert metrics(body)["bdSeq"][11] == 0


def test_nothing_is_ever_subscribed_to(
    broker: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    subscribe = paho.Client.subscribe
    asked: list[Any] = []

    def spy(self: Any, *args: Any, **kwargs: Any) -> Any:
        asked.append(args)
        return subscribe(self, *args, **kwargs)

    monkeypatch.setattr(paho.Client, "subscribe", spy)
    (delivery,) = tell(RUN, [sink(broker, tmp_path)], lambda _s: None)
    assert delivery.arrived
    assert asked == []


def test_a_broker_that_refuses_or_is_gone_is_a_sentence(tmp_path: Path) -> None:
    with mosquitto(password=("stribeck", "right")) as port:
        for password, arrived in (("right", True), ("wr0ng", False)):
            asked = sink(port, tmp_path, password, user="stribeck")
            (delivery,) = tell(RUN, [asked], lambda _s: None)
            assert delivery.arrived is arrived
            assert "wr0ng" not in delivery.sentence
        assert (delivery.tries, "the broker refused" in delivery.why) == (1, True)
    pauses: list[float] = []
    (delivery,) = tell(RUN, [sink(port, tmp_path)], pauses.append)
    assert (delivery.arrived, delivery.tries, pauses) == (False, 2, [2.0])
    assert "ConnectionRefused" in delivery.why


# paho leaves the socket of a handshake that failed to the collector, which closes it at once
@pytest.mark.filterwarnings(
    "ignore:Exception ignored in. <ssl.SSLSocket:pytest.PytestUnraisableExceptionWarning"
)
def test_an_encrypted_line_goes_to_a_broker_that_is_believed_and_to_no_other(
    tmp_path: Path,
) -> None:
    key_and_certificate = self_signed(tmp_path)
    with mosquitto(password=("stribeck", "right"), tls=key_and_certificate) as port:
        for ca_file, arrived in (("cert.pem", True), ("", False)):
            asked = sink(port, tmp_path, "right", user="stribeck", tls=True, ca_file=ca_file)
            (delivery,) = tell(RUN, [asked], lambda _s: None)
            assert delivery.arrived is arrived, delivery.sentence
    assert (delivery.tries, "no encrypted line" in delivery.why) == (1, True)


def test_a_password_never_goes_over_an_open_line_to_another_machine(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="needs tls"):
        sink(1883, tmp_path, "x", host="broker.example", user="stribeck")
