"""One real cycle on a real CAN bus: the fake drive in one process, `stribeck run` in another.

Run where a bus is, ``python -m tests.bus python -m tests.bus.cycle --channel vcan0 --out DIR``,
and print what `stribeck run --json` printed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.system.processes import started, stribeck

SPEED_LIMIT_S = 60.0


def main() -> int:
    """Drive one short stair at 500 Hz in real time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--channel", required=True)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    out: Path = arguments.out
    cell = out / "cell.toml"
    fake = ["fake", "--interface", "socketcan", "--channel", arguments.channel]
    fake += ["--write-cell", str(cell), "--short"]
    with started(fake, out / "fake.log", ready="ready"):
        done = stribeck("run", cell, "--axis", "1", "--out", out, "--json", timeout_s=SPEED_LIMIT_S)
    sys.stdout.write(done.stdout)
    sys.stderr.write(done.stderr)
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
