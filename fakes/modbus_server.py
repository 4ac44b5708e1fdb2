"""Modbus servers of the fakes' own, on TCP and on a serial line, around `Registers`.

`step` serves what waits and returns; who calls it in a loop is a
process, a thread or a test. A `Misbehaviour` makes it answer as broken devices do.
"""

from __future__ import annotations

import os
import select
import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from fakes.modbus_registers import WRITE_REGISTERS, Registers

NOISE = bytes(1000)
READ_HOLDING, READ_INPUT = 3, 4


@dataclass
class Misbehaviour:
    """How the next `count` answers go wrong (0: all of them from now on).

    Parameters
    ----------
    kind : str
        ``deaf`` (nothing is heard, as with the cable out), ``silent`` (heard and done, but not
        answered), ``half`` (half a reply), ``garbled`` (wrong CRC, or a wrong protocol id on
        TCP), ``reset`` (the connection is cut), ``exception`` (with `code`), ``wrong-device``,
        ``trickle`` (one byte a step), ``noise`` (the same, and never a reply), ``swapped-words``
        (registers that are read come in pairs the wrong way round).
    """

    kind: str
    count: int = 0
    code: int = 4


class Server(Protocol):
    """Serves what waits, at most `wait_s` long."""

    def step(self, wait_s: float) -> None:
        """Answer the requests that have come."""
        ...

    def close(self) -> None:
        """Let go of sockets and lines."""
        ...


class _Manners:
    """Applies a `Misbehaviour`, and forgets it when it has been applied often enough."""

    def __init__(self) -> None:
        self.misbehaviour: Misbehaviour | None = None
        self.requests = 0

    def spoil(self) -> Misbehaviour | None:
        self.requests += 1
        fault = self.misbehaviour
        if fault is not None and fault.count:
            fault.count -= 1
            if not fault.count:
                self.misbehaviour = None
        return fault


