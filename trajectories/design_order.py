"""Speeds in any order: the search goes on from the exchange's stair by annealing.

Slow speeds may come in the middle of a stroke as well as at its ends, and more than once. No
single step leads there (a slow speed between two fast ones first costs two ramps), so steps that
lose a little are taken, the fewer the later (Kirkpatrick, Gelatt and Vecchi, Science 220 (1983)
671). The numbers it draws are the same in every search: the same question has the same answer.
"""

from __future__ import annotations

import math

import numpy as np

from trajectories.design_layout import Strokes
from trajectories.design_problem import Problem
from trajectories.design_search import exchanged

_BEGINNINGS, _STEPS = 3, 2500
_HOT, _COLD = 1.0, 0.003  # of the criterion
_FAR = 4.0  # places in the grid that a speed moves by at most, while hot
_LONGER = 0.4, 0.03  # of a logarithm: how much a share changes by, while hot and in the end
_HOPELESS = 0.2  # of a logarithm, what all numbers together may lack
_OWN = 0.1  # of the dwells that change places, the share that may get a stroke of their own


def search(problem: Problem) -> Strokes | None:
    """Return the best stair found, or None where not even an even one fits."""
    start = exchanged(problem)
    if start is None:
        return None
    best = start[0], problem.worth(start[0], held=True)
    if problem.plain is None:
        return best[0]
    rng = np.random.default_rng(0)
    for _ in range(_BEGINNINGS):
        best = max(best, _annealed(problem, start[0], rng), key=lambda pair: pair[1])
    # What cannot be held in so little time is not worth what it costs the others.
    return best[0] if problem.lack(best[0]) < _HOPELESS else start[0]


def _annealed(
    problem: Problem, strokes: Strokes, rng: np.random.Generator
) -> tuple[Strokes, float]:
    """Return the best of a walk that cools down, and its worth."""
    at = best = strokes, problem.worth(strokes, held=True)
    for k in range(_STEPS):
        warmth = 1.0 - k / _STEPS
        changed = _changed(at[0], problem, warmth, rng)
        if changed is None:
            continue
        loss = at[1] - problem.worth(changed, held=True)
        heat = _COLD * (_HOT / _COLD) ** warmth
        if loss <= 0.0 or rng.random() < math.exp(-min(loss / heat, 700.0)):
            at = changed, at[1] - loss
            best = max(best, at, key=lambda pair: pair[1])
    return best


def _changed(
    strokes: Strokes, problem: Problem, warmth: float, rng: np.random.Generator
) -> Strokes | None:
    """Return strokes in which one dwell has another speed, length or place, or is twice or gone."""
    out = [list(stroke) for stroke in strokes]
    own = out[int(rng.integers(len(out)))]
    j, what = int(rng.integers(len(own))), float(rng.random())
    pick, share = own[j]
    if what < 0.3:
        far = max(1, round(_FAR * warmth))
        moved = pick + int(rng.integers(-far, far + 1))
        own[j] = min(max(moved, 0), problem.grid_rad_s.size - 1), share
    elif what < 0.7:
        own[j] = pick, share * math.exp(rng.normal(0.0, _LONGER[1] + _LONGER[0] * warmth))
    elif what < 0.94:
        held = own.pop(j)
        into = int(rng.integers(len(out) + int(rng.random() < _OWN)))
        if into == len(out):
            out.append([])
        out[into].insert(int(rng.integers(len(out[into]) + 1)), held)
    elif what < 0.97 and sum(map(len, out)) < problem.speeds_max:
        own.insert(j, (pick, share))
    else:
        own.pop(j)
    made = tuple(tuple(stroke) for stroke in out if stroke)
    return made or None
