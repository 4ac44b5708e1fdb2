"""Elsewhere than on Linux: what works there loads there, and what is Linux's own says so."""

from __future__ import annotations

import ast
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.can.frames import CanBusConfig
from drivers.can.opening import may_read_fast, open_bus
from drivers.clock import MonotonicClock
from drivers.errors import BusError
from tests.conftest import REPOSITORY

UNIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
PACKAGES = ("agent", "drivers", "trajectories", "fakes")


def imported_at_once(path: Path) -> Iterator[str]:
    """Yield every module that loading a file imports, but for those in a function or a `try`."""
    waiting: list[ast.stmt] = list(ast.parse(path.read_text(encoding="utf-8")).body)
    while waiting:
        match waiting.pop():
            case ast.Import(names=names):
                yield from (name.name.partition(".")[0] for name in names)
            case ast.ImportFrom(module=str(module), level=0):
                yield module.partition(".")[0]
            case ast.If(body=body, orelse=orelse):
                waiting += [*body, *orelse]
            case ast.ClassDef(body=body) | ast.With(body=body):
                waiting += body
            case _:
                pass


def test_nothing_needs_a_unix_to_be_loaded() -> None:
    found = {
        str(path.relative_to(REPOSITORY)): sorted(UNIX_ONLY.intersection(imported_at_once(path)))
        for package in PACKAGES
        for path in (REPOSITORY / package).rglob("*.py")
    }
    assert len(found) > 300
    assert {path: modules for path, modules in found.items() if modules} == {}


@pytest.fixture(params=["win32", "darwin"])
def elsewhere(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Take from this platform what the other one lacks."""
    monkeypatch.setattr(sys, "platform", request.param)
    for name in ("AF_CAN", "PF_CAN", "CAN_RAW"):
        monkeypatch.delattr(socket, name, raising=False)
    return str(request.param)


def test_socketcan_elsewhere_is_said_to_be_linuxs_own(elsewhere: str) -> None:
    with pytest.raises(BusError) as caught:
        open_bus(CanBusConfig("socketcan", "can0"))
    assert caught.value.what == f"SocketCAN is Linux's own; this is {elsewhere}."
    assert "docs/adapters.md" in caught.value.do


def test_elsewhere_a_thread_receives(elsewhere: str) -> None:
    assert elsewhere
    assert not may_read_fast(CanBusConfig("socketcan", "can0"), MonotonicClock())
