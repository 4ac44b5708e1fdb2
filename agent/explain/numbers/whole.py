"""What a model's effects add to the twin's torque, for the laws that are made of all of it.

A drive that reports its torque late, or clips it, does so with the whole: with what a soft gear or
a cable adds as well. A delay taken from the twin's own torque alone leaves these on time, and bends
their numbers for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.choosing.search import Candidate, Library
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_REPORTED = frozenset({"measurement-delay", "torque-saturation"})
_MOVED = 0.02  # of what is added: less changes no law that is made of it


@dataclass(frozen=True)
class Known:
    """What an effect adds with the numbers found, on any scene."""

    candidate: Candidate
    coefficients: Floats

    def __call__(self, scene: Scene) -> Floats:
        """Return its torque at full rate, shape (N,)."""
        columns = self.candidate.form.columns(scene, self.candidate.point)
        return np.asarray(columns @ self.coefficients)


def known_beside(library: Library, terms: Sequence[Candidate]) -> tuple[Known, ...]:
    """Return the terms that act on the joint, where another acts on what the drive reports."""
    columns = library.model(terms)
    theta = solve(columns.T @ columns, columns.T @ library.target)
    start, known = library.base.shape[1], []
    for term in terms:
        stop = start + term.columns.shape[1]
        if term.form.effect not in _REPORTED:
            known.append(Known(term, theta[start:stop]))
        start = stop
    return tuple(known) if len(known) < len(terms) else ()


def grown(scene: Scene, beside: tuple[Known, ...]) -> bool:
    """Return whether effects add another torque than the laws of the whole were taken at."""
    if not beside or not scene.beside:
        return bool(beside) != bool(scene.beside)
    change = replace(scene, beside=beside).beside_nm - scene.beside_nm
    return float(change @ change) > _MOVED**2 * float(scene.beside_nm @ scene.beside_nm)
