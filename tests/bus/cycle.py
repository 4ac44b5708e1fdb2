"""One real cycle on a real CAN bus: the fake drive in one process, `stribeck run` in another.

Run where a bus is, ``python -m tests.bus python -m tests.bus.cycle --channel vcan0 --out DIR``,
and print what `stribeck run --json` printed.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

from tests.system.processes import be_patient, started, stribeck

SPEED_LIMIT_S = 60.0


def main() -> int:
    """Drive one short stair at 500 Hz in real time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--channel", required=True)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    # In memory while the joint moves: User-Mode Linux stands still for as long as the host takes
    # to write a file, and that can be longer than the drive waits for a heartbeat.
    with tempfile.TemporaryDirectory(dir="/dev/shm") as memory:
        out = Path(memory)
        cell = out / "cell.toml"
        fake = ["fake", "--interface", "socketcan", "--channel", arguments.channel]
        fake += ["--write-cell", str(cell), "--short"]
        with started(fake, out / "fake.log", ready="ready"):
            be_patient(cell)
            run = ("run", cell, "--axis", "1", "--out", out, "--json")
            done = stribeck(*run, timeout_s=SPEED_LIMIT_S)
        shutil.copytree(out, arguments.out, dirs_exist_ok=True)
    sys.stdout.write(done.stdout)
    sys.stderr.write(done.stderr)
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
