"""Run a command where a real CAN bus is: on the host's vcan, or in User-Mode Linux.

In this order: the channel named by STRIBECK_CAN_CHANNEL, a `vcan0` that is up, a `vcan0` created
here (needs root and the host kernel's vcan module; it is taken away again), User-Mode Linux.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from tests.bus.process import run_bounded
from tests.bus.uml import SYSTEM_PATH, BootError, find_user_mode_linux

CHANNEL_VARIABLE = "STRIBECK_CAN_CHANNEL"
DEFAULT_CHANNEL = "vcan0"
INTERFACE_UP = 0x1  # IFF_UP, netdevice(7)


class VcanUnavailableError(Exception):
    """No real CAN bus can be had here; says why, means by means."""


class Vcan(Protocol):
    """A place where commands find a real CAN bus under the name `channel`."""

    @property
    def channel(self) -> str:
        """Name of the interface inside that place."""
        ...

    def describe(self) -> str:
        """Return in a few words where a command will run."""
        ...

    def run(
        self,
        command: Sequence[str],
        timeout_s: float,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """Run `command` there; `subprocess.TimeoutExpired` after `timeout_s` seconds."""
        ...


@dataclass(frozen=True)
class HostVcan:
    """A CAN interface of the host itself."""

    channel: str

    def describe(self) -> str:
        """Return in a few words where a command will run."""
        return f"{self.channel} of the host"

    def run(
        self,
        command: Sequence[str],
        timeout_s: float,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """Run `command` on the host, in a process group of its own."""
        return run_bounded(command, timeout_s, cwd, env)


@contextmanager
def open_vcan() -> Iterator[Vcan]:
    """Yield the best real CAN bus that this machine can offer.

    Raises
    ------
    VcanUnavailableError
        There is none, with the reason for each means.
    """
    named = os.environ.get(CHANNEL_VARIABLE, "")
    if named:
        trouble = _trouble_with(named)
        if trouble:
            raise VcanUnavailableError(f"{CHANNEL_VARIABLE}={named} cannot be used: {trouble}")
        yield HostVcan(named)
        return
    if not _trouble_with(DEFAULT_CHANNEL):
        yield HostVcan(DEFAULT_CHANNEL)
        return
    trouble = _create()
    if not trouble:
        try:
            yield HostVcan(DEFAULT_CHANNEL)
        finally:
            _ip("link", "delete", DEFAULT_CHANNEL)
        return
    with contextlib.ExitStack() as stack:
        try:
            guest = stack.enter_context(find_user_mode_linux().boot())
        except BootError as error:
            raise VcanUnavailableError(
                f"no real CAN bus here: the host has none ({trouble}), and neither has User-Mode "
                f"Linux ({error})"
            ) from error
        yield guest


def _trouble_with(channel: str) -> str:
    """Return why `channel` cannot carry frames now; empty when it can."""
    try:
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
            raw.bind((channel,))
        # bind() accepts a link that is down, and a trial frame could reach a real drive
        flags = int(Path(f"/sys/class/net/{channel}/flags").read_text(), 16)
    except (OSError, AttributeError) as error:
        return str(error)
    return "" if flags & INTERFACE_UP else f"{channel} is down"


def _create() -> str:
    """Create `vcan0` on the host; return why not, empty when it is up."""
    if os.geteuid() != 0:
        return "not root, so it cannot be created"
    if shutil.which("modprobe", path=SYSTEM_PATH):
        run_bounded(["modprobe", "vcan"], 20.0, env={"PATH": SYSTEM_PATH})
    added = _ip("link", "add", "dev", DEFAULT_CHANNEL, "type", "vcan")
    if added:
        return added
    up = _ip("link", "set", DEFAULT_CHANNEL, "up") or _trouble_with(DEFAULT_CHANNEL)
    if up:
        _ip("link", "delete", DEFAULT_CHANNEL)
    return up


def _ip(*arguments: str) -> str:
    """Run iproute2's `ip`; return its complaint, empty on success."""
    program = shutil.which("ip", path=SYSTEM_PATH)
    if program is None:
        return "iproute2 is not installed"
    result = run_bounded([program, *arguments], 20.0)
    return "" if result.returncode == 0 else result.stderr.strip() or "ip failed"
