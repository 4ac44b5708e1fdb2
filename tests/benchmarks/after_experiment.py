"""Poor cycles, and what the proposed experiment makes of them.

``python -m tests.benchmarks.after_experiment [cases] [seed]`` explains single effects in poor
recordings, blind. The axis may go further than it was driven: 160 degrees to either side. Where the
cause stays tied and the explanation proposes something to drive, that is driven on the same
concealed joint, as often and as warm as it says; where it asks for the arm's own encoder, the
recorded cycles are driven again with one. All is explained once more. A technician gets one name in
the end: only the first one counts here, tied or not.

Not driven, and counted as they are: advice to change the payload, of which a concealed joint has
none.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from agent.cli.prove.case import answer
from agent.cli.prove.score import Score, score
from agent.cli.prove.share import share_of
from fakes.conceal import (
    EFFECTS,
    FIRST_SCORED_SEED,
    SNRS,
    ConcealedCase,
    UnreachableError,
    conceal,
    write_case,
)
from fakes.conceal.case import More
from fakes.conceal.design import Run
from trajectories import AxisLimits, Trajectory

_CASES = 66
_VISIBLE = tuple(snr for snr in SNRS if snr >= 0.5)
_HOURS_LATER = 2.0  # between one more recording and the next
_ROOM_RAD = math.radians(160.0)  # of the arm, to either side: joints have 120 to 360 degrees
_SPARE = 1.1  # of the speed, acceleration and jerk that were driven, and of the torque twice that
_REACTION_S = 0.02
_ENCODER = "arm's own encoder"  # in what is said to be set up


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
    limits = _limits(case)
    said = _explained(case, limits)
    before = score(case.label, said, ())
    more = _more(said.get("next_experiment") or {})
    if more is None:
        return Outcome(effect, before)
    again = conceal(seed, effects=(effect,), design="poor", snr=snr, more=more)
    return Outcome(effect, before, score(case.label, _explained(again, limits), ()))


def _limits(case: ConcealedCase) -> AxisLimits:
    """Return what a cell would allow the axis, from what it was driven through."""

    def peak(name: str, times: int) -> float:
        largest = 0.0
        for run in case.training:
            values = np.asarray(run.columns[name], dtype=np.float64)
            for _ in range(times):
                values = np.gradient(values, np.asarray(run.columns["time_s"], dtype=np.float64))
            largest = max(largest, float(np.quantile(np.abs(values), 0.999)))
        return _SPARE * largest

    room_rad = _ROOM_RAD * float(case.training[0].metadata["gear_ratio"])
    acceleration = peak("velocity_command_rad_s", 1)
    return AxisLimits(
        position_min_rad=-room_rad,
        position_max_rad=room_rad,
        velocity_max_rad_s=peak("velocity_command_rad_s", 0),
        acceleration_max_rad_s2=acceleration,
        jerk_max_rad_s3=peak("velocity_command_rad_s", 2),
        torque_max_nm=2.0 * peak("torque_nm", 0),
        stopping_deceleration_rad_s2=acceleration,
        reaction_time_s=_REACTION_S,
    )


def _more(proposed: Mapping[str, Any]) -> More | None:
    """Return what is to be driven next; None where no motion of a concealed joint stands for it."""
    planned = proposed.get("runs") or ()
    if proposed.get("trajectory") is not None and all(run["load"] == 1.0 for run in planned):
        trajectory = Trajectory.from_json(proposed["trajectory"])
        return lambda runs: _asked_for(runs, trajectory, planned)
    if _ENCODER in proposed.get("set_up", ""):
        return _with_an_encoder
    return None


def _explained(case: ConcealedCase, limits: AxisLimits) -> Mapping[str, Any]:
    with tempfile.TemporaryDirectory() as scratch:
        write_case(case, Path(scratch))
        return answer(Path(scratch), limits).explanation


def _with_an_encoder(runs: Sequence[Run]) -> list[Run]:
    """Return the training runs once more, with an encoder at the arm."""
    trained = [run for run in runs if not run.is_holdout]
    last = max(run.started_hours for run in runs)
    return [
        replace(
            run,
            state=run.state._replace(age_runs=float(len(runs) + k)),
            started_hours=last + (k + 1) * _HOURS_LATER,
            arm_encoder=True,
        )
        for k, run in enumerate(trained)
    ]


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
