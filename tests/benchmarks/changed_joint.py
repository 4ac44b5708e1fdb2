"""Joints that have changed since their simulation was learnt.

``python -m tests.benchmarks.changed_joint [--recorded] [first seed] [effect ...]`` explains one
joint for every effect, or for some, at twice the noise, and keeps the twin that comes out. Then the
same joint is recorded with half as much of it, and with none, and explained with that twin, or
beside what that twin predicts (`torque_simulated_nm`), of which nobody knows how it came about:
what is wrong is the simulation's own effect. Beside it stands what is said where the simulation's
effects are not doubted, in the same run. Effects that have no law of their own in a twin, as a
wrong inertia, are left out.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from agent.cli.explain.simulate import read_twin, simulated
from agent.conclude.explanation import explained, runs_of
from agent.explain.answer.names import OWN_EFFECT
from agent.explain.answer.result import Explanation
from agent.explain.once import asked_once
from agent.physics.twin import Twin
from agent.record.reading import read_all
from agent.record.recording import Recording
from fakes.conceal import EFFECTS, UnreachableError, conceal, write_case

_FIRST = 540_000
_THEN, _LESS = 2.0, 1.0  # times the noise
_SHIFT = "torque-offset", "direction-asymmetry"  # no motion tells these two apart


@contextmanager
def recorded(seed: int, effects: Sequence[str], snr: float) -> Iterator[Path]:
    """Record a joint into a folder, as `stribeck prove` has it."""
    with tempfile.TemporaryDirectory() as scratch:
        write_case(conceal(seed, effects=effects, snr=snr), Path(scratch))
        yield Path(scratch)


@dataclass(frozen=True)
class Question:
    """A simulation, and recordings to learn from and unseen ones."""

    twin: Twin
    path: Path
    learn: Sequence[Recording]
    unseen: Sequence[Recording]

    @classmethod
    def of(cls, folder: Path, learnt: Twin | None = None, *, recorded: bool = False) -> Self:
        """Ask about a folder with its own twin, with one learnt before, or beside what it says."""
        path = folder / "twin.toml"
        both: list[Sequence[Recording]] = [read_all([folder / n]) for n in ("training", "holdout")]
        if learnt is not None and recorded:
            both = [[simulated(learnt, r, str(path)) for r in each] for each in both]
            learnt = None
        return cls(learnt or read_twin(path), path, *both)

    def asked(self) -> Explanation:
        """Return the explanation."""
        return explained(self.twin, self.path, self.learn, self.unseen)

    def not_doubted(self) -> Explanation:
        """Return that of a simulation whose own effects nobody doubts."""
        return asked_once(self.twin, runs_of(self.learn), runs_of(self.unseen))[0]


def is_right(answer: Explanation, effect: str) -> bool:
    """Tell whether the simulation's own effect is all that is told, tied with its like or not."""
    one = len(answer.findings) == 1 and answer.findings[0].form == OWN_EFFECT
    return one and answer.findings[0].effect in _alike(effect)


def is_its_name(answer: Explanation, effect: str) -> bool:
    """Tell whether the effect's name is the only one, as something that is missing or too much."""
    return bool(answer.findings) and {f.effect for f in answer.findings} <= _alike(effect)


def _alike(effect: str) -> set[str]:
    return set(_SHIFT) if effect in _SHIFT else {effect}


def main(*words: str) -> None:
    """Print what is said of every joint, and how often it is right."""
    recorded_one = "--recorded" in words
    first_seed, *among = [w for w in words if w != "--recorded"] or [str(_FIRST)]
    counted: list[tuple[bool, bool]] = []
    for number, effect in enumerate(EFFECTS):
        seed = int(first_seed) + number
        if among and effect not in among:
            continue
        try:
            with recorded(seed, (effect,), _THEN) as folder:
                learnt = Question.of(folder).asked().twin
        except UnreachableError:
            continue
        if learnt is None or not any(e.id in _alike(effect) for e in learnt.effects):
            print(f"{seed} {effect}: no law of it was learnt", flush=True)
            continue
        for now, effects, snr in (("half", (effect,), _LESS), ("gone", (), 1.0)):
            try:
                with recorded(seed, effects, snr) as folder:
                    question = Question.of(folder, learnt, recorded=recorded_one)
                    said, before = question.asked(), question.not_doubted()
            except UnreachableError:
                continue
            counted.append((is_right(said, effect), is_its_name(before, effect)))
            print(f"{seed} {effect}, {now}: {_words(said)} | not doubted: {_words(before)}")
            print(f"    {said.sentence}", flush=True)
    right, before_right = (sum(column) for column in zip(*counted, strict=True))
    print(f"{right} of {len(counted)} right; not doubted, {before_right} with no other name")


def _words(answer: Explanation) -> str:
    names = [f"{f.effect}{' (own)' if f.form == OWN_EFFECT else ''}" for f in answer.findings]
    return f"{answer.verdict} {', '.join(names)}".strip()


if __name__ == "__main__":
    main(*sys.argv[1:])
