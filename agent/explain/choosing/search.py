"""Candidates against a model: screened on all rows, ranked on data that they were not fitted to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, Scored, basis_of, gain_of
from agent.explain.choosing.descent import descended, movable
from agent.explain.choosing.heard import heard
from agent.explain.choosing.weighted import DELAY, weighted_columns
from agent.explain.forms.form import Form, Point
from agent.explain.forms.refinement import climbed
from agent.explain.forms.signal import later_by_numbers
from agent.explain.rows.evidence import Weighing, heldout, moments, solve
from agent.explain.rows.kept import Kept, new_round
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE
from agent.identify.result import Floats

_POINTS_IN_FOLDS = 4
_ROUNDS = 6  # of a form's numbers moved together
_POINTS_TRIED = 12  # of a form, where its best would leave no possible joint
_WORTH_FOLDS = 0.25  # of the best screened gain: less is not followed further
_NOT_NEGATIVE = tuple(
    BASE.index(name) for name in ("inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm")
)
_TOLERATED = 0.05


@dataclass(frozen=True)
class Library:
    """All candidates of one scene, compared with any model.

    Parameters
    ----------
    scene : Scene
    weighing : Weighing
    target : ndarray, shape (m,)
        Weighted measured less given torque.
    base : ndarray, shape (m, p)
        Weighted columns of the twin's own numbers, as far as they are excited.
    candidates : tuple of Candidate
    known : dict
        Every candidate that was asked for so far, by form and point: searches meet again.
    lenient : bool
        Whether a law may enter beside which the joint is none that could be: another one that makes
        it possible again may come later.
    """

    scene: Scene
    weighing: Weighing
    target: Floats
    base: Floats
    candidates: tuple[Candidate, ...]
    known: dict[tuple[Form, Point], Candidate] = field(
        default_factory=dict, compare=False, repr=False
    )
    lenient: bool = False

    @classmethod
    def of(cls, scene: Scene, weighing: Weighing, forms: Sequence[Form]) -> Library:
        """Return a library of forms whose signals were recorded, over their grids."""
        carried = scene.table.carried
        empty = cls(
            scene,
            weighing,
            weighing.weighted(scene.table.target_nm),
            weighing.weighted(scene.table.base)[:, carried],
            (),
        )
        return replace(empty, candidates=tuple(c for f in forms for c in empty.all_points(f)))

    def part(self, blocks: NDArray[np.bool_]) -> Library:
        """Return the library over some of its blocks, shape (b,)."""
        weighing, rows = self.weighing.part(blocks)
        return Library(
            self.scene,
            weighing,
            self.target[rows],
            self.base[rows],
            tuple(c.at_rows(rows) for c in self.candidates),
        )

    def candidate(self, form: Form, point: Point) -> Candidate:
        """Return the candidate of a point; its columns are made when they are asked for."""
        key = form, point
        found = self.known.get(key)
        if found is None:
            found = self.known[key] = Candidate(form, point, Kept(self.maker(form, point)))
        return found

    def maker(self, form: Form, point: Point) -> Callable[[], Floats]:
        """Return what makes a candidate's columns, without any other of the library."""
        return partial(weighted_columns, self.scene, self.weighing, form, point)

    def columns(self, form: Form, point: Point) -> Floats:
        """Compute one point's weighted columns, shape (m, k), and do not keep them."""
        found = self.known.get((form, point))
        return found.columns if found else self.maker(form, point)()

    def all_points(self, form: Form) -> list[Candidate]:
        """Return a form's candidates over its whole grid."""
        return [self.candidate(form, point) for point in form.grid(self.scene)]

    def model(self, terms: Sequence[Candidate]) -> Floats:
        """Return the columns of the base model and some terms, shape (m, p)."""
        return np.concatenate([self.base_beside(terms), *(t.columns for t in terms)], axis=1)

    def base_beside(self, terms: Sequence[Candidate]) -> Floats:
        """Return the columns of the twin's own numbers, as late as the torque if a term says so."""
        return self.late_base if any(t.form.effect == DELAY for t in terms) else self.base

    @cached_property
    def late_base(self) -> Floats:
        """Return the weighted columns of the twin's own numbers in a late torque, shape (m, p).

        A column on time beside the same one later has the noise of an acceleration twice, and least
        squares take a delay between both.
        """
        if not self.scene.late_s:
            return self.base
        table = self.scene.table
        raw = table.where_speed_changes(later_by_numbers(self.scene)[:, table.carried])
        return self.base + self.weighing.weighted(table.band(raw))

    def errors(self, terms: Sequence[Candidate]) -> Floats:
        """Return the squared error of every block under fits to the other folds, shape (b,)."""
        return self.errors_with(self.model(terms))

    def errors_with(self, *columns: Floats) -> Floats:
        """Return the same of a model of weighted columns, each shape (m, k), side by side."""
        every = np.concatenate(columns, axis=1)
        part = moments(every, self.target, self.weighing.starts)
        return heldout(part, self.weighing.fold) if every.shape[1] else part.square

    def residual(self, terms: Sequence[Candidate]) -> Floats:
        """Return what a model leaves of the weighted target, fitted to all rows, shape (m,)."""
        basis = basis_of(self.model(terms))
        return np.asarray(self.target - basis @ (basis.T @ self.target))

    def rank(
        self,
        terms: Sequence[Candidate],
        *,
        refined: bool = True,
        least: float = 0.0,
        known: Sequence[Candidate] = (),
    ) -> list[Scored]:
        """Return every form that helps the model, the best on unseen data first.

        Parameters
        ----------
        terms : sequence of Candidate
        refined : bool
            Whether every form's best point is moved between its neighbours.
        least : float
            Squared residual that a form must remove to be of use.
        known : sequence of Candidate
            To be screened beside those of the grids.
        """
        new_round()
        model = self.model(terms)
        basis = basis_of(model)
        left = self.target - basis @ (basis.T @ self.target)
        energy = float(left @ left)
        taken = {(t.form.effect, t.form.name, t.point) for t in terms}
        screened: dict[tuple[str, str], list[tuple[float, Candidate]]] = {}
        for candidate in (*self.candidates, *known):
            form = candidate.form
            if (form.effect, form.name, candidate.point) in taken:
                continue
            gain = gain_of(candidate, basis, left)
            screened.setdefault((form.effect, form.name), []).append((gain, candidate))
        best = max((max(g for g, _ in entry) for entry in screened.values()), default=0.0)
        worth = _WORTH_FOLDS * max(best, least)
        out = []
        for entry in screened.values():
            by_gain = sorted(entry, key=lambda pair: -pair[0])
            needed = 0.0 if heard(self.scene, by_gain[0][1].form) else worth
            if by_gain[0][0] <= needed:
                continue
            if refined:
                by_gain = self._refined(by_gain, basis, left)
            by_gain = self._from_possible(by_gain, model, needed)
            scored = self._scored(by_gain, model, energy) if by_gain else None
            if scored is not None:
                out.append(scored)
        return sorted(out, key=lambda s: s.error)

    def _refined(
        self, entry: list[tuple[float, Candidate]], basis: Floats, left: Floats
    ) -> list[tuple[float, Candidate]]:
        """Move the best point between its neighbours on the grid, ever more finely."""
        form = entry[0][1].form
        if not form.refine or not form.nonlinear:
            return entry

        def gain_at(point: Point) -> float:
            return gain_of(self.candidate(form, point), basis, left)

        points = np.array([c.point for c in self.candidates if c.form is form])
        gain, best = entry[0][0], entry[0][1].point
        if not form.together:
            gain, best = climbed(form, self.scene, points, best, gain, gain_at)
        if len(form.nonlinear) > 1:
            entry = [(gain, self.candidate(form, best)), *entry]
            best = self.deeper(self.candidate(form, best), basis, left).point
            gain = gain_at(best)
        return [(gain, self.candidate(form, best)), *entry]

    def deeper(self, candidate: Candidate, basis: Floats, left: Floats) -> Candidate:
        """Return a law at the point to which all of its numbers lead together.

        Parameters
        ----------
        candidate : Candidate
        basis : ndarray, shape (m, p)
            Of the model's columns, orthonormal.
        left : ndarray, shape (m,)
            What the model leaves of the weighted target.
        """
        form = candidate.form
        points = np.array([c.point for c in self.candidates if c.form is form])
        (found,) = descended(
            (candidate.point,),
            movable(0, form, self.scene, points),
            lambda _, point: self.columns(form, point),
            basis,
            left,
            lambda _, own: form.allows(own),
            _ROUNDS,
        )
        return Candidate.of(form, found, self.columns(form, found))

    def _from_possible(
        self, entry: list[tuple[float, Candidate]], model: Floats, worth: float
    ) -> list[tuple[float, Candidate]]:
        """Return an entry from its best point on that leaves a possible joint; nothing for none.

        A power of the speed near one takes over the viscous friction, and a little more. The law is
        none the worse for that: the point beside it, which leaves viscous friction, stands for it.
        """
        gram, moment = model.T @ model, model.T @ self.target
        for index, (gain, candidate) in enumerate(entry[:_POINTS_TRIED]):
            if gain <= worth:
                break
            cross = model.T @ candidate.columns
            whole = np.block([[gram, cross], [cross.T, candidate.gram]])
            theta = solve(whole, np.concatenate((moment, candidate.columns.T @ self.target)))
            if self.lenient or self._possible(theta):
                return entry[index:]
        return []

    def _scored(
        self, entry: list[tuple[float, Candidate]], model: Floats, energy: float
    ) -> Scored | None:
        """Return the best point with its error on unseen data, the point chosen without it."""
        parts = [
            (
                candidate,
                moments(
                    np.concatenate((model, candidate.columns), axis=1),
                    self.target,
                    self.weighing.starts,
                ),
            )
            for _, candidate in entry[:_POINTS_IN_FOLDS]
        ]
        errors = np.stack([heldout(part, self.weighing.fold) for _, part in parts])
        blocks = np.empty(errors.shape[1])
        for k in np.unique(self.weighing.fold):
            inside = self.weighing.fold == k
            # The point that the other folds like best: nothing of this fold chose it.
            chosen = int(np.argmin(errors[:, ~inside].sum(axis=1)))
            blocks[inside] = errors[chosen, inside]
        candidate = entry[0][1]
        theta = solve(*parts[0][1].total)
        own = theta[-candidate.columns.shape[1] :]
        if any(abs(value) > top for value, top in zip(own, candidate.form.highest, strict=False)):
            return None
        if not candidate.form.is_borne(self.scene, candidate.point, own):
            return None  # not with these numbers; beside other effects it may have others
        return Scored(candidate, own, entry[0][0] / max(energy, 1e-300), blocks)

    def _possible(self, theta: Floats) -> bool:
        """Return whether a fit leaves inertia, viscous and Coulomb friction above zero.

        A candidate that needs a joint without them has only traded one column for another.
        """
        carried = self.scene.table.carried
        moved = self.scene.as_given[carried] + theta[: self.base.shape[1]]
        usual = np.abs(self.scene.theta[carried])
        must = np.isin(np.flatnonzero(carried), _NOT_NEGATIVE)
        return bool(np.all(moved[must] >= -_TOLERATED * usual[must]))
