"""Habits of pymodbus 3.16 that the Modbus client leans on or works around: an upgrade must tell."""

from __future__ import annotations

import inspect
import time
from collections.abc import Iterator

import pytest
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusIOException
from pymodbus.pdu import ExceptionResponse

from fakes.modbus_registers import Registers
from fakes.modbus_server import Misbehaviour, TcpServer
from tests.contract.modbus_rig import served


@pytest.fixture
def server() -> Iterator[TcpServer]:
    registers = Registers()
    registers.put(3, 0, 11, 12)
    made = TcpServer(registers)
    with served(made):
        yield made


def client(server: TcpServer, **options: float) -> ModbusTcpClient:
    made = ModbusTcpClient("127.0.0.1", port=server.port, **options)  # type: ignore[arg-type]  # numbers
    assert made.connect()  # type: ignore[no-untyped-call]  # the library's is untyped
    return made


def test_count_and_device_id_are_keyword_only() -> None:
    for cls in (ModbusTcpClient, ModbusSerialClient):
        parameters = inspect.signature(cls.read_holding_registers).parameters
        assert parameters["count"].kind is inspect.Parameter.KEYWORD_ONLY
        assert parameters["device_id"].kind is inspect.Parameter.KEYWORD_ONLY


def test_a_protocol_error_is_returned_and_not_raised(server: TcpServer) -> None:
    asked = client(server)
    reply = asked.read_holding_registers(77, count=1)
    assert isinstance(reply, ExceptionResponse)
    assert reply.isError()
    assert reply.exception_code == 2
    asked.close()  # type: ignore[no-untyped-call]  # the library's is untyped


def test_a_dead_peer_does_not_raise_on_connect() -> None:
    dead = ModbusTcpClient("127.0.0.1", port=1, timeout=0.2)
    assert dead.connect() is False  # type: ignore[no-untyped-call]  # the library's is untyped
    assert ModbusSerialClient("/dev/no-such-line").connect() is False


def test_blocking_time_is_retries_plus_one_times_the_time_out(server: TcpServer) -> None:
    server.misbehaviour = Misbehaviour("silent")
    asked = client(server, timeout=0.05, retries=2)
    began = time.monotonic()
    with pytest.raises(ModbusIOException):
        asked.read_holding_registers(0, count=1)
    assert time.monotonic() - began >= 0.15
    while server.requests < 3:  # its thread may take the last one later than we give it up
        time.sleep(0.01)  # noqa: TID251 - a wait for another thread
    assert server.requests == 3
    asked.close()  # type: ignore[no-untyped-call]  # the library's is untyped


def test_a_wait_takes_its_time_out_from_comm_params_each_time(server: TcpServer) -> None:
    """What lets a deadline be kept without a client for each request."""
    server.misbehaviour = Misbehaviour("silent")
    asked = client(server, timeout=60.0, retries=0)
    asked.comm_params.timeout_connect = 0.05
    began = time.monotonic()
    with pytest.raises(ModbusIOException):
        asked.read_holding_registers(0, count=1)
    assert time.monotonic() - began < 30.0
    asked.close()  # type: ignore[no-untyped-call]  # the library's is untyped


def test_the_trace_of_packets_sees_both_directions_and_all_bytes_so_far(server: TcpServer) -> None:
    seen: list[tuple[bool, int]] = []

    def saw(sending: bool, data: bytes) -> bytes:
        seen.append((sending, len(data)))
        return data

    asked = ModbusTcpClient("127.0.0.1", port=server.port, timeout=60.0, trace_packet=saw)
    assert asked.read_holding_registers(0, count=2).registers == [11, 12]
    assert seen == [(True, 12), (False, 13)]
    asked.close()  # type: ignore[no-untyped-call]  # the library's is untyped
