"""The search for the best stair: exchange of speeds, dwells and strokes, one step at a time.

The criterion is Bayesian D-optimality on scaled parameters (Chaloner and Verdinelli, Statistical
Science 10 (1995) 273, section 2.2): half the logarithm of the determinant of the information, in
units of one hundred percent of each parameter's size, with that hundred percent as prior. The
friction law is not linear in its parameters, so its part is the mean over the members of a prior.
Exchange (Fedorov 1972) ends in a local optimum; it is started from several stairs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trajectories.design_information import Belief, TorqueNoise, friction_information, usable_s
from trajectories.design_layout import Layout, Room, lay_out

Floats = NDArray[np.float64]

GRID_RATIO = 1.1
"""Neighbouring candidates differ by this much: far enough to be two points of a curve."""

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


@dataclass(frozen=True)
class Problem:
    """What is asked, in a form that is quick to evaluate.

    Parameters
    ----------
    room : Room
    grid_rad_s : ndarray, shape (g,)
        Rising speeds to choose from.
    belief, noise : Belief, TorqueNoise
    start_rad, direction : float
        Motor position where strokes start, and where they lead: +1 or -1.
    settle_s : float
        Lost at the start of every dwell.
    speeds_min, speeds_max : int
        How many different speeds.
    """

    room: Room
    grid_rad_s: Floats
    belief: Belief
    noise: TorqueNoise
    start_rad: float
    direction: float
    settle_s: float
    speeds_min: int
    speeds_max: int

    @cached_property
    def columns(self) -> Floats:
        """Scaled sensitivities on the grid, shape (members, g, p)."""
        return self.belief.columns(self.grid_rad_s)

    def layout(self, candidate: Candidate) -> Layout | None:
        """Return the candidate with its dwells, or None where there is no room for it."""
        speeds = [float(self.grid_rad_s[i]) for i in candidate.picks]
        return lay_out(speeds, candidate.shares, candidate.strokes, self.room, candidate.mixed)

    def value(self, candidate: Candidate) -> float:
        """Return the criterion; minus infinity where there is no room."""
        layout = self.layout(candidate)
        if layout is None:
            return -np.inf
        order = np.argsort(layout.speeds_rad_s)
        seen_s = usable_s(layout.dwells_s[order], self.settle_s)
        if seen_s.min() <= 0.0:
            return -np.inf
        density = self.noise.density_nm2_s
        columns = self.columns[:, list(candidate.picks)]
        friction = friction_information(columns, 0.5 * density / seen_s)
        of_friction = np.mean(np.linalg.slogdet(friction + np.eye(friction.shape[-1]))[1])
        gram = layout.body_gram(self.room, self.start_rad, self.direction, self.belief.gear_ratio)
        scales = self.belief.body_scales
        body = gram * np.outer(scales, scales) / density
        return 0.5 * float(of_friction + np.linalg.slogdet(body + np.eye(4))[1])


def search(problem: Problem) -> tuple[Candidate, float] | None:
    """Return the best stair found and its criterion, or None where not even a plain one fits."""
    best: tuple[Candidate, float] | None = None
    for strokes in _STROKES:
        for mixed in (True, False) if strokes > 1 else (True,):
            start = _start(problem, strokes, mixed=mixed)
            if start is None:
                continue
            found = _climb(problem, *start)
            if best is None or found[1] > best[1]:
                best = found
    return best


def fits(problem: Problem) -> bool:
    """Tell whether there is any stair at all."""
    return any(
        _start(problem, strokes, mixed=mixed) is not None
        for strokes in _STROKES
        for mixed in (True, False)
    )


def _start(problem: Problem, strokes: int, *, mixed: bool) -> tuple[Candidate, float] | None:
    """Return a plain stair: even in the logarithm of speed, as fast as there is room for."""
    count = max(problem.speeds_min, strokes)
    for top in range(problem.grid_rad_s.size, count - 1, -1):
        picks = np.linspace(0, top - 1, count).round().astype(int)
        if np.unique(picks).size < count:
            break
        candidate = Candidate(tuple(picks.tolist()), (1.0,) * count, strokes, mixed)
        value = problem.value(candidate)
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
            gained = problem.value(changed)
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
