"""Numbers and intervals by effect: ``python -m tests.benchmarks.coverage [seeds] [first] [poor]``.

One effect of the concealed library at a time, SNR 1, development seeds, rich recordings or poor
ones, written, explained and scored as `stribeck prove` does. For every effect: in how many cases it
was named, the median error of its numbers, how many 95 % intervals hold the truth, the worst energy
share's error in points, the median error on unseen recordings over the floor; then which intervals
miss, and by how much. Only numbers that mean the same in both forms are compared, so that some
effects have none.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from agent.cli.prove.case import answer, make
from agent.cli.prove.score import Score, score
from fakes.conceal import EFFECTS, Order
from fakes.conceal.design import Design

FIRST = 3000


def cases(effect: str, seeds: range, design: Design) -> Iterator[Score]:
    """Yield the score of every case that the joint can show."""
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            made = make(Order(seed, "single", (effect,), design, 1.0), Path(folder))
            if not isinstance(made, str):
                said = answer(Path(folder))
                yield score(json.loads(made.label_text), said.explanation, said.baseline)


def row(effect: str, found: list[Score]) -> tuple[str, int, int]:
    """Return one effect's line, and how many of how many intervals hold the truth."""
    numbers = [m for case in found for m in case.measured]
    held = [m.covered for m in numbers if m.covered is not None]
    shares = [
        abs(place.share_error)
        for case in found
        for place in case.located
        if place.share_error is not None
    ]
    ratios = [case.floor_ratio for case in found if case.floor_ratio is not None]
    named = sum(bool(case.located) for case in found)
    error = f"{100.0 * np.median([m.error for m in numbers]):7.1f}" if numbers else f"{'-':>7}"
    share = f"{100.0 * max(shares):6.0f}" if shares else f"{'-':>6}"
    ratio = f"{np.median(ratios):7.2f}" if ratios else f"{'-':>7}"
    inside = f"{sum(held)}/{len(held)}" if held else "-"
    text = f"{effect:<32}{named:>3}/{len(found):<3}{error}{inside:>8}{share}{ratio}"
    missed = [f"{m.parameter} ({100.0 * m.error:.1f} %)" for m in numbers if m.covered is False]
    return f"{text}  {', '.join(missed)}".rstrip(), sum(held), len(held)


def main() -> None:
    """Print the table."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    first = int(sys.argv[2]) if len(sys.argv) > 2 else FIRST
    design: Design = "poor" if "poor" in sys.argv[3:] else "rich"
    print(f"{'effect':<32}{'named':>7}{'error %':>7}{'inside':>8}{'share':>6}{'floor':>7}  outside")
    inside = total = 0
    for number, effect in enumerate(EFFECTS):
        begin = first + 100 * number
        text, held, count = row(effect, list(cases(effect, range(begin, begin + seeds), design)))
        inside, total = inside + held, total + count
        print(text, flush=True)
    print(f"intervals with the truth: {inside}/{total}")


if __name__ == "__main__":
    main()
