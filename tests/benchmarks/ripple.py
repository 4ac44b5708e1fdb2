"""Ripple: coverage, information limit, false orders: ``python -m tests.benchmarks.ripple [count]``.

Three orders, one of them not whole, in white and in coloured torque noise. Figures to reach: 95 %
intervals that cover 92 to 98 %, errors of at most 1.15 times the Cramer-Rao bound, and an order
named without any ripple in 1 % of the recordings.
"""

from __future__ import annotations

import sys

from tests.benchmarks.thermal import HEADER, SEEDS, row
from tests.science.ripple_campaign import CASES, false_orders, ripple_campaign


def main() -> None:
    """Print the table; the first argument is the number of seeds."""
    seeds = range(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS)
    print(f"{len(seeds)} seeds\n{HEADER}")
    for case in CASES:
        scores, false = ripple_campaign(seeds, case)
        for s in scores:
            print(row(s), flush=True)
        alone = false_orders(seeds, case)
        print(f"{case.name}: {false} false orders beside these, {alone} recordings without ripple")


if __name__ == "__main__":
    main()