class TcpServer(_Manners):
    """Modbus TCP on a loopback port of its own choice.

    Parameters
    ----------
    registers : Registers
        What it serves, whatever the unit that is asked for.
    port : int
        0: a free one, see `port`.
    """

    def __init__(self, registers: Registers, port: int = 0) -> None:
        super().__init__()
        self.registers = registers
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._clients: dict[socket.socket, bytearray] = {}
        self._trickle: list[tuple[socket.socket, bytes]] = []

    def step(self, wait_s: float) -> None:
        """Accept, read and answer."""
        self._drip()
        ready, _, _ = select.select([self._listener, *self._clients], [], [], wait_s)
        for source in ready:
            if source is self._listener:
                client, _ = self._listener.accept()
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._clients[client] = bytearray()
                continue
            try:
                data = source.recv(4096)
            except OSError:
                data = b""
            if not data:
                self._drop(source)
                continue
            self._clients[source] += data
            self._serve(source)

    def close(self) -> None:
        """Close every connection and the port."""
        for client in list(self._clients):
            self._drop(client)
        self._listener.close()

    def _serve(self, client: socket.socket) -> None:
        for header, pdu in _mbap_frames(self._clients[client]):
            fault = self.spoil()
            if fault is not None and fault.kind == "deaf":
                continue
            answer = _spoiled(self.registers.answer(pdu), fault)
            tid, protocol, _, unit = struct.unpack(">HHHB", header)
            if fault is not None and fault.kind == "garbled":
                protocol = 0xDEAD
            if fault is not None and fault.kind == "wrong-device":
                tid = tid + 1 & 0xFFFF
            frame = struct.pack(">HHHB", tid, protocol, len(answer) + 1, unit) + answer
            self._send(client, frame, fault)

    def _send(self, client: socket.socket, frame: bytes, fault: Misbehaviour | None) -> None:
        kind = "" if fault is None else fault.kind
        if kind == "silent":
            return
        if kind == "reset":
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._drop(client)
            return
        if kind in ("trickle", "noise"):
            self._trickle.append((client, frame if kind == "trickle" else NOISE))
            return
        try:
            client.sendall(frame[: len(frame) // 2] if kind == "half" else frame)
        except OSError:
            self._drop(client)

    def _drip(self) -> None:
        waiting, self._trickle = self._trickle, []
        for client, rest in waiting:
            try:
                client.send(rest[:1])
            except OSError:
                continue
            if len(rest) > 1:
                self._trickle.append((client, rest[1:]))

    def _drop(self, client: socket.socket) -> None:
        self._clients.pop(client, None)
        client.close()


def _mbap_frames(buffer: bytearray) -> Iterator[tuple[bytes, bytes]]:
    """Take whole frames out of `buffer`: header (7 bytes) and request."""
    while len(buffer) >= 8:
        length = int.from_bytes(buffer[4:6], "big")
        if len(buffer) < 6 + length:
            return
        header, pdu = bytes(buffer[:7]), bytes(buffer[7 : 6 + length])
        del buffer[: 6 + length]
        yield header, pdu


class RtuServer(_Manners):
    """Modbus RTU on a file descriptor: one end of a pty pair, or a serial line.

    Parameters
    ----------
    registers : Registers
        What it serves.
    descriptor : int
        Opened, raw; it belongs to the caller.
    device_id : int
        Requests for others are not answered.
    """

    def __init__(self, registers: Registers, descriptor: int, device_id: int = 1) -> None:
        super().__init__()
        self.registers = registers
        self.device_id = device_id
        self._descriptor = descriptor
        self._buffer = bytearray()
        self._trickle = b""

    def step(self, wait_s: float) -> None:
        """Read and answer."""
        if self._trickle:
            os.write(self._descriptor, self._trickle[:1])
            self._trickle = self._trickle[1:]
        ready, _, _ = select.select([self._descriptor], [], [], wait_s)
        if not ready:
            return
        try:
            self._buffer += os.read(self._descriptor, 256)
        except OSError:  # the other end of a pty is closed at the moment
            return
        while (request := _take_rtu(self._buffer)) is not None:
            if request[0] == self.device_id:
                self._reply(request[1:])

    def close(self) -> None:
        """Do nothing: the descriptor is the caller's."""

    def _reply(self, pdu: bytes) -> None:
        fault = self.spoil()
        kind = "" if fault is None else fault.kind
        if kind == "deaf":
            return
        answer = _spoiled(self.registers.answer(pdu), fault)
        device = self.device_id + (kind == "wrong-device")
        body = bytes([device]) + answer
        check = crc16(body) ^ (0x5555 if kind == "garbled" else 0)
        frame = body + struct.pack("<H", check)
        if kind in ("silent", "reset"):
            return
        if kind == "half":
            frame = frame[: len(frame) // 2]
        if kind in ("trickle", "noise"):
            self._trickle += frame if kind == "trickle" else NOISE
            return
        os.write(self._descriptor, frame)


def _spoiled(answer: bytes, fault: Misbehaviour | None) -> bytes:
    """Return what a broken device answers on either line; `answer` is function code and data."""
    if fault is None:
        return answer
    if fault.kind == "exception":
        return bytes([answer[0] | 0x80, fault.code])
    if fault.kind == "swapped-words" and answer[0] in (READ_HOLDING, READ_INPUT):
        words = [answer[at : at + 2] for at in range(2, len(answer), 2)]
        for at in range(0, len(words) - 1, 2):
            words[at], words[at + 1] = words[at + 1], words[at]
        return answer[:2] + b"".join(words)
    return answer


def _take_rtu(buffer: bytearray) -> bytes | None:
    """Take one request out of `buffer`, address and PDU without its CRC; junk is thrown away."""
    while len(buffer) >= 8:
        length = 8
        if buffer[1] == WRITE_REGISTERS:
            length = 9 + buffer[6]
        if len(buffer) < length:
            return None
        frame = bytes(buffer[:length])
        if struct.unpack("<H", frame[-2:])[0] == crc16(frame[:-2]):
            del buffer[:length]
            return frame[:-2]
        del buffer[:1]
    return None


def crc16(data: bytes) -> int:
    """Return the CRC of Modbus over serial line (polynomial 0xA001, reflected, start 0xFFFF)."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc
