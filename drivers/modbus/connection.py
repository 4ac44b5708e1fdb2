"""One connection to one Modbus device: a request is one try, and its deadline is kept.

pymodbus blocks for (retries + 1) x timeout, returns protocol errors instead of raising them, and
takes whatever comes late on a serial line for the answer to the next request. Here there are no
retries, what waits is bounded by the deadline that is handed in, every error is raised as ours,
and a connection on which something went wrong is closed, so that no late answer outlives it.

Not thread-safe: one owner per connection (`drivers.polling.Poller` where it is polled).
"""

from __future__ import annotations

import math
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import serial  # type: ignore[import-untyped]  # pyserial has no types
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.pdu import ExceptionResponse, ModbusPDU

from drivers.clock import Clock
from drivers.errors import AnswerError
from drivers.modbus.failures import CONNECTING_FAILURES, FAILURES, failed, not_connected, refused
from drivers.modbus.register_map import COILS, DISCRETE_INPUTS, HOLDING, INPUT

_WRITE_S = 0.05
"""What handing a request to the serial line may take at least: a few bytes into a buffer."""

_SHORTEST_S = 1e-3
"""What a socket is given even when the deadline has just passed."""


@dataclass(frozen=True)
class TcpEndpoint:
    """A device, or a gateway, that listens on TCP.

    Parameters
    ----------
    host : str
        Name or address.
    port : int
        502 unless the cell says otherwise.
    """

    host: str
    port: int = 502

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


@dataclass(frozen=True)
class SerialEndpoint:
    """A serial line with devices that speak Modbus RTU.

    Parameters
    ----------
    port : str
        ``/dev/ttyUSB0``, ``COM3``.
    baudrate : int
        Bit/s.
    parity : str
        ``N``, ``E`` or ``O``; the standard's own default is even.
    stopbits : int
        1 or 2.
    """

    port: str
    baudrate: int = 19_200
    parity: Literal["N", "E", "O"] = "E"
    stopbits: Literal[1, 2] = 1

    def __str__(self) -> str:
        return self.port

    @property
    def silence_s(self) -> float:
        """Return the 3.5 characters of silence that end an RTU frame (1.75 ms above 19200)."""
        bits = 1 + 8 + (self.parity != "N") + self.stopbits
        return max(3.5 * bits / self.baudrate, 1.75e-3)


Endpoint = TcpEndpoint | SerialEndpoint
_Call = Callable[[], ModbusPDU]


class _Budget:
    """The time that one request has left, and how many bytes it has been answered with."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.deadline_s = math.inf
        self.bytes_received = 0

    def begin(self, deadline_s: float) -> None:
        self.deadline_s = deadline_s
        self.bytes_received = 0

    def left_s(self) -> float:
        return max(self.deadline_s - self._clock.now(), _SHORTEST_S)

    def saw(self, sending: bool, data: bytes) -> bytes:
        """Count what came: pymodbus's trace of the bytes; it hands over all that it has so far."""
        if not sending:
            self.bytes_received = max(self.bytes_received, len(data))
        return data


class _TcpClient(ModbusTcpClient):
    """pymodbus's client whose every wait ends with the budget, and whose connect says why not."""

    budget: _Budget

    def connect(self) -> bool:
        if self.socket is None:
            address = (self.comm_params.host, self.comm_params.port)
            self.socket = socket.create_connection(address, timeout=self.budget.left_s())
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return True

    def recv(self, size: int | None) -> bytes:
        self.comm_params.timeout_connect = self.budget.left_s()
        return super().recv(size)


class _SerialClient(ModbusSerialClient):
    """pymodbus's client whose every wait ends with the budget, and whose connect says why not."""

    budget: _Budget

    def connect(self) -> bool:
        if self.socket is None:
            line = self.comm_params
            self.socket = serial.serial_for_url(
                line.host,
                baudrate=line.baudrate,
                bytesize=line.bytesize,
                parity=line.parity,
                stopbits=line.stopbits,
                timeout=0.0,
                exclusive=True,
            )
        self.socket.write_timeout = max(self.budget.left_s(), _WRITE_S)
        return True

    def recv(self, size: int | None) -> bytes:
        self.comm_params.timeout_connect = self.budget.left_s()
        return super().recv(size)


