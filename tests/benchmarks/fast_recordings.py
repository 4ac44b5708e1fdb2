"""Joints recorded at 1 kHz, explained thinned and as recorded, by turns.

``python -m tests.benchmarks.fast_recordings [cases] [seed] [hz]``; see
`agent.explain.rows.coarser`. The cases are those that `stribeck prove --full` begins with. Each
line has both answers, where they differ, what both leave of the noise on unseen recordings, and
the processor's seconds.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from unittest.mock import patch

from agent.cli.prove.case import Answer, answer
from agent.cli.prove.plan import plan
from fakes.conceal import FIRST_SCORED_SEED, Order, UnreachableError, conceal
from fakes.conceal.writing import write_case

_CASES, _RATE_HZ = 24, 1000.0


def both_ways(order: Order, rate_hz: float, *, thinned_first: bool) -> dict[bool, Answer] | None:
    """Return the answer thinned (True) and as recorded; None where the joint cannot show it."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        try:
            made = conceal(
                order.seed,
                effects=order.effects,
                design=order.design,
                snr=order.snr,
                sample_rate_hz=rate_hz,
            )
        except UnreachableError:
            return None
        write_case(made, folder)
        found = {}
        for thinned in (thinned_first, not thinned_first):
            if thinned:
                found[True] = answer(folder)
            else:
                with patch("agent.explain.asked.coarsened", tuple):
                    found[False] = answer(folder)
        return found


def said(explanation: Mapping[str, object]) -> str:
    """Return verdict and names."""
    findings = explanation.get("findings", ())
    assert isinstance(findings, Sequence)
    names = " + ".join(finding["effect"] for finding in findings)
    return f"{explanation['verdict']}: {names or 'no name'}"


def over_floor(explanation: Mapping[str, object]) -> str:
    """Return what is left on unseen recordings, over the noise."""
    holdout = explanation.get("holdout")
    ratio = holdout.get("floor_ratio") if isinstance(holdout, Mapping) else None
    return f"{ratio:.2f}" if isinstance(ratio, float) else "-"


def main(cases: int = _CASES, first_seed: int = FIRST_SCORED_SEED, hz: float = _RATE_HZ) -> None:
    """Explain every case both ways, and print where the answers differ."""
    spent: dict[bool, list[float]] = {True: [], False: []}
    alike = 0
    for case in plan(cases, first_seed):
        order = case.order
        found = both_ways(order, hz, thinned_first=case.number % 2 == 0)
        if found is None:
            continue
        for way, one in found.items():
            spent[way].append(one.processor_seconds)
        thinned, whole = (said(found[way].explanation) for way in (True, False))
        alike += thinned == whole
        differs = "" if thinned == whole else f"; as recorded {whole}"
        left = " and ".join(over_floor(found[way].explanation) for way in (True, False))
        seconds = f"{spent[True][-1]:.1f} and {spent[False][-1]:.1f} s"
        truth = " + ".join(order.effects) or "nothing"
        print(f"{order.seed} {truth} -> {thinned}{differs} ({left}, {seconds})", flush=True)
    print(f"the same in {alike} of {len(spent[True])}")
    for way, name in ((True, "thinned"), (False, "as recorded")):
        own = spent[way]
        middle, total = statistics.median(own), sum(own)
        print(f"{name}: median {middle:.1f} s, most {max(own):.1f}, all {total:.0f}")


if __name__ == "__main__":
    count, seed, rate = (*sys.argv[1:], *("",) * 3)[:3]
    main(int(count or _CASES), int(seed or FIRST_SCORED_SEED), float(rate or _RATE_HZ))
