"""Fake Modbus devices on real sockets and pty pairs, served by a thread of the test's own."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import threading
import tty
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from drivers.modbus import connection
from drivers.modbus.connection import Endpoint, ModbusConnection, SerialEndpoint, TcpEndpoint
from fakes.modbus_registers import Registers
from fakes.modbus_server import RtuServer, Server, TcpServer

PATIENCE_S = 60.0


@contextlib.contextmanager
def served(server: Server, between: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Serve in a thread while the block runs; `between` is called between two steps."""
    stop = threading.Event()

    def serve() -> None:
        while not stop.is_set():
            server.step(0.002)
            between()

    thread = threading.Thread(target=serve, name="fake modbus server")
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
        server.close()


@contextlib.contextmanager
def unhurried(server: TcpServer | RtuServer) -> Iterator[None]:
    """Let a client's time-out begin when its request was taken, while the block runs.

    In simulated time an answer that comes is in time: what serves it is a thread, and a machine
    that gives it no processor for a quarter of a second is no fault of the line.
    """
    taken = server.requests

    def begin(budget: Any, deadline_s: float) -> None:
        nonlocal taken
        taken = server.requests
        begins(budget, deadline_s)

    def first_taken(receives: Callable[[Any, int | None], bytes]) -> Any:
        def recv(client: Any, size: int | None) -> bytes:
            ends_s = clock.now() + PATIENCE_S
            while server.requests == taken and clock.now() < ends_s:
                if select.select([client.socket], [], [], 0.02)[0]:
                    break
            return receives(client, size)

        return recv

    clock, begins = MonotonicClock(), connection._Budget.begin
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(connection._Budget, "begin", begin)
        for client in (connection._TcpClient, connection._SerialClient):
            patch.setattr(client, "recv", first_taken(client.recv))
        yield


@contextlib.contextmanager
def pty_pair() -> Iterator[tuple[int, str]]:
    """Yield the fake's end of a serial line, as a descriptor, and the path of the agent's."""
    ours, theirs = pty.openpty()
    try:
        tty.setraw(ours)
        tty.setraw(theirs)
        yield ours, os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


@dataclass
class Line:
    """A fake device on one kind of line, and a connection to it."""

    registers: Registers
    server: TcpServer | RtuServer
    endpoint: Endpoint
    connection: ModbusConnection
    clock: MonotonicClock


@contextlib.contextmanager
def line(kind: str, registers: Registers) -> Iterator[Line]:
    """Yield `registers` served on ``tcp`` or ``rtu``, with a connection to them."""
    clock = MonotonicClock()
    with contextlib.ExitStack() as stack:
        server: TcpServer | RtuServer
        endpoint: Endpoint
        if kind == "tcp":
            server = TcpServer(registers)
            endpoint = TcpEndpoint("127.0.0.1", server.port)
        else:
            descriptor, path = stack.enter_context(pty_pair())
            server = RtuServer(registers, descriptor)
            endpoint = SerialEndpoint(path, baudrate=115_200, parity="N")
        stack.enter_context(served(server))
        stack.enter_context(unhurried(server))
        asks = ModbusConnection(endpoint, clock)
        stack.callback(asks.close)
        yield Line(registers, server, endpoint, asks, clock)
