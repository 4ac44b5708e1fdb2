"""Gears with play, explained blind: ``python -m tests.benchmarks.gaps [joints] [seed]``.

Gaps at 0.5, 1 and 2 times the noise in turn, every sixth joint recorded as poorly as `stribeck
prove` records any. Each half gap is printed with its relative error and whether its 95 % interval
has the truth; then how many are named, the errors, and how many intervals of those that are said
hold it, with Wilson's 95 % interval. The processor's seconds are those of an explanation.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path
from typing import Literal

from agent.cli.prove.case import Sealed, answer, make
from agent.cli.prove.numbers import Measured
from agent.cli.prove.score import score
from agent.cli.prove.share import share_of
from fakes.conceal import FIRST_SCORED_SEED, Order, open_label

Design = Literal["rich", "poor"]

_JOINTS, _SIXTH = 24, 6
_SNRS = (0.5, 1.0, 2.0)
_NINE_TENTHS = 0.9


def gap(order: Order) -> tuple[Measured | None, float] | None:
    """Return what is measured of one gap, and the seconds; None where the joint cannot show it."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        made = make(order, folder)
        if not isinstance(made, Sealed):
            return None
        said = answer(folder)
    label = open_label(made.label_text, made.salt, made.seal)
    measured = score(label, said.explanation, ()).measured
    return (measured[0] if measured else None), said.processor_seconds


def main(joints: int = _JOINTS, first_seed: int = FIRST_SCORED_SEED) -> None:
    """Explain joints with gaps, and print what their half gaps come out as."""
    found: list[tuple[Order, Measured | None, float]] = []
    for number in range(joints):
        design: Design = "poor" if number % _SIXTH == _SIXTH - 1 else "rich"
        snr = _SNRS[number % len(_SNRS)]
        order = Order(first_seed + number, "single", ("backlash",), design, snr)
        one = gap(order)
        if one is None:
            continue
        measured, seconds = one
        found.append((order, measured, seconds))
        told = "no half gap"
        if measured is not None:
            inside = {True: "inside", False: "outside", None: "none"}[measured.covered]
            told = f"{100.0 * measured.error:.1f} % off, interval: {inside}"
        print(f"{order.seed} {design} {snr:g}: {told}, {seconds:.1f} s", flush=True)
    named = [(order, measured) for order, measured, _ in found if measured is not None]
    errors = sorted(measured.error for order, measured in named if order.design == "rich")
    told_of = [measured for _, measured in named if measured.covered is not None]
    held = share_of(told_of, lambda measured: bool(measured.covered))
    spent = [each for _, _, each in found]
    print(f"named {len(named)}/{len(found)}; intervals with the truth {held.with_interval()}")
    if errors:
        high = errors[min(int(_NINE_TENTHS * len(errors)), len(errors) - 1)]
        print(f"rich: {100 * statistics.median(errors):.1f} % off, nine tenths {100 * high:.1f} %")
    print(f"processor {statistics.median(spent):.1f} s, most {max(spent):.1f} s")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
