"""The axis contract on a real CAN bus: the same tests as on the virtual bus and on multicast."""

from __future__ import annotations

import sys

import pytest

from tests.bus.vcan import CHANNEL_VARIABLE, Vcan
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.bus


def test_the_axis_contract_holds_on_vcan(vcan: Vcan) -> None:
    pytest_command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    command = ["env", f"{CHANNEL_VARIABLE}={vcan.channel}", *pytest_command]
    done = vcan.run(
        [*command, "tests/contract", "-k", "socketcan"], timeout_s=300.0, cwd=REPOSITORY
    )
    assert done.returncode == 0, done.stdout[-4000:]
    assert "passed" in done.stdout
    assert "skipped" not in done.stdout
