"""Poor cycles, and what the proposed experiment makes of them.

``python -m tests.benchmarks.after_experiment [cases] [seed]`` explains single effects in poor
recordings, blind. Where the cause stays tied and the explanation proposes something to drive, that
is driven on the same concealed joint, as often and as warm as it says, and all is explained once
more. A technician gets one name in the end: only the first one counts here, tied or not.

Not driven, and counted as they are: advice to change the set-up (another payload, an encoder at the
arm), which no motion of the axis stands for.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agent.cli.prove_case import answer
from agent.cli.prove_score import Score, score
from agent.cli.prove_share import share_of
from fakes.conceal import (
    EFFECTS,
    FIRST_SCORED_SEED,
    SNRS,
    ConcealedCase,
    UnreachableError,
    conceal,
    write_case,
)
from fakes.conceal.design import Run
from trajectories import Trajectory

_CASES = 66
_VISIBLE = tuple(snr for snr in SNRS if snr >= 0.5)
_HOURS_LATER = 2.0  # between one more recording and the next


@dataclass(frozen=True)
class Outcome:
    """One case: before the experiment, and after it where one was driven."""

    effect: str
    before: Score
    after: Score | None = None

    @property
    def last(self) -> Score:
        """Return what is said in the end."""
        return self.before if self.after is None else self.after


def outcome(seed: int, effect: str, snr: float) -> Outcome | None:
    """Return one case, None where the joint cannot show the effect."""
    try:
        case = conceal(seed, effects=(effect,), design="poor", snr=snr)
    except UnreachableError:
        return None
    said = _explained(case)
    before = score(case.label, said, ())
    proposed = said.get("next_experiment") or {}
    planned = proposed.get("runs") or ()
    if proposed.get("trajectory") is None or any(run["load"] != 1.0 for run in planned):
        return Outcome(effect, before)
    trajectory = Trajectory.from_json(proposed["trajectory"])
    again = conceal(
        seed,
        effects=(effect,),
        design="poor",
        snr=snr,
        more=lambda runs: _asked_for(runs, trajectory, planned),
    )
    return Outcome(effect, before, score(case.label, _explained(again), ()))


def _explained(case: ConcealedCase) -> Mapping[str, Any]:
    with tempfile.TemporaryDirectory() as scratch:
        write_case(case, Path(scratch))
        return answer(Path(scratch)).explanation


def _asked_for(
    runs: Sequence[Run], trajectory: Trajectory, planned: Sequence[Mapping[str, Any]]
) -> list[Run]:
    """Return the recordings that are still to be made, the joint as warm as was asked for."""
    trained = [run for run in runs if not run.is_holdout]
    out: list[Run] = []
    for plan in planned:
        begin, end = (trained[k].state for k in (0, -1))
        warm = {
            name: getattr(begin, name)
            + plan["warmth"] * (getattr(end, name) - getattr(begin, name))
            for name in ("oil_degc", "winding_degc", "sensor_degc")
        }
        for _ in range(plan["times"]):
            number = len(runs) + len(out)
            state = end._replace(age_runs=float(number), **warm)
            hours = max(run.started_hours for run in (*runs, *out)) + _HOURS_LATER
            out.append(Run(trajectory, state, False, hours))
    return out


def main(cases: int = _CASES, first_seed: int = FIRST_SCORED_SEED) -> None:
    """Explain poor recordings, drive what is proposed, print how often the first name is right."""
    outcomes: list[Outcome] = []
    dropped = 0
    for number in range(cases):
        effect = tuple(EFFECTS)[number % len(EFFECTS)]
        snr = _VISIBLE[(number + number // len(EFFECTS)) % len(_VISIBLE)]
        one = outcome(first_seed + number, effect, snr)
        if one is None:
            dropped += 1
            continue
        outcomes.append(one)
        told = " -> ".join(_said(s) for s in (one.before, one.after) if s is not None)
        print(f"{first_seed + number} {effect} {snr:g}: {told}", flush=True)
    driven = [o for o in outcomes if o.after is not None]
    print(f"{len(outcomes)} cases, {dropped} dropped, {len(driven)} experiments driven")
    for words, those in (("all", outcomes), ("where it was driven", driven)):
        before = share_of(those, lambda o: o.before.first_right)
        after = share_of(those, lambda o: o.last.first_right)
        covered = share_of(those, lambda o: o.last.set_right)
        tied = share_of(those, lambda o: len(o.last.first_set) > 1)
        print(
            f"{words}: the first name right {before.with_interval()} before, "
            f"{after.with_interval()} after; in the set after {covered.with_interval()}; "
            f"still tied {tied.with_interval()}"
        )
    sizes = [len(o.before.first_set) for o in outcomes if o.before.first_set]
    print(f"names in a set before: {math.fsum(sizes) / max(len(sizes), 1):.2f} on average")


def _said(one: Score) -> str:
    first, *others = one.first_set or ("no name",)
    more = [name for name in one.named if name not in one.first_set]
    tied = f" ({', '.join(others)})" if others else ""
    return f"{first}{tied}{''.join(f' + {name}' for name in more)}"


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
