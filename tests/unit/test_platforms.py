"""Elsewhere than on Linux: what works there loads there, and what is Linux's own says so."""

from __future__ import annotations

import ast
import getpass
import os
import re
import signal
import socket
import subprocess
import sys
import time
import types
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import Mock

import pytest

from agent.cli.devices.fake import FakeRequest, run_fake
from agent.cli.night import cell as night_cell
from agent.cycle.axis_lock import FOLDER_VARIABLE, user_name
from agent.record.atomic import sync
from agent.record.lock import try_lock
from agent.web import locks
from drivers import clock
from drivers.can.frames import CanBusConfig
from drivers.can.opening import may_read_fast, open_bus
from drivers.clock import MonotonicClock
from drivers.errors import BusError
from tests.conftest import REPOSITORY

UNIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
PACKAGES = ("agent", "drivers", "trajectories", "fakes")

NOT_ON_WINDOWS = {
    "os": """chown fchmod fchown fork forkpty geteuid getgid getpgid getuid killpg lockf
        memfd_create mkfifo nice openpty pidfd_open posix_fadvise posix_fallocate pread preadv
        pwrite pwritev readv register_at_fork SCHED_FIFO SCHED_OTHER SCHED_RESET_ON_FORK SCHED_RR
        SCHED_BATCH sched_getaffinity sched_getparam sched_getscheduler sched_param
        sched_setaffinity sched_setscheduler sendfile setpriority setsid statvfs uname wait3 wait4
        writev O_CLOEXEC O_DIRECTORY O_DSYNC O_NOFOLLOW O_NONBLOCK O_SYNC""",
    "signal": """pthread_kill pthread_sigmask setitimer sigtimedwait sigwait SIGALRM SIGCHLD SIGCONT
        SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGUSR1 SIGUSR2""",
    "socket": "AF_CAN AF_NETLINK AF_UNIX CAN_RAW MSG_DONTWAIT MSG_NOSIGNAL PF_CAN SO_REUSEPORT",
    "select": "POLLIN epoll poll",
    "time": """CLOCK_BOOTTIME CLOCK_MONOTONIC CLOCK_REALTIME clock_getres clock_gettime
        clock_settime pthread_getcpuclockid""",
}
"""What the standard library has on Unix alone; typeshed says the same (see `docs/adapters.md`)."""

GUARDED = {
    "drivers/can_reader/reader.py": {"select.POLLIN", "select.poll", "signal.SIGKILL"},
    "drivers/can_reader/ring.py": {"os.memfd_create"},
    "drivers/clock.py": {"time.CLOCK_BOOTTIME", "time.CLOCK_MONOTONIC", "time.clock_gettime"},
    "agent/cli/page/run.py": {"signal.pthread_kill"},
    "agent/cycle/precedence.py": {
        *("os.SCHED_BATCH", "os.SCHED_FIFO", "os.SCHED_OTHER", "os.SCHED_RESET_ON_FORK"),
        *("os.SCHED_RR", "os.sched_getparam", "os.sched_getscheduler", "os.sched_param"),
        "os.sched_setscheduler",
    },
}
"""Where it may be used, behind `sys.platform`; elsewhere it would be an AttributeError on Windows.

`tests/check.py` has mypy see that the guards are real, on both other platforms.
"""


def imported_at_once(path: Path) -> Iterator[str]:
    """Yield every module that loading a file imports, but for those in a function or a `try`."""
    text = path.read_text(encoding="utf-8")
    if not any(module in text for module in UNIX_ONLY):
        return  # parsing is what takes time
    waiting: list[ast.stmt] = list(ast.parse(text).body)
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


NAMED = re.compile(
    "|".join(rf"{home}\.(?:{'|'.join(names.split())})\b" for home, names in NOT_ON_WINDOWS.items())
)


def unix_names(path: Path) -> set[str]:
    """Return what a file takes from the standard library that Windows has not."""
    text = path.read_text(encoding="utf-8")
    if not NAMED.search(text):
        return set()  # parsing is what takes time
    return {
        f"{node.value.id}.{node.attr}"
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.attr in NOT_ON_WINDOWS.get(node.value.id, "").split()
    }


