"""Joints that lack nothing, explained blind: ``python -m tests.benchmarks.nulls [joints] [seed]``.

Every other one is recorded as poorly as `stribeck prove` records any. A name is false unless the
joint has that effect, as one of the small ones that nobody asked for, and it makes up 2 % of the
residual's energy. Each false name is printed as it comes; the count has Wilson's 95 % interval.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Literal, get_args

from agent.cli.prove.case import Sealed, answer, make
from agent.cli.prove.score import Score, score
from agent.cli.prove.share import share_of
from fakes.conceal import FIRST_SCORED_SEED, Order, open_label

_JOINTS = 300

Design = Literal["rich", "poor"]
_DESIGNS: tuple[Design, ...] = get_args(Design)


def null(seed: int, design: Design) -> Score:
    """Return what the explanation of one joint counts."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        made = make(Order(seed, "null", (), design, 1.0), folder)
        if not isinstance(made, Sealed):
            raise TypeError(f"a joint without an effect cannot be dropped: {made}")
        said = answer(folder).explanation
    label = open_label(made.label_text, made.salt, made.seal)
    return score(label, said, ())


def main(joints: int = _JOINTS, first_seed: int = FIRST_SCORED_SEED) -> None:
    """Explain joints that lack nothing, and print the false names and how often there was one."""
    scores = []
    for number in range(joints):
        seed, design = first_seed + number, _DESIGNS[number % len(_DESIGNS)]
        one = null(seed, design)
        scores.append(one)
        if one.absent or one.too_small or one.verdict != "no-mismatch":
            small = f", of what it has too little of: {one.too_small}" if one.too_small else ""
            print(f"{seed} {design}: {one.verdict}, false: {one.absent}{small}", flush=True)
    for which in (*_DESIGNS, "all"):
        these = [s for k, s in enumerate(scores) if which in ("all", _DESIGNS[k % 2])]
        absent = share_of(these, lambda s: bool(s.absent))
        named = share_of(these, lambda s: bool(s.absent or s.too_small))
        quiet = share_of(these, lambda s: s.verdict == "no-mismatch")
        print(
            f"{which:5} a false name {named.with_interval()}, of what is not there "
            f"{absent.with_interval()}; no mismatch {quiet.with_interval()}"
        )


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
