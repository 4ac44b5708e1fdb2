"""The extended twin fed back: ``python -m tests.benchmarks.roundtrip [seeds] [first seed]``.

What was explained once must not need explaining again: with the extended twin the answer is
no-mismatch, its error as given is what the explanation said of it, and `stribeck simulate`'s law
predicts the same. Where the first answer was in part only, nothing that it named is named again.
Every effect of the concealed library, development seeds.
"""

from __future__ import annotations

import sys
import time

from agent.explain.explain import explain
from agent.physics.twin import format_twin, parse_twin
from fakes.conceal.case import conceal
from fakes.conceal.concealment import UnreachableError
from fakes.conceal.library import EFFECTS
from tests.science.test_explain import runs_of

FIRST = 1


def row(effect: str, seed: int) -> bool | None:
    """Print one case; return whether the loop is closed, None where nothing was found."""
    try:
        case = conceal(seed, effects=[effect], design="rich", snr=1.0)
    except UnreachableError:
        print(f"{effect:<32}{seed:>5}  not reachable")
        return None
    runs = runs_of(case)
    began = time.process_time()
    first = explain(parse_twin(case.twin_toml), runs)
    seconds = time.process_time() - began
    if first.twin is None or not first.findings:
        print(f"{effect:<32}{seed:>5}  {first.verdict}: nothing found")
        return None
    again = explain(parse_twin(format_twin(first.twin)), runs)
    named = {f.effect for f in first.findings}
    partly = first.verdict in ("partly-explained", "unexplained")
    closed = again.verdict == "no-mismatch" or (
        partly and not named.intersection(f.effect for f in again.findings)
    )
    found = "+".join(f.effect for f in again.findings)
    print(
        f"{effect:<32}{seed:>5}  {first.verdict:<17}{first.extended.rmse_nm:>9.5f}"
        f"{again.baseline.rmse_nm:>10.5f}  {'' if closed else 'OPEN '}{again.verdict} {found}"
        f"  ({seconds:.1f} s)",
        flush=True,
    )
    return closed


def main() -> None:
    """Print the table and how many came back without a mismatch."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    first = int(sys.argv[2]) if len(sys.argv) > 2 else FIRST
    print(f"{'effect':<32}{'seed':>5}  {'verdict':<17}{'extended':>9}{'fed back':>10}  N m rms")
    results = [row(effect, seed) for seed in range(first, first + seeds) for effect in EFFECTS]
    judged = [closed for closed in results if closed is not None]
    print(f"{sum(judged)} of {len(judged)} closed")


if __name__ == "__main__":
    main()
