"""What the Modbus client promises, the same on TCP and on a serial line, against real bytes."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

import pymodbus.exceptions
import pytest

from drivers.clock import MonotonicClock
from drivers.errors import AnswerError, BusError, DriverError, NodeMissingError
from drivers.modbus.connection import ModbusConnection, SerialEndpoint, TcpEndpoint
from drivers.modbus.device import MappedDevice
from drivers.modbus.failures import LIBRARY_ERRORS, failed
from drivers.modbus.map_file import parse_map
from drivers.ports import Quality
from fakes.modbus_registers import Registers
from fakes.modbus_server import Misbehaviour, crc16
from tests.contract.modbus_rig import Line, line

BUDGET_S = 0.1
SLACK_S = 10.0  # a loaded machine; noise never ends, and pymodbus by itself waits for 12 s

MAP = """
schema = "stribeck.registers/1"
device = "bench"
source = "this test"
confirmed = "own"
address_base = 40001
word_order = "low-first"

[[register]]
name = "temperature"
address = 40101
type = "i16"
unit = "degC"
scale = 0.1
range = [-40, 150]
sentinels = [-32768]
quality = { register = "status", good = [0], mask = 1 }

[[register]]
name = "status"
address = 40102

[[register]]
name = "target"
address = 40103
type = "i32"
unit = "rad"
scale = 0.001
writable = true
"""


@pytest.fixture(params=["tcp", "rtu"])
def bench(request: pytest.FixtureRequest) -> Iterator[Line]:
    registers = Registers()
    registers.put(3, 100, 0, 0, 0, 0)
    registers.put(4, 7, 1, 2, 0xFFFF)
    registers.put(1, 3, 1, 0, 1)
    registers.put(2, 3, 0, 1)
    with line(request.param, registers) as made:
        yield made


def deadline(bench: Line, seconds: float = 60.0) -> float:
    return bench.clock.now() + seconds


def test_all_four_tables_are_read_and_two_are_written(bench: Line) -> None:
    ask = bench.connection
    assert ask.read(4, 7, 3, deadline(bench)) == (1, 2, 0xFFFF)
    assert ask.read(1, 3, 3, deadline(bench)) == (1, 0, 1)
    assert ask.read(2, 3, 2, deadline(bench)) == (0, 1)
    ask.write_registers(100, (7,), deadline(bench))
    ask.write_registers(101, (8, 9), deadline(bench))
    ask.write_coil(4, True, deadline(bench))
    assert ask.read(3, 100, 4, deadline(bench)) == (7, 8, 9, 0)
    assert bench.registers.get(1, 4) == (1,)


@pytest.mark.parametrize(
    ("kind", "error"),
    [
        ("silent", NodeMissingError),
        ("half", AnswerError),
        ("garbled", AnswerError),
        ("wrong-device", AnswerError),
    ],
)
def test_what_goes_wrong_once_ends_at_the_deadline_and_is_over(
    bench: Line, kind: str, error: type[DriverError]
) -> None:
    bench.server.misbehaviour = Misbehaviour(kind, count=1)
    began_s = bench.clock.now()
    with pytest.raises(error, match="reading 3 from 7"):
        bench.connection.read(4, 7, 3, began_s + BUDGET_S)
    assert bench.clock.now() - began_s < BUDGET_S + SLACK_S
    assert bench.connection.read(4, 7, 3, deadline(bench)) == (1, 2, 0xFFFF)


def test_noise_that_never_ends_does_not_stretch_the_deadline(bench: Line) -> None:
    """Bytes that trickle in would let pymodbus begin its time-out anew with each of them."""
    bench.server.misbehaviour = Misbehaviour("noise")
    began_s = bench.clock.now()
    with pytest.raises(AnswerError):
        bench.connection.read(4, 7, 3, began_s + BUDGET_S)
    assert bench.clock.now() - began_s < BUDGET_S + SLACK_S


def test_a_refusal_comes_at_once_with_its_code_and_the_line_stays_open(bench: Line) -> None:
    began_s = bench.clock.now()
    with pytest.raises(AnswerError, match="no such address") as caught:
        bench.connection.read(3, 900, 1, deadline(bench))
    assert caught.value.exception_code == 2
    assert bench.clock.now() - began_s < 30.0
    bench.server.misbehaviour = Misbehaviour("exception", count=1, code=6)
    with pytest.raises(AnswerError, match="busy"):
        bench.connection.read(4, 7, 1, deadline(bench))


def test_a_connection_that_is_cut_is_said_and_made_again() -> None:
    registers = Registers()
    registers.put(4, 7, 5)
    with line("tcp", registers) as bench:
        bench.server.misbehaviour = Misbehaviour("reset", count=1)
        with pytest.raises(BusError, match="broke"):
            bench.connection.read(4, 7, 1, deadline(bench))
        assert bench.connection.read(4, 7, 1, deadline(bench)) == (5,)


@pytest.mark.parametrize(
    "endpoint", [TcpEndpoint("127.0.0.1", 1), SerialEndpoint("/dev/no-such-line")]
)
def test_nobody_there_is_said_in_one_sentence(endpoint: TcpEndpoint | SerialEndpoint) -> None:
    clock = MonotonicClock()
    with pytest.raises(BusError, match="No connection to Modbus device 1 at"):
        ModbusConnection(endpoint, clock).read(3, 0, 1, clock.now() + 0.2)


def test_the_gap_between_two_requests_is_kept(bench: Line) -> None:
    gap_s = 0.03
    slow = ModbusConnection(bench.endpoint, bench.clock, min_gap_s=gap_s)
    bench.connection.close()  # a serial line has one owner
    try:
        began_s = bench.clock.now()
        for _ in range(4):
            slow.read(4, 7, 1, deadline(bench))
        assert bench.clock.now() - began_s >= 3 * gap_s
    finally:
        slow.close()


def test_a_map_reads_and_writes_by_name(bench: Line) -> None:
    device = MappedDevice(bench.connection, parse_map(MAP))
    device.write({"target": -70000.5}, deadline(bench))
    low, high = bench.registers.get(3, 102, 2)
    assert (high << 16 | low) - (1 << 32) == -70_000_500
    assert device.read(("target",), deadline(bench))["target"].value == pytest.approx(-70000.5)
    with pytest.raises(ValueError, match="not writable"):
        device.write({"status": 1}, deadline(bench))


@pytest.mark.parametrize(
    ("raw", "status", "quality", "value"),
    [
        (253, 0, Quality.GOOD, 25.3),
        (65536 - 30, 2, Quality.GOOD, -3.0),  # bit 0 alone is looked at
        (0x8000, 0, Quality.ABSENT, None),
        (253, 1, Quality.BAD, None),
        (2000, 0, Quality.BAD, None),
    ],
)
def test_a_value_is_a_number_only_when_it_is_to_be_believed(
    raw: int, status: int, quality: Quality, value: float | None
) -> None:
    registers = Registers()
    registers.put(3, 100, raw, status, 0, 0)
    with line("tcp", registers) as bench:
        device = MappedDevice(bench.connection, parse_map(MAP))
        found = device.read(("temperature",), deadline(bench))["temperature"]
    assert found.quality is quality
    if value is None:
        assert found.value != found.value
        assert found.reason
    else:
        assert found.value == pytest.approx(value)


def test_every_exception_of_the_library_is_mapped() -> None:
    classes = [
        c
        for _, c in inspect.getmembers(pymodbus.exceptions, inspect.isclass)
        if issubclass(c, pymodbus.exceptions.ModbusException)
        and c is not pymodbus.exceptions.ModbusException
    ]
    assert len(classes) >= 6
    for cls in classes:
        assert cls in LIBRARY_ERRORS, f"{cls.__name__} is not mapped"
        assert isinstance(failed(cls("x"), "there", "doing", 0, on_a_line=True), DriverError)


def test_the_fakes_crc_is_the_standards() -> None:
    # Modbus over serial line, appendix B: 02 07 gives 41 12 on the wire.
    assert crc16(b"\x02\x07").to_bytes(2, "little") == b"\x41\x12"
