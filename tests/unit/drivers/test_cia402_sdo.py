"""SDO access and PDO mapping against a scripted server; every library exception is mapped."""

from __future__ import annotations

import importlib
import itertools
import logging
import pkgutil
import struct
from collections.abc import Iterator
from types import ModuleType

import can
import canopen
import pytest

from drivers.can.owner import CanBusConfig, CanBusOwner
from drivers.cia402 import objects
from drivers.cia402.network import CanopenNode
from drivers.cia402.objects import DriveObject
from drivers.cia402.pdo import EVERY_SYNC, PdoMap, snapshot_pdo, write_pdo
from drivers.cia402.sdo import LIBRARY_ERRORS, SdoAccess, translate
from drivers.cia402.settings import give_back
from drivers.clock import SteppedClock
from drivers.errors import BusError, ConfigurationError, DriverError, SdoError

NODE = 9
_CHANNELS = itertools.count()
TPDO1 = PdoMap(0x1800, 0x180 + NODE, EVERY_SYNC, (objects.STATUSWORD, objects.POSITION))


class ScriptedServer:
    """An expedited-only SDO server over a dictionary of raw bytes, with mishaps on request."""

    def __init__(self) -> None:
        channel = f"sdo-{next(_CHANNELS)}"
        self.clock = SteppedClock()
        self.bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
        self.owner = CanBusOwner.open(CanBusConfig("virtual", channel), self.clock)
        self.node = CanopenNode(self.owner, self.clock, NODE, 0.3)
        self.sdo = SdoAccess(self.node, attempts=3)
        self.values: dict[tuple[int, int], bytes] = {}
        self.aborts: dict[tuple[int, int], int] = {}
        self.read_only: set[tuple[int, int]] = set()
        self.forgets: set[tuple[int, int]] = set()  # accepts, keeps nothing
        self.silent = 0  # so many requests stay unanswered
        self.delay_s = 0.0
        self.writes: list[tuple[int, int, int]] = []
        self._waiting: list[tuple[float, bytes]] = []
        self.clock.attach(self._step)

    def close(self) -> None:
        self.node.release()
        self.owner.close()
        self.bus.shutdown()

    def _step(self, now_s: float) -> None:
        while (message := self.bus.recv(0.0)) is not None:
            if message.arbitration_id != 0x600 + NODE or message.data[0] == 0x80:
                continue
            if self.silent:
                self.silent -= 1
                continue
            self._waiting.append((now_s + self.delay_s, self._answer(bytes(message.data))))
        for due_s, answer in [x for x in self._waiting if x[0] <= now_s]:
            self._waiting.remove((due_s, answer))
            self.say(0x580 + NODE, answer)

    def say(self, cob_id: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))

    def _answer(self, request: bytes) -> bytes:
        command, index, subindex = struct.unpack_from("<BHB", request)
        key = (index, subindex)
        if key in self.aborts or (command == 0x40 and key not in self.values):
            code = self.aborts.get(key, 0x06020000)
            return struct.pack("<BHBI", 0x80, index, subindex, code)
        if command == 0x40:
            data = self.values[key]
            return struct.pack("<BHB", 0x43 | (4 - len(data)) << 2, *key) + data.ljust(4, b"\x00")
        if key in self.read_only:
            return struct.pack("<BHBI", 0x80, index, subindex, 0x06010002)
        size = 4 - (command >> 2 & 3)
        self.writes.append((index, subindex, int.from_bytes(request[4 : 4 + size], "little")))
        if key not in self.forgets:
            self.values[key] = request[4 : 4 + size]
        return struct.pack("<BHB4x", 0x60, index, subindex)


@pytest.fixture
def server() -> Iterator[ScriptedServer]:
    made = ScriptedServer()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("kind", "raw", "value"),
    [
        ("u8", b"\xff", 255),
        ("i8", b"\xff", -1),
        ("u16", b"\x34\x12", 0x1234),
        ("i16", b"\xfe\xff", -2),
        ("u32", b"\x78\x56\x34\x12", 0x12345678),
        ("i32", b"\xff\xff\xff\xff", -1),
        ("i16", b"\xfe\xff\xff\xff", -2),  # drives that send 32 bits for less
    ],
)
def test_values_are_typed_by_us(server: ScriptedServer, kind: str, raw: bytes, value: int) -> None:
    server.values[0x2000, 1] = raw
    assert server.sdo.read(DriveObject(0x2000, 1, kind, "thing")) == value


def test_too_few_bytes_are_refused(server: ScriptedServer) -> None:
    server.values[0x6064, 0] = b"\x01\x02"
    with pytest.raises(SdoError, match=r"2 bytes for position \(0x6064:00\), expected 4"):
        server.sdo.read(objects.POSITION)


