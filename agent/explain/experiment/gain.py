"""What an experiment is worth: by how much the rival's best refit falls behind (T-optimality).

``T(design) = min over theta_2 of sum (eta_1(x) - eta_2(x, theta_2))^2 / sigma^2`` (Atkinson and
Fedorov, Biometrika 62, 1975, 57), here over the recordings that are there already and the
experiment together, because the rival has to carry both. Half of it is the expected gain in log
density. Of a pair each is the truth in its turn, weighed by its probability (Ponce de Leon and
Atkinson, Biometrika 78, 1991, 601).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, Scored, basis_of
from agent.explain.choosing.search import Library
from agent.explain.experiment.motion import Elsewhere
from agent.explain.experiment.rivals import (
    Bounds,
    bounded_left,
    bounds_of,
    designs,
    numbers_beside,
    possible_points,
)
from agent.explain.forms.form import Form, Point
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import GRAVITY_AT
from agent.identify.result import Floats

_MOST_ROWS = 3000
_INEXACT = 0.05  # of an effect's energy: no law's form is so exact that missing less refutes

Contest = tuple[int, int, int]
"""Number of the truth, of its rival, and of the rival's point; one of the two is 0."""


@dataclass(frozen=True)
class Hypothesis:
    """One of the tied effects, fitted beside the model's other terms."""

    scored: Scored
    probability: float

    @property
    def effect(self) -> str:
        """Return its id."""
        return self.scored.form.effect


@dataclass(frozen=True)
class _Side:
    """Every hypothesis on some rows, weighted as in the library.

    Parameters
    ----------
    common : ndarray, shape (m, p)
        Columns of the twin's numbers and of the other terms.
    designs : for every hypothesis and point, ndarray, shape (m, k)
        A point's columns; for the fitted point also the directions in which its non-linear numbers
        move it.
    added : for every hypothesis, ndarray, shape (m,)
        What it adds as it was fitted.
    per_row : float
        How many independent samples a row is worth.
    """

    common: Floats
    designs: tuple[tuple[Floats, ...], ...]
    added: tuple[Floats, ...]
    per_row: float

    def gram(self, contest: Contest) -> Floats:
        """Return the Gram matrix of a rival's columns and, last, of the truth's torque."""
        i, j, k = contest
        parts = (self.common, self.designs[j][k], self.added[i][:, np.newaxis])
        columns = np.concatenate(parts, axis=1)
        return np.asarray(self.per_row * (columns.T @ columns))

    def part(self, rows: NDArray[np.int64], own: Floats | None) -> _Side:
        """Return some rows, shape (r,); columns that they alone have, (r, q), projected out."""
        basis = None if own is None else basis_of(own)

        def taken(values: Floats) -> Floats:
            here = values[rows]
            return here if basis is None else np.asarray(here - basis @ (basis.T @ here))

        return _Side(
            taken(self.common),
            tuple(tuple(taken(d) for d in designs) for designs in self.designs),
            tuple(taken(a) for a in self.added),
            self.per_row,
        )


@dataclass(frozen=True)
class Duel:
    """Tied hypotheses on recordings, ready to be compared on any experiment.

    Parameters
    ----------
    library : Library
        Of the recordings.
    others : tuple of Candidate
        The model's other terms.
    hypotheses : tuple of Hypothesis
        What was found, and its rivals: other effects.
    points : for every hypothesis, tuple of (Form, Point)
        The fitted one, and all others of its effect that might pass for another hypothesis.
    variance : float
        Of the weighted noise.
    per_second : float
        Independent samples in a second.
    grams : mapping of Contest to ndarray
        Of the recordings.
    bounds : mapping of Contest to Bounds
        Within which a rival is refitted.
    """

    library: Library
    others: tuple[Candidate, ...]
    hypotheses: tuple[Hypothesis, ...]
    points: tuple[tuple[tuple[Form, Point], ...], ...]
    variance: float
    per_second: float
    grams: dict[Contest, Floats]
    bounds: dict[Contest, Bounds]

    @classmethod
    def of(
        cls,
        library: Library,
        others: Sequence[Candidate],
        hypotheses: Sequence[Hypothesis],
        floor_nm: float,
    ) -> Duel:
        """Prepare the recordings' side.

        Parameters
        ----------
        library : Library
        others : sequence of Candidate
        hypotheses : sequence of Hypothesis
        floor_nm : float
            Standard deviation of what no model explains.
        """
        weighing, table = library.weighing, library.scene.table
        count = weighing.rows.shape[0]
        rows = np.sort(np.random.default_rng(0).permutation(count)[:_MOST_ROWS])
        residual = library.residual([*others, hypotheses[0].scored.candidate])
        independent = effective_size(table, weighing, residual)
        per_row = independent / rows.shape[0]
        variance = floor_nm**2 * float(np.mean(weighing.weight**2))
        common = library.model(others)[rows]
        added = tuple(h.scored.candidate.columns[rows] @ h.scored.coefficients for h in hypotheses)
        points = tuple(
            possible_points(library, rows, common, added, j, own.scored, 0.5 * per_row / variance)
            for j, own in enumerate(hypotheses)
        )
        sides = tuple(
            tuple(_weighted(library, d)[rows] for d in designs(library.scene, h.scored, each))
            for h, each in zip(hypotheses, points, strict=True)
        )
        side = _Side(common, sides, added, per_row)
        seconds = count * table.pieces[0].period_s * table.pieces[0].stride
        return cls(
            library,
            tuple(others),
            tuple(hypotheses),
            points,
            variance,
            min(independent / seconds, 2.0 * table.cutoff_hz),
            {contest: side.gram(contest) for contest in _contests(points)},
            _bounds(library, others, hypotheses, points),
        )

    def on(self, scene: Elsewhere) -> Experiments:
        """Return everything that is needed to judge experiments that make up one scene."""
        table = scene.table
        weight = _weights(self.library, scene)[:, np.newaxis]
        carried = self.library.scene.table.carried
        others = [table.band(c.form.columns(scene, c.point)) for c in self.others]
        sides = tuple(
            tuple(weight * table.band(d) for d in designs(scene, h.scored, each))
            for h, each in zip(self.hypotheses, self.points, strict=True)
        )
        added = tuple(
            d[0][:, : len(h.scored.coefficients)] @ h.scored.coefficients
            for d, h in zip(sides, self.hypotheses, strict=True)
        )
        common = weight * np.concatenate([table.base[:, carried], *others], axis=1)
        row_s = table.pieces[0].period_s * table.pieces[0].stride
        return Experiments(self, scene, _Side(common, sides, added, self.per_second * row_s))

    def missed(self, gram: Floats, contest: Contest) -> float:
        """Return what a rival's refit misses beyond what any law's form may be off.

        Parameters
        ----------
        gram : ndarray, shape (p, p)
            Of the rival's columns and, last, of the truth's torque.
        contest : Contest
        """
        first = self.library.base.shape[1] + sum(c.columns.shape[1] for c in self.others)
        low, high = self.bounds[contest]
        kept = np.array([*range(first), -1])
        without = bounded_left(gram[np.ix_(kept, kept)], (low[:first], high[:first]))
        return bounded_left(gram, (low, high)) - _INEXACT * without