def test_what_windows_has_not_is_used_where_it_is_guarded_and_nowhere_else() -> None:
    found = {
        path.relative_to(REPOSITORY).as_posix(): unix_names(path)
        for package in PACKAGES
        for path in (REPOSITORY / package).rglob("*.py")
    }
    assert {path: names for path, names in found.items() if names} == GUARDED


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
    with pytest.raises(BusError, match="Linux's own"):
        run_fake(FakeRequest("socketcan", "vcan0", (), 1, 1, None), None, short=True)


def test_elsewhere_a_thread_receives(elsewhere: str) -> None:
    assert elsewhere
    assert not may_read_fast(CanBusConfig("socketcan", "can0"), MonotonicClock())


@pytest.mark.parametrize("platform", ["linux", "darwin", "win32"])
def test_time_goes_on_while_the_machine_sleeps(
    platform: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the newest sample would be fresh after an hour's sleep, and the motion would go on."""
    told = {"linux": "CLOCK_BOOTTIME", "darwin": "CLOCK_MONOTONIC"}
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(time, "clock_gettime", lambda number: f"clock {number}", raising=False)
    monkeypatch.setattr(time, "perf_counter", lambda: "perf_counter")
    monkeypatch.setattr(time, "CLOCK_BOOTTIME", "CLOCK_BOOTTIME", raising=False)
    monkeypatch.setattr(time, "CLOCK_MONOTONIC", "CLOCK_MONOTONIC", raising=False)
    expected = f"clock {told[platform]}" if platform in told else "perf_counter"
    assert str(clock._time_asleep_included()()) == expected  # every clock tells its name here


@pytest.mark.parametrize("error", [ImportError("pwd"), KeyError("uid 1000"), OSError()])
def test_a_user_without_a_name_is_unknown(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(getpass, "getuser", Mock(side_effect=error))
    assert user_name() == "unknown"


def test_on_windows_a_look_at_a_lock_ends_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There `os.kill` ends a process, whatever the number: signal 0 asks on Unix alone."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    (tmp_path / "stribeck.cell.lock").write_text('{"pid": 1}')
    killed: list[int] = []
    monkeypatch.setattr(os, "kill", lambda pid, _signal: killed.append(pid))
    monkeypatch.setattr(sys, "platform", "win32")
    assert locks._names_the_living("cell")
    assert not killed
    monkeypatch.setattr(sys, "platform", "linux")
    assert locks._names_the_living("cell")
    assert killed == [1]


def test_on_windows_one_byte_is_locked_that_a_runtime_can_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As seen under Wine: its C runtime holds the position in 32 bits, so no recording began."""
    refusals: list[OSError] = []

    def locking(descriptor: int, _mode: int, count: int) -> None:
        assert 0 < os.lseek(descriptor, 0, os.SEEK_CUR) < 2**31 - count
        if refusals:
            raise refusals.pop()

    monkeypatch.setitem(sys.modules, "msvcrt", types.SimpleNamespace(LK_NBLCK=2, locking=locking))
    monkeypatch.setattr(sys, "platform", "win32")
    with (tmp_path / "some.arrows").open("w+b") as file:
        file.write(b"rows")
        file.flush()
        assert try_lock(file.fileno())
        assert os.lseek(file.fileno(), 0, os.SEEK_CUR) == 4
        refusals.append(OSError(0, "held, and no reason given"))
        assert not try_lock(file.fileno())


def test_the_night_asks_its_cycle_by_the_signal_that_the_platform_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(signal, "CTRL_BREAK_EVENT", 1, raising=False)
    for platform, number in (("win32", 1), ("linux", signal.SIGINT), ("darwin", signal.SIGINT)):
        child = Mock(spec=subprocess.Popen)
        monkeypatch.setattr(sys, "platform", platform)
        night_cell._ask_to_stop(child)
        child.send_signal.assert_called_once_with(number)


@pytest.mark.parametrize("known", [True, False])
def test_on_macos_a_file_is_brought_to_the_disk_and_not_to_its_cache(
    known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    fcntl, synced = Mock(F_FULLFSYNC=51), Mock()
    if not known:  # a network's file system
        fcntl.fcntl.side_effect = OSError(45, "Operation not supported")
    monkeypatch.setitem(sys.modules, "fcntl", fcntl)
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(os, "fsync", synced)
    sync(7)
    fcntl.fcntl.assert_called_once_with(7, 51)
    assert synced.call_args_list == ([] if known else [((7,),)])
