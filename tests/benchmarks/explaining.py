"""How long one explanation takes: ``python -m tests.benchmarks.explaining [NUMBER ...]``.

Cases of `stribeck prove` by their number in its sequence (those of the slowest kinds where none is
given), each made and explained with one thread in a process of its own: processor seconds, how many
of them lie in trials that do not depend on each other, what part of the time is left if a second
core took half of those without any loss, and the memory at the peak. Seeds below 10000 are for
development.
"""

from __future__ import annotations

import argparse
import functools
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from agent.cli.terminal.threads import keep_to_one_thread

keep_to_one_thread()

NUMBERS = (28, 29, 53, 66, 72, 91)
"""What took longest of seeds 140000: outsiders, a gap, a delay, and effects beside each other."""

ALL, FIRST = 120, 9000


class Watch:
    """Processor seconds inside of some functions, where one calls the other counted once."""

    def __init__(self) -> None:
        self.seconds, self._inside = 0.0, False

    def over(self, work: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that is watched."""

        @functools.wraps(work)
        def watched(*arguments: Any, **named: Any) -> Any:
            if self._inside:
                return work(*arguments, **named)
            self._inside, began = True, time.process_time()
            try:
                return work(*arguments, **named)
            finally:
                self._inside = False
                self.seconds += time.process_time() - began

        return watched


def watch_trials() -> Watch:
    """Watch all that screens, moves and compares one candidate without asking for another."""
    from agent.explain import study
    from agent.explain.choosing import entry
    from agent.explain.choosing.search import Library
    from agent.explain.numbers import anew, in_step, resting

    watch = Watch()
    for place, name in (
        (Library, "all_points"),
        (Library, "rank"),
        (resting, "taken_at"),
        (anew, "taken_at"),
        (anew, "with_new_grids"),
        (in_step, "with_new_grids"),
        (entry, "chance"),
        (study, "deficiency_map"),
    ):
        setattr(place, name, watch.over(getattr(place, name)))
    return watch


def measure(number: int, first: int) -> None:
    """Make and explain one case, and print its line."""
    from agent.cli.prove.case import Sealed, answer, make
    from agent.cli.prove.plan import plan

    order = plan(ALL, first)[number].order
    what = "+".join(order.effects) or "nothing"
    with tempfile.TemporaryDirectory() as scratch:
        made = make(order, Path(scratch))
        if not isinstance(made, Sealed):
            print(f"{first + number:>6} {what}: {made}", flush=True)
            return
        answer(Path(scratch))  # loads, and compiles where that was not done before
        watch = watch_trials()
        said = answer(Path(scratch))
    share = watch.seconds / said.processor_seconds
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{first + number:>6} {said.processor_seconds:8.1f} {100 * share:9.0f} %"
        f" {1 - share / 2:12.2f} {peak_mb:8.0f}  {what}: {said.explanation['verdict']}",
        flush=True,
    )


def main() -> None:
    """Print a line for each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("numbers", type=int, nargs="*", default=NUMBERS)
    parser.add_argument("--first", type=int, default=FIRST, help="seed of number 0")
    parser.add_argument("--here", action="store_true", help="in this process")
    asked = parser.parse_args()
    if asked.here:
        for number in asked.numbers:
            measure(number, asked.first)
        return
    print("  seed  seconds   in trials    two cores      MiB", flush=True)
    for number in asked.numbers:
        own = [sys.executable, "-m", "tests.benchmarks.explaining", str(number)]
        subprocess.run([*own, "--first", str(asked.first), "--here"], check=True)


if __name__ == "__main__":
    main()