@dataclass(frozen=True)
class Experiments:
    """Every hypothesis on a scene of experiments."""

    duel: Duel
    scene: Elsewhere
    side: _Side

    def only(self, runs: Sequence[int]) -> Experiment:
        """Return one experiment, which consists of some of the scene's runs."""
        table = self.scene.table
        rows = np.flatnonzero(table.used & np.isin(table.run, np.asarray(runs)))
        # Another payload is not known beforehand: its gravity is fitted with the rest.
        loaded = not np.allclose(self.scene.theta, self.scene.home.theta)
        side = self.side.part(rows, table.base[np.ix_(rows, GRAVITY_AT)] if loaded else None)
        contests = _contests(self.duel.points)
        return Experiment(self.duel, {contest: side.gram(contest) for contest in contests})


@dataclass(frozen=True)
class Experiment:
    """One experiment: the Gram matrices that it adds to those of the recordings."""

    duel: Duel
    grams: dict[Contest, Floats]

    def gain(self, rival: int, times: float = 1.0, enough: float = math.inf) -> float:
        """Return the expected gain in log density between the first hypothesis and a rival.

        Parameters
        ----------
        rival : int
            Number of the rival, from 1.
        times : float
            How often the experiment is driven.
        enough : float
            More than this counts for nothing, whichever of the two is true: else the one that is
            unlikely but easily refuted would outweigh the other.
        """
        first, second = (self.duel.hypotheses[i].probability for i in (0, rival))
        share = first / (first + second)
        either = self._against(0, rival, times), self._against(rival, 0, times)
        return share * min(either[0], enough) + (1.0 - share) * min(either[1], enough)

    def _against(self, i: int, j: int, times: float) -> float:
        """Return by how much log density a rival falls behind a truth."""
        now, then = [], []
        for k in range(len(self.duel.points[j])):
            before = self.duel.grams[i, j, k]
            after = before + times * self.grams[i, j, k]
            now.append(self.duel.missed(before, (i, j, k)))
            then.append(self.duel.missed(after, (i, j, k)))
        return 0.5 * max(max(min(then), 0.0) - max(min(now), 0.0), 0.0) / self.duel.variance


def _bounds(
    library: Library,
    others: Sequence[Candidate],
    hypotheses: Sequence[Hypothesis],
    points: Sequence[Sequence[tuple[Form, Point]]],
) -> dict[Contest, Bounds]:
    """Return within what every rival may be refitted, for every truth."""
    numbers = [numbers_beside(library, [*others, h.scored.candidate]) for h in hypotheses]
    return {
        (i, j, k): bounds_of(library, numbers[i], others, hypotheses[j].scored, points[j][k])
        for i, j, k in _contests(points)
    }


def _contests(points: Sequence[Sequence[object]]) -> Iterator[Contest]:
    for rival in range(1, len(points)):
        yield from ((0, rival, k) for k in range(len(points[rival])))
        yield from ((rival, 0, k) for k in range(len(points[0])))


def _weighted(library: Library, raw: Floats) -> Floats:
    """Return full-rate columns as the library's weighted rows, shape (m, k)."""
    return library.weighing.weighted(library.scene.table.band(raw))


def _weights(library: Library, scene: Scene) -> Floats:
    """Return the weight that the library gives a row of every stratum, at a scene's rows, (n,)."""
    weighing = library.weighing
    known = library.scene.table.stratum[weighing.rows]
    out = np.full(scene.table.used.shape[0], float(np.mean(weighing.weight)))
    for stratum in np.unique(known):
        out[scene.table.stratum == stratum] = weighing.weight[np.argmax(known == stratum)]
    return out
