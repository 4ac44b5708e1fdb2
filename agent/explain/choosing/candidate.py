"""A law at one point, what it would remove beside a model, and what it does on unseen data."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.forms.form import Form, Point
from agent.explain.rows.kept import Kept
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats


@dataclass(frozen=True)
class Candidate:
    """One form at one point, and its weighted columns among the rows."""

    form: Form
    point: Point
    kept: Kept

    @classmethod
    def of(cls, form: Form, point: Point, columns: Floats) -> Candidate:
        """Return a candidate of columns, shape (m, k), that are there."""
        return cls(form, point, Kept(None, columns))

    @property
    def columns(self) -> Floats:
        """Return the weighted columns, shape (m, k)."""
        return self.kept.columns

    @property
    def gram(self) -> Floats:
        """Return the columns' products with each other, shape (k, k)."""
        return self.kept.gram

    def at_rows(self, rows: NDArray[np.bool_]) -> Candidate:
        """Return the same candidate over some rows, shape (m,)."""
        return replace(self, kept=Kept(lambda: self.columns[rows]))


@dataclass(frozen=True)
class Known:
    """What an effect adds with the numbers found, on any scene."""

    candidate: Candidate
    coefficients: Floats

    def __call__(self, scene: Scene) -> Floats:
        """Return its torque at full rate, shape (N,)."""
        columns = self.candidate.form.columns(scene, self.candidate.point)
        return np.asarray(columns @ self.coefficients)


@dataclass(frozen=True)
class Together:
    """What several known effects add together, on any scene."""

    known: tuple[Known, ...]

    def __call__(self, scene: Scene) -> Floats:
        """Return their torque at full rate, shape (N,)."""
        return np.asarray(np.sum([each(scene) for each in self.known], axis=0))


@dataclass(frozen=True)
class Scored:
    """One form's best candidate against a model.

    Parameters
    ----------
    candidate : Candidate
    coefficients : ndarray, shape (k,)
        Beside the model's own columns, refitted.
    screened : float
        Share of the model's squared residual that it removes, on all rows.
    blocks : ndarray, shape (b,)
        Weighted squared error of every block under fits to the other folds.
    """

    candidate: Candidate
    coefficients: Floats
    screened: float
    blocks: Floats

    @property
    def form(self) -> Form:
        """Return the candidate's form."""
        return self.candidate.form

    @property
    def error(self) -> float:
        """Return the squared error on data that was not seen."""
        return float(self.blocks.sum())

    def values(self) -> dict[str, float]:
        """Return all of its numbers by name."""
        form = self.form
        out = {n: float(c) for n, c in zip(form.linear, self.coefficients, strict=True)}
        out.update({n: float(c) for n, c in zip(form.nonlinear, self.candidate.point, strict=True)})
        return out


def basis_of(columns: Floats, like: Floats | None = None) -> Floats:
    """Return an orthonormal basis of columns, shape (m, r), those that are nothing left out.

    A column is nothing against `like`, shape (m, k), of which it is what a projection left.
    """
    size = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    whole = size if like is None else np.sqrt(np.einsum("ij,ij->j", like, like))
    kept = size > 1e-6 * np.maximum(whole, 1e-300)
    if not kept.any():
        return np.zeros((columns.shape[0], 0))
    if np.count_nonzero(kept) == 1:
        return np.asarray(columns[:, kept] / size[kept])
    q, r = np.linalg.qr(columns[:, kept] / size[kept])
    good = np.abs(np.diag(r)) > 1e-6
    return np.asarray(q[:, good])


def gain_of(candidate: Candidate, basis: Floats, left: Floats) -> float:
    """Return the squared residual that a candidate removes; 0 where its sign is impossible.

    Parameters
    ----------
    candidate : Candidate
    basis : ndarray, shape (m, r)
        Orthonormal, of the model beside which it stands.
    left : ndarray, shape (m,)
        What the model leaves.
    """
    # What the projection leaves of a column is orthogonal to what it takes: products are enough.
    columns = candidate.columns
    copied = basis.T @ columns
    if columns.shape[1] == 1:
        return _gain_of_one(candidate, copied[:, 0], basis, left)
    gram = candidate.gram - copied.T @ copied
    scale = np.sqrt(np.maximum(np.diag(gram), 0.0))
    whole = np.sqrt(np.diag(candidate.gram))
    if np.any(scale <= 1e-6 * np.maximum(whole, 1e-300)):
        return 0.0
    gram = gram / np.outer(scale, scale)
    gram.flat[:: gram.shape[0] + 1] += 1e-9
    moment = (columns.T @ left - copied.T @ (basis.T @ left)) / scale
    theta = np.linalg.solve(gram, moment)
    for i, value in enumerate(theta):
        if candidate.form.sign(i) * value < 0.0:
            return 0.0
    return float(moment @ theta)


def _gain_of_one(candidate: Candidate, copied: Floats, basis: Floats, left: Floats) -> float:
    """Return `gain_of` a candidate of one column, as most are: thousands are asked for."""
    whole = float(candidate.gram[0, 0])
    square = max(whole - float(copied @ copied), 0.0)
    if math.sqrt(square) <= 1e-6 * math.sqrt(max(whole, 1e-300)):
        return 0.0
    along = float(candidate.columns[:, 0] @ left - copied @ (basis.T @ left))
    if candidate.form.sign(0) * along < 0.0:
        return 0.0
    return along**2 / (square * (1.0 + 1e-9))
