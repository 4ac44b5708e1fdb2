"""The reader process on a real CAN bus: what its native tests show holds for AF_CAN, too."""

from __future__ import annotations

import sys

import pytest

from tests.bus.vcan import CHANNEL_VARIABLE, Vcan
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.bus


def test_the_reader_process_holds_on_vcan(vcan: Vcan) -> None:
    pytest_command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    command = ["env", f"{CHANNEL_VARIABLE}={vcan.channel}", *pytest_command]
    done = vcan.run([*command, "tests/bus/reader_on_vcan.py"], timeout_s=120.0, cwd=REPOSITORY)
    assert done.returncode == 0, done.stdout[-4000:]
    assert "passed" in done.stdout
    assert "skipped" not in done.stdout