class ModbusConnection:
    """Requests to one device; connects when it has to.

    Parameters
    ----------
    endpoint : TcpEndpoint or SerialEndpoint
        Where the device is.
    clock : Clock
        Deadlines and gaps are on it.
    device_id : int
        The unit (TCP) or station (RTU).
    min_gap_s : float
        Silence that the device wants before and after each request.
    """

    def __init__(
        self, endpoint: Endpoint, clock: Clock, *, device_id: int = 1, min_gap_s: float = 0.0
    ) -> None:
        self.endpoint = endpoint
        self.device_id = device_id
        self.where = f"Modbus device {device_id} at {endpoint}"
        self._clock = clock
        self._gap_s = min_gap_s
        if isinstance(endpoint, SerialEndpoint):
            self._gap_s = max(min_gap_s, endpoint.silence_s)
        self._quiet_until_s = -math.inf
        self._budget = _Budget(clock)
        self._client = _client(endpoint, self._budget)

    def read(self, function: int, address: int, count: int, deadline_s: float) -> tuple[int, ...]:
        """Return `count` registers, or bits as 0 and 1.

        Parameters
        ----------
        function : int
            1 coils, 2 discrete inputs, 3 holding registers, 4 input registers.
        address, count : int
            As they go over the wire.
        deadline_s : float
            On the injected clock.

        Raises
        ------
        BusError, NodeMissingError, AnswerError
            As `drivers.modbus.failures` has it.
        """
        doing = f"reading {count} from {address} with function {function}"
        client = self._connected(deadline_s)
        call = {
            COILS: client.read_coils,
            DISCRETE_INPUTS: client.read_discrete_inputs,
            HOLDING: client.read_holding_registers,
            INPUT: client.read_input_registers,
        }[function]
        reply = self._exchange(
            doing, function, lambda: call(address, count=count, device_id=self.device_id)
        )
        if function in (COILS, DISCRETE_INPUTS):
            values = tuple(int(bit) for bit in reply.bits[:count])
        else:
            values = tuple(reply.registers)
        if len(values) != count:
            self.close()
            raise AnswerError(
                f"{self.where} answered {len(values)} values, expected {count} ({doing}).",
                "Check that no other program talks on the same line.",
            )
        return values

    def write_registers(self, address: int, words: Sequence[int], deadline_s: float) -> None:
        """Write holding registers: one with function 6, several with function 16.

        Raises
        ------
        BusError, NodeMissingError, AnswerError
            As for `read`. An order that was not confirmed may have been carried out.
        """
        doing = f"writing {len(words)} to {address}"
        client = self._connected(deadline_s)
        if len(words) == 1:
            self._exchange(
                doing,
                6,
                lambda: client.write_register(address, words[0], device_id=self.device_id),
            )
        else:
            self._exchange(
                doing,
                16,
                lambda: client.write_registers(address, list(words), device_id=self.device_id),
            )

    def write_coil(self, address: int, value: bool, deadline_s: float) -> None:
        """Write one coil."""
        doing = f"writing coil {address}"
        client = self._connected(deadline_s)
        self._exchange(
            doing, 5, lambda: client.write_coil(address, value, device_id=self.device_id)
        )

    def close(self) -> None:
        """Let the line go; the next request takes it up again."""
        self._client.close()  # type: ignore[no-untyped-call]  # pymodbus's is untyped

    def _connected(self, deadline_s: float) -> _TcpClient | _SerialClient:
        """Return the client, connected, after the silence that the device wants."""
        self._budget.begin(deadline_s)
        client = self._client
        try:
            client.connect()
        except CONNECTING_FAILURES as error:
            self.close()
            raise not_connected(error, self.where) from error
        self._clock.sleep_until(min(self._quiet_until_s, deadline_s))
        client.comm_params.timeout_connect = self._budget.left_s()
        return client

    def _exchange(self, doing: str, function: int, call: _Call) -> ModbusPDU:
        """Make one request and return its reply, which is the reply to this very request."""
        try:
            reply = call()
        except FAILURES as error:
            self.close()
            on_a_line = isinstance(self.endpoint, SerialEndpoint)
            received = self._budget.bytes_received
            raise failed(error, self.where, doing, received, on_a_line=on_a_line) from error
        finally:
            self._quiet_until_s = self._clock.now() + self._gap_s
        if isinstance(reply, ExceptionResponse):
            raise refused(self.where, doing, reply.exception_code)
        if reply.isError() or reply.function_code != function:
            self.close()
            raise AnswerError(
                f"{self.where} answered function {reply.function_code}, expected {function} "
                f"({doing}).",
                "Check that no other program talks on the same line.",
            )
        return reply


def _client(endpoint: Endpoint, budget: _Budget) -> _TcpClient | _SerialClient:
    client: _TcpClient | _SerialClient
    if isinstance(endpoint, TcpEndpoint):
        client = _TcpClient(endpoint.host, port=endpoint.port, retries=0, trace_packet=budget.saw)
    else:
        client = _SerialClient(
            endpoint.port,
            baudrate=endpoint.baudrate,
            parity=endpoint.parity,
            stopbits=endpoint.stopbits,
            retries=0,
            trace_packet=budget.saw,
        )
    client.budget = budget
    return client
