"""The exchange of speeds, dwells and strokes, one step at a time: where the search begins.

A stroke climbs through some of its speeds and comes down through the others. Exchange (Fedorov
1972) ends in a local optimum; it is started from several stairs. What is best is asked of
`trajectories.design_problem`; speeds in any order are tried by `trajectories.design_order`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trajectories.design_layout import Strokes, dealt
from trajectories.design_problem import Problem

_SHARES = 1.3
_LEAST_GAIN = 1e-4
_STROKES = (1, 2, 3, 4, 6)
_SWEEPS = 30


@dataclass(frozen=True)
class Candidate:
    """A stair in the making: rising indices into the grid, shares of time, and how it is dealt."""

    picks: tuple[int, ...]
    shares: tuple[float, ...]
    strokes: int
    mixed: bool

    @property
    def order(self) -> Strokes:
        """The speeds in the order in which they are held."""
        held = list(zip(self.picks, self.shares, strict=True))
        return dealt(held, self.strokes, self.mixed)


def exchanged(problem: Problem) -> tuple[Strokes, float] | None:
    """Return the best stair found and its worth, or None where not even an even one fits."""
    best: tuple[Candidate, float] | None = None
    for strokes in _STROKES:
        for mixed in (True, False) if strokes > 1 else (True,):
            start = _start(problem, strokes, mixed=mixed)
            if start is None:
                continue
            found = _climb(problem, *start)
            if best is None or found[1] > best[1]:
                best = found
    return None if best is None else (best[0].order, best[1])


def fits(problem: Problem) -> bool:
    """Tell whether there is any stair at all."""
    return any(
        _start(problem, strokes, mixed=mixed) is not None
        for strokes in _STROKES
        for mixed in (True, False)
    )


def _start(problem: Problem, strokes: int, *, mixed: bool) -> tuple[Candidate, float] | None:
    """Return an even stair: even in the logarithm of speed, as fast as there is room for."""
    count = max(problem.speeds_min, strokes)
    for top in range(problem.grid_rad_s.size, count - 1, -1):
        picks = np.linspace(0, top - 1, count).round().astype(int)
        if np.unique(picks).size < count:
            break
        candidate = Candidate(tuple(picks.tolist()), (1.0,) * count, strokes, mixed)
        value = problem.worth(candidate.order)
        if value > -np.inf:
            return candidate, value
    return None


def _climb(problem: Problem, candidate: Candidate, value: float) -> tuple[Candidate, float]:
    """Take every step that helps until none does."""
    for _ in range(_SWEEPS):
        before = value
        for step in list(_steps(problem, candidate)):
            changed = _apply(problem, candidate, step)
            if changed is None:
                continue
            gained = problem.worth(changed.order)
            if gained > value + _LEAST_GAIN:
                candidate, value = changed, gained
        if value - before <= _LEAST_GAIN:
            break
    return candidate, value


@dataclass(frozen=True)
class _Step:
    """Hold the `rank`-th speed for `factor` times as long, or `shift` it, or add grid point."""

    rank: int = -1
    shift: int = 0
    factor: float = 1.0
    add: int = -1


def _steps(problem: Problem, candidate: Candidate) -> Iterator[_Step]:
    for rank in range(len(candidate.picks)):
        for shift in (1, -1, 3, -3, 8, -8):
            yield _Step(rank, shift=shift)
        for factor in (_SHARES, 1.0 / _SHARES, 0.0):
            yield _Step(rank, factor=factor)
    for add in range(0, problem.grid_rad_s.size, 2):
        yield _Step(add=add)


def _apply(problem: Problem, candidate: Candidate, step: _Step) -> Candidate | None:
    """Return the changed candidate; None where the step leads out of the problem."""
    held = dict(zip(candidate.picks, candidate.shares, strict=True))
    if step.add >= 0:
        if step.add in held or len(held) >= problem.speeds_max:
            return None
        held[step.add] = float(np.median(candidate.shares))
    elif step.rank >= len(candidate.picks):  # removed in this sweep
        return None
    else:
        pick = candidate.picks[step.rank]
        share = held.pop(pick) * step.factor
        pick += step.shift
        if share == 0.0:
            if len(held) < problem.speeds_min:
                return None
        elif pick in held or not 0 <= pick < problem.grid_rad_s.size:
            return None
        else:
            held[pick] = share
    picks = tuple(sorted(held))
    shares = tuple(held[i] for i in picks)
    return Candidate(picks, shares, candidate.strokes, candidate.mixed)
