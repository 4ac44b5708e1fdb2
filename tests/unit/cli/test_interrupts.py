"""Started in the background of a script: Ctrl-C is ignored here, and heard by what is started."""

from __future__ import annotations

import signal
import subprocess
import sys

CHILD = "import signal; print(signal.getsignal(signal.SIGINT) == signal.SIG_IGN)"
PARENT = f"""
import os, signal, subprocess, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)  # what a shell does to its background
from agent.cli.terminal.interrupts import ignore_by_handler
{{}}
os.kill(os.getpid(), signal.SIGINT)
subprocess.run([sys.executable, "-c", {CHILD!r}], check=True)
"""


def child_ignores(mended: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", PARENT.format(mended)], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_a_cycle_hears_the_stop_that_its_page_in_the_background_is_deaf_to() -> None:
    assert child_ignores("") == "True"
    assert child_ignores("ignore_by_handler()") == "False"


def test_where_ctrl_c_is_heard_nothing_changes() -> None:
    code = (
        "import signal; from agent.cli.terminal.interrupts import ignore_by_handler; "
        "ignore_by_handler(); "
        "assert signal.getsignal(signal.SIGINT) is signal.default_int_handler"
    )
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        subprocess.run([sys.executable, "-c", code], check=True)
    finally:
        signal.signal(signal.SIGINT, before)
