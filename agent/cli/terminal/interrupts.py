"""Ctrl-C where it is ignored: by this program alone, not by every program that it starts.

A shell that starts a program in the background of a script has it ignore SIGINT, and what is
ignored stays so in each process that is started from there. The page and the night stop a cycle by
that very signal; sent before the cycle has its own handlers, it would be lost, and the joint would
move after somebody had asked that it should not. A handler that does nothing is not inherited.
"""

from __future__ import annotations

import signal
from types import FrameType


def ignore_by_handler() -> None:
    """Have a signal that is ignored be taken, and nothing done; call it in the main thread."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, _nothing)


def _nothing(_number: int, _frame: FrameType | None) -> None:
    """Do nothing."""
