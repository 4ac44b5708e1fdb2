"""A test that keeps time with the machine's own clock is run again where the machine stood still.

Such a test (marker `real_time`) drives a cycle whose deadlines are real. On a shared machine its
processes are now and then not run for tenths of a second; a drive or an adapter that misses its
deadline then is no finding. Whether that happened is measured while the test runs: only a failure
beside a standstill is run again, at most twice, and the summary says so.
"""

from __future__ import annotations

import threading
import time
from typing import Self

import pytest
from _pytest.runner import runtestprotocol

STANDSTILL_S = 0.08  # the shortest deadline of the cells that these tests drive is 0.1 s
_TICK_S = 0.01
_RUNS = 3


class Standstill:
    """The longest time that a thread which asks for a tick each 10 ms had to wait too long."""

    def __init__(self) -> None:
        self.longest_s = 0.0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="standstill")

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        before = time.monotonic()
        while not self._stop.wait(_TICK_S):
            now = time.monotonic()
            self.longest_s = max(self.longest_s, now - before - _TICK_S)
            before = now


def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Run a `real_time` test, and again where it failed beside a standstill."""
    if item.get_closest_marker("real_time") is None:
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for run in range(1, _RUNS + 1):
        with Standstill() as watch:
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
        failed = any(r.failed for r in reports)
        if run == _RUNS or not failed or watch.longest_s < STANDSTILL_S:
            break
        words = f"run {run} failed; the machine stood still for {watch.longest_s:.2f} s"
        item.add_report_section("call", "standstill", words)
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True
