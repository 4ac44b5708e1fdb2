"""The commands as a user starts them: processes of their own, ended by their own id."""

from __future__ import annotations

import functools
import io
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

import pytest
import typer

from agent.cli import main
from drivers.can.frames import CanBusConfig
from drivers.clock import MonotonicClock

_command_line = functools.cache(typer.main.get_command)  # 60 ms each time that it is built
STRIBECK = (sys.executable, "-m", "agent.cli")
MULTICAST_GROUP = "239.74.163.2"
PATIENCE_S = 900.0  # for what hangs; beside twenty busy programs a command took a minute


def stribeck(
    *arguments: str | Path, cwd: Path | None = None, timeout_s: float = PATIENCE_S
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(
        [*STRIBECK, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout_s,
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        check=False,
    )


def called(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a command to its end in this process: the same words and exit code, without a start."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(typer.main, "get_command", _command_line)
        patch.setattr(sys, "argv", ["stribeck", *map(str, arguments)])
        try:
            main()
        except SystemExit as ending:
            code = int(ending.code or 0)
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())


def be_patient(cell: Path) -> None:
    """Widen a cell's supervision: a late tick on a loaded test machine is not what is tested."""
    text = cell.read_text()
    for old, new in (
        ("heartbeat_timeout_s = 0.15", "heartbeat_timeout_s = 1.0"),
        ("drive_heartbeat_period_s = 0.1", "drive_heartbeat_period_s = 0.5"),
        ("sample_age_max_s = 0.1", "sample_age_max_s = 1.0"),
        ("samples_lost_in_a_row_max = 3", "samples_lost_in_a_row_max = 50"),
        ("velocity_error_max_rad_s = 20.0", "velocity_error_max_rad_s = 160.0"),
        ("following_error_max_arm_deg = 2.0", "following_error_max_arm_deg = 30.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    cell.write_text(text)


def free_udp_port() -> int:
    """Return a port that nobody uses now, so that two test runs never share a bus."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def multicast() -> CanBusConfig:
    """Return a bus between processes of this machine that nobody else uses now."""
    return CanBusConfig("udp_multicast", MULTICAST_GROUP, options={"port": free_udp_port()})


@contextmanager
def started(
    arguments: Sequence[str | Path], log: Path, ready: str = ""
) -> Iterator[subprocess.Popen[bytes]]:
    """Start a command, wait until its log says `ready`, end it afterwards."""
    with log.open("wb") as sink:
        process = subprocess.Popen(
            [*STRIBECK, *map(str, arguments)],
            stdout=sink,
            stderr=sink,
            stdin=subprocess.DEVNULL,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
    try:
        deadline = time.monotonic() + PATIENCE_S
        while ready and ready not in log.read_text(errors="replace"):
            assert process.poll() is None, log.read_text(errors="replace")
            assert time.monotonic() < deadline, f"not ready: {log.read_text(errors='replace')}"
            MonotonicClock().sleep_until(time.monotonic() + 0.05)
        yield process
    finally:
        process.terminate()
        try:
            process.wait(timeout=30.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
