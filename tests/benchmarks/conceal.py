"""What the generator of concealed cases can make: ``python -m tests.benchmarks.conceal [seeds]``.

For every effect and outsider, design and SNR asked: how many of `seeds` development cases were
reached, the spread of SNR about what was asked, processor time, and how many joints could not show
it. A row of dashes is an effect that the design cannot show.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from typing import get_args

import numpy as np

from fakes.conceal import EFFECTS, OUTSIDERS, SNRS, Order, Tally, cases
from fakes.conceal.design import Design

DESIGNS: tuple[Design, ...] = get_args(Design)


def row(effect: str, design: Design, snr: float, seeds: int) -> str:
    """Return one line of the table."""

    def asked() -> Iterator[Order]:
        return (Order(seed, "single", (effect,), design, snr) for seed in range(seeds))

    tally = Tally()
    began = time.process_time()
    off = [abs(case.label["snr_reached"] / snr - 1.0) for _, case in cases(asked(), tally)]
    seconds = (time.process_time() - began) / seeds
    spread = f"{100.0 * float(np.max(off)):10.1f}" if off else f"{'-':>10}"
    return f"{effect:<32}{design:<6}{snr:5.2f}{tally.made:6d}/{seeds:<4d}{spread}{seconds:10.2f}"


def main() -> None:
    """Print the table."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    next(cases(iter([Order(0, "null", (), "poor", 1.0)]), Tally()))  # compile
    print(f"{'effect':<32}{'design':<6}{'SNR':>5}{'reached':>11}{'off by %':>10}{'CPU s':>10}")
    for effect in (*EFFECTS, *OUTSIDERS):
        for design in DESIGNS:
            for snr in SNRS:
                print(row(effect, design, snr, seeds))


if __name__ == "__main__":
    main()
