"""Devices, cycles and stops in a Python without what macOS's lacks.

``python -m tests.benchmarks.elsewhere [TESTS]``

`tests/as_macos` takes it from every process; then the tests run that drive cycles on python-can's
virtual and udp_multicast, over slcan and RTU on ptys and over Modbus TCP, with their temperatures,
releases, locks, recordings and kills. What only Linux has skips itself there. The kernel under it
is Linux's all the same; on a Mac itself they run as they are.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys

from tests.conftest import REPOSITORY

PLACE = REPOSITORY / "tests" / "as_macos"
TESTS = (
    "tests/contract",
    "tests/safety",
    "tests/faults/test_job_faults.py",
    "tests/faults/test_modbus_faults.py",
    "tests/faults/test_signals.py",
    "tests/night/test_command.py",
    "tests/night/test_permit.py",
    "tests/record/test_plain.py",
    "tests/system/test_contour.py",
    "tests/system/test_cycle.py",
    "tests/system/test_devices_as_processes.py",
    "tests/system/test_job.py",
    "tests/system/test_kill_recorder.py",
    "tests/system/test_modes.py",
    "tests/system/test_real_time.py",
    "tests/system/test_release.py",
    "tests/system/test_replay.py",
    "tests/system/test_slcan.py",
    "tests/system/test_temperature.py",
    "tests/system/test_verify_map.py",
    "tests/system/test_watched_axes.py",
    "tests/unit/drivers/test_can_interfaces.py",
    "tests/unit/drivers/test_can_owner.py",
    "tests/unit/drivers/test_clock.py",
    "tests/unit/test_platforms.py",
    "tests/unit/record/test_recover.py",
    "tests/web/test_attended.py",
)


def main() -> int:
    """Run them; the exit code is pytest's."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tests", nargs="*", help="these instead of all")
    chosen = parser.parse_args().tests or TESTS
    path = os.pathsep.join(
        map(str, (REPOSITORY,) if sys.platform == "darwin" else (PLACE, REPOSITORY))
    )
    command = [sys.executable, "-m", "pytest", "-q", "--numprocesses", "2", *chosen]
    return subprocess.run(
        command, cwd=REPOSITORY, env={**os.environ, "PYTHONPATH": path}, check=False
    ).returncode


if __name__ == "__main__":
    sys.exit(main())
