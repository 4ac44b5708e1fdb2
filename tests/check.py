"""The one command that checks everything: ``python -m tests.check [--no-tests]``.

Every check runs, also after one has failed, so that one call tells all. The exit code is 0 only
when all of them passed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = Path(sys.executable).parent


class Check(NamedTuple):
    """One tool and how it is called from the repository's root."""

    name: str
    command: tuple[str, ...]


PYTHON_M = (sys.executable, "-m")
PRODUCT = ("agent", "drivers", "trajectories", "fakes")
STATIC = (
    Check("mypy", (*PYTHON_M, "mypy")),
    *(
        # what Linux alone has stands behind `sys.platform`, so some of it is unreachable elsewhere
        Check(
            f"mypy for {platform}",
            (
                *(*PYTHON_M, "mypy", "--platform", platform, "--no-warn-unreachable"),
                *("--cache-dir", f".mypy_cache/{platform}", *PRODUCT),
            ),
        )
        for platform in ("darwin", "win32")
    ),
    Check("ruff check", (*PYTHON_M, "ruff", "check", ".")),
    Check("ruff format", (*PYTHON_M, "ruff", "format", "--check", ".")),
    Check("lint-imports", (str(SCRIPTS / "lint-imports"), "--no-logo")),
)
TESTS = (
    Check("pytest tests/bus", (*PYTHON_M, "pytest", "tests/bus")),
    Check("pytest tests/lessons", (*PYTHON_M, "pytest", "tests/lessons", "--numprocesses", "2")),
    Check("pytest", (*PYTHON_M, "pytest")),
)


def run(checks: Iterable[Check], root: Path = ROOT) -> list[str]:
    """Run `checks` one after another, showing their output; return the names of the failed."""
    failed = []
    for check in checks:
        say(f"== {check.name}")
        started_s = time.monotonic()
        done = subprocess.run(check.command, cwd=root, stdin=subprocess.DEVNULL, check=False)
        if not _ended(check, done.returncode, started_s):
            failed.append(check.name)
    return failed


def run_together(checks: Iterable[Check], root: Path = ROOT) -> list[str]:
    """Run `checks` two at a time, each one's output shown when it ends, as `run` does else.

    Types take minutes and one core each; what is first in line begins first.
    """

    def one(check: Check) -> bool:
        started_s = time.monotonic()
        done = subprocess.run(
            check.command,
            cwd=root,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        with shown:
            say(f"== {check.name}\n{done.stdout.rstrip()}")
            return _ended(check, done.returncode, started_s)

    asked, shown = tuple(checks), threading.Lock()
    with ThreadPoolExecutor(max_workers=2) as pool:
        passed = tuple(pool.map(one, asked))
    return [check.name for check, well in zip(asked, passed, strict=True) if not well]


def _ended(check: Check, exit_code: int, started_s: float) -> bool:
    """Say how a check ended; return whether it passed."""
    verdict = "passed" if exit_code == 0 else f"FAILED with exit code {exit_code}"
    say(f"== {check.name} {verdict} in {time.monotonic() - started_s:.1f} s")
    return exit_code == 0


def say(line: str) -> None:
    """Write one line at once, so that it stands before what the next tool writes."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> int:
    """Run the checks that were asked for and name those that failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.check", description=__doc__)
    parser.add_argument("--no-tests", action="store_true", help="all but pytest")
    arguments = parser.parse_args()
    failed = run_together(STATIC)
    if not arguments.no_tests:
        failed += run(TESTS)
    say(f"failed: {', '.join(failed)}" if failed else "every check passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
