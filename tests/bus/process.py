"""Run a command with a bound on its time, and leave nothing of it running."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path


def run_bounded(
    command: Sequence[str],
    timeout_s: float,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Run `command` without standard input, in a session of its own, for at most `timeout_s`.

    Whatever the command started and left in its process group is killed before this returns,
    on every way out: a fake drive that outlives its test would answer the next one.

    Raises
    ------
    subprocess.TimeoutExpired
        With what had been written by then (as text) in `output` and `stderr`.
    """
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        cwd=cwd,
        env=env,
        start_new_session=True,
    ) as process:
        try:
            stdout, stderr = process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            kill_group(process.pid)
            stdout, stderr = process.communicate()
            raise subprocess.TimeoutExpired(command, timeout_s, stdout, stderr) from None
        finally:
            kill_group(process.pid)
    return subprocess.CompletedProcess(list(command), process.returncode, stdout, stderr)


def kill_group(group: int) -> None:
    """Kill every process of `group`; that none is left is what is wanted, not an error."""
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        return
