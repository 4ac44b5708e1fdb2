"""A command takes one core for its linear algebra, unless the user gives it more."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from agent.cli.terminal.threads import LINEAR_ALGEBRA
from tests.system.processes import called


def test_one_thread_is_asked_for_where_nothing_was(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in LINEAR_ALGEBRA:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MKL_NUM_THREADS", "6")
    assert called("example-cell").returncode == 0
    asked = {name: os.environ[name] for name in LINEAR_ALGEBRA}
    assert asked == dict.fromkeys(LINEAR_ALGEBRA, "1") | {"MKL_NUM_THREADS": "6"}


def test_it_is_asked_for_before_numpy_is_loaded() -> None:
    """What is loaded has read it already; and help need not wait for it, nor for colours."""
    code = "import sys, agent.cli.app; sys.exit(bool({'numpy', 'rich.console'} & {*sys.modules}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
