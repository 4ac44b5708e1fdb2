"""Run any command where a real CAN bus is: ``python -m tests.bus [--timeout S] COMMAND...``."""

from __future__ import annotations

import argparse
import subprocess
import sys

from tests.bus.vcan import VcanUnavailableError, open_vcan


def main() -> int:
    """Parse the command line, run the command, pass its output and exit code on."""
    parser = argparse.ArgumentParser(prog="python -m tests.bus", description=__doc__)
    parser.add_argument("--timeout", type=float, default=120.0, metavar="S", help="in seconds")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    arguments = parser.parse_args()
    if not arguments.command:
        parser.error("a command is needed")
    try:
        with open_vcan() as vcan:
            sys.stderr.write(f"on {vcan.describe()}\n")
            result = vcan.run(arguments.command, arguments.timeout)
    except VcanUnavailableError as error:
        sys.stderr.write(f"{error}\n")
        return 4
    except subprocess.TimeoutExpired as error:
        sys.stdout.write(str(error.output))
        sys.stderr.write(f"{error.stderr!s}{error}\n")
        return 124
    sys.stdout.write(result.stdout)
    sys.stderr.write(result.stderr)
    return result.returncode


if __name__ == "__main__":
    sys.exit(main())
