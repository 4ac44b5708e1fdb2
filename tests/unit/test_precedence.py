from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from agent.cycle.precedence import PRIORITY, before_others, scheduling

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="sched(7) is Linux's")
FIFO = f"SCHED_FIFO {PRIORITY}"
SAY = "from agent.cycle.precedence import scheduling; print(scheduling())"


def may_be_first() -> bool:
    """Try it in a process of its own, by the system's tool."""
    return subprocess.run(["chrt", "-f", str(PRIORITY), "true"], check=False).returncode == 0


def test_every_thread_goes_first_and_back_again() -> None:
    expected = FIFO if may_be_first() else "ordinary"
    asked, answered, over = threading.Event(), threading.Event(), threading.Event()
    said: list[str] = []

    def lived_before() -> None:
        for _ in range(2):
            assert asked.wait(60.0)
            asked.clear()
            said.append(scheduling())
            answered.set()
        over.wait(60.0)

    def ask() -> None:
        answered.clear()
        asked.set()
        assert answered.wait(60.0)

    thread = threading.Thread(target=lived_before)
    thread.start()
    with before_others():
        said.append(scheduling())
        ask()
        # what reads the bus is started inside, and inherits it
        child = subprocess.run(
            [sys.executable, "-c", SAY], capture_output=True, text=True, check=True
        )
    said.append(scheduling())
    ask()
    over.set()
    thread.join()
    assert child.stdout.strip() == expected, child.stderr
    assert said == [expected, expected, "ordinary", "ordinary"]


def test_who_was_given_a_policy_of_their_own_keeps_it() -> None:
    code = (
        "from agent.cycle.precedence import before_others, scheduling\n"
        "with before_others(): print(scheduling())\n"
        "print(scheduling())"
    )
    command = ["chrt", "--batch", "0", sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["SCHED_BATCH", "SCHED_BATCH"]


def test_who_may_not_is_ordinary_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise PermissionError("Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    with before_others():
        assert scheduling() == "ordinary"