def test_an_abort_names_object_node_and_reason(server: ScriptedServer) -> None:
    server.aborts[0x6083, 0] = 0x06090031
    with pytest.raises(SdoError) as caught:
        server.sdo.write(objects.PROFILE_ACCELERATION, 5000)
    assert caught.value.abort_code == 0x06090031
    for words in ("profile acceleration (0x6083:00)", f"node {NODE}", "too high", "5000"):
        assert words in caught.value.what
    assert len(server.writes) == 0


def test_a_refusal_is_raised_and_not_printed_as_well(
    server: ScriptedServer, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where nobody has asked for a log, Python prints warnings of a logger without a handler."""
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    server.aborts[0x6083, 0] = 0x06010000
    with pytest.raises(SdoError):
        server.sdo.read(objects.PROFILE_ACCELERATION)
    assert capsys.readouterr().err == ""


def test_an_absent_object_is_none_only_where_asked_for(server: ScriptedServer) -> None:
    assert server.sdo.read_optional(objects.RATED_TORQUE) is None
    assert server.sdo.read_text(0x1008, 0, "device name") is None
    with pytest.raises(SdoError, match="no such object"):
        server.sdo.read(objects.RATED_TORQUE)
    server.aborts[0x6076, 0] = 0x08000022
    with pytest.raises(SdoError, match="present state"):
        server.sdo.read_optional(objects.RATED_TORQUE)


def test_a_timeout_is_tried_again_on_the_injected_clock(server: ScriptedServer) -> None:
    server.values[0x6041, 0] = b"\x50\x02"
    server.silent = 2
    assert server.sdo.read(objects.STATUSWORD) == 0x0250
    assert 0.6 <= server.clock.now() < 0.7


def test_a_setting_is_tried_again_an_order_never(server: ScriptedServer) -> None:
    server.silent = 1
    server.sdo.write(objects.MODE, 3)
    assert server.writes == [(0x6060, 0, 3)]
    server.silent = 1
    with pytest.raises(SdoError, match="controlword") as caught:
        server.sdo.order(objects.CONTROLWORD, 2)
    assert caught.value.abort_code is None
    assert server.writes == [(0x6060, 0, 3)]


def test_silence_ends_after_the_attempts(server: ScriptedServer) -> None:
    server.silent = 100
    with pytest.raises(SdoError, match=r"No SDO response received"):
        server.sdo.read(objects.STATUSWORD)
    assert server.silent == 97


def test_an_answer_within_the_timeout_is_waited_for(server: ScriptedServer) -> None:
    server.values[0x6041, 0] = b"\x50\x02"
    server.delay_s = 0.25
    assert server.sdo.read(objects.STATUSWORD) == 0x0250
    assert server.clock.now() == pytest.approx(0.25, abs=0.002)


def test_a_deadline_handed_down_is_not_outwaited(server: ScriptedServer) -> None:
    server.silent = 100
    server.node.sdo.give_up_s = 0.1
    with pytest.raises(SdoError):
        server.sdo.read(objects.STATUSWORD)
    assert server.clock.now() <= 0.1 + 1e-9


def test_malformed_frames_are_counted_and_an_emergency_is_never_dropped(
    server: ScriptedServer,
) -> None:
    server.say(0x580 + NODE, b"\x60")
    server.say(0x700 + NODE, b"")
    server.say(0x080 + NODE, b"\x30\x81\x11")
    server.owner.poll()
    server.node.pump()
    assert server.node.malformed == 2
    (emergency,) = server.node.emergencies
    assert (emergency.code, emergency.register) == (0x8130, 0x11)


def test_what_is_set_is_compared_as_read(server: ScriptedServer) -> None:
    assert server.sdo.set(objects.ABORT_CONNECTION, 3) == 3
    server.forgets.add((0x6007, 0))
    with pytest.raises(ConfigurationError, match=r"abort connection option.*set to 2 but reads 3"):
        server.sdo.set(objects.ABORT_CONNECTION, 2)


def factory_tpdo(server: ScriptedServer) -> None:
    server.values |= {
        (0x1800, 1): struct.pack("<I", 0x40000180 + NODE),
        (0x1800, 2): b"\xff",
        (0x1A00, 0): b"\x01",
        (0x1A00, 1): struct.pack("<I", 0x60410010),
    }


def test_a_mapping_is_written_in_the_standards_order(server: ScriptedServer) -> None:
    factory_tpdo(server)
    found = snapshot_pdo(server.sdo, 0x1800)
    write_pdo(server.sdo, 0x1800, TPDO1.wanted(found))
    assert server.writes == [
        (0x1800, 1, 0xC0000180 + NODE),  # invalid; the drive's no-remote bit is kept
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x60410010),
        (0x1A00, 2, 0x60640020),
        (0x1A00, 0, 2),
        (0x1800, 2, 1),
        (0x1800, 1, 0x40000180 + NODE),
    ]


def test_a_mapping_goes_back_to_what_was_found(server: ScriptedServer) -> None:
    factory_tpdo(server)
    before = dict(server.values)
    found = snapshot_pdo(server.sdo, 0x1800)
    write_pdo(server.sdo, 0x1800, TPDO1.wanted(found))
    write_pdo(server.sdo, 0x1800, found)
    assert {key: server.values[key] for key in before} == before


def test_a_fixed_mapping_serves_as_it_stands_and_is_given_back_all_the_same(
    server: ScriptedServer,
) -> None:
    factory_tpdo(server)
    found = snapshot_pdo(server.sdo, 0x1800)
    server.read_only |= {(0x1A00, sub) for sub in range(3)}
    with pytest.raises(SdoError, match="can only be read") as caught:
        write_pdo(server.sdo, 0x1800, TPDO1.wanted(found))
    assert "mapping is fixed: map 0x6041, 0x6064" in caught.value.do
    write_pdo(server.sdo, 0x1800, found)  # which the attempt has left invalid
    assert snapshot_pdo(server.sdo, 0x1800) == found
    write_pdo(server.sdo, 0x1800, found | {"0x1800:02": EVERY_SYNC})  # sent otherwise
    assert server.values[0x1800, 2] == b"\x01"


def test_what_a_drive_refuses_is_given_back_where_it_never_was_another(
    server: ScriptedServer,
) -> None:
    server.values[0x6085, 0] = struct.pack("<I", 5000)
    server.read_only.add((0x6085, 0))
    assert give_back(server.sdo, {"0x6085:00": 5000}) == []
    (trouble,) = give_back(server.sdo, {"0x6085:00": 4000})
    assert "can only be read" in trouble


def test_a_mapping_that_does_not_stick_names_expected_and_read(server: ScriptedServer) -> None:
    factory_tpdo(server)
    server.forgets.add((0x1A00, 1))
    server.values[0x1A00, 1] = struct.pack("<I", 0x60610008)
    with pytest.raises(ConfigurationError) as caught:
        write_pdo(server.sdo, 0x1800, TPDO1.wanted(snapshot_pdo(server.sdo, 0x1800)))
    assert "expected 0x60410010, read 0x60610008" in caught.value.what


def test_a_pdo_has_room_for_eight_bytes() -> None:
    with pytest.raises(ValueError, match="1 to 64 bits"):
        PdoMap(0x1800, 0x181, EVERY_SYNC, (objects.POSITION,) * 3)
    assert TPDO1.codec().unpack(struct.pack("<Hi", 0x1637, -5)) == (0x1637, -5)


def library_exceptions(package: ModuleType) -> set[type[Exception]]:
    """Return every exception class that a package defines, as far as its modules import."""
    found: set[type[Exception]] = set()
    pending = [package.__name__]
    while pending:
        try:
            module = importlib.import_module(pending.pop())
        except (ImportError, OSError, AttributeError):
            continue  # a vendor's adapter whose software is not here
        for cls in vars(module).values():
            # Not isinstance: one of canopen's objects refuses even to be asked for its class.
            if not issubclass(type(cls), type):
                continue
            if issubclass(cls, Exception) and cls.__module__.startswith(package.__name__):
                found.add(cls)
        if hasattr(module, "__path__"):
            pending += [
                f"{module.__name__}.{m.name}" for m in pkgutil.iter_modules(module.__path__)
            ]
    return found


NEVER_RAISED_AT_US = {"can.io.blf.BLFParseError"}
"""Raised by python-can's log file readers, which we do not use."""


# every module of the libraries is imported, old interfaces that warn of their age included
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("package", [can, canopen])
def test_every_exception_of_the_libraries_has_a_mapping(package: ModuleType) -> None:
    logging.disable(logging.ERROR)
    try:
        classes = library_exceptions(package)
    finally:
        logging.disable(logging.NOTSET)
    assert len(classes) >= 5
    unknown = {
        f"{cls.__module__}.{cls.__qualname__}"
        for cls in classes
        if not issubclass(cls, tuple(LIBRARY_ERRORS))
    }
    assert unknown <= NEVER_RAISED_AT_US, unknown - NEVER_RAISED_AT_US


@pytest.mark.parametrize(
    ("error", "ours"),
    [
        (can.CanTimeoutError("no room"), BusError),
        (canopen.SdoAbortedError(0x06020000), SdoError),
        (canopen.SdoCommunicationError("No SDO response received"), SdoError),
        (canopen.ObjectDictionaryError("no type"), ConfigurationError),
    ],
)
def test_translated_errors_say_what_was_being_done(
    error: Exception, ours: type[DriverError]
) -> None:
    translated = translate(error, "reading statusword (0x6041:00)", NODE)
    assert type(translated) is ours
    assert "reading statusword (0x6041:00)" in translated.what


def test_a_foreign_exception_is_not_swallowed() -> None:
    with pytest.raises(TypeError, match="no mapping for KeyError"):
        translate(KeyError("x"), "reading", NODE)
