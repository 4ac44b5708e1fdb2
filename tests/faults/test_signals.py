"""SIGTERM in motion, in real time: a service that is stopped brings the joint to rest first.

SIGKILL, SIGSTOP and Ctrl-C are in `tests/system/test_real_time.py`, all of them at any moment in
`tests.benchmarks.faults --signals`.
"""

from __future__ import annotations

import signal

import can
import pytest

from tests.faults.signals import signalled


@pytest.mark.real_time
def test_a_terminated_agent_brings_the_joint_to_rest_and_says_so() -> None:
    try:
        run = signalled(signal.SIGTERM, after_s=1.0)
    except (can.CanError, OSError) as error:
        pytest.skip(f"this machine has no IPv4 multicast: {error}")
    assert not run.objections(), run
    assert not run.journal  # the drive was given back
