"""Recursive least squares in square-root form: rows come, the estimate follows.

What is kept is the triangular factor R of the information matrix and ``z = Q' y``; new rows are
appended below and one orthogonal triangularisation folds them in (Bierman, Factorization Methods
for Discrete Sequential Estimation, 1977, chapter V). Nothing is squared, so that a condition number
of 1e8 costs eight digits rather than all sixteen, and the covariance cannot lose its sign. With
the forgetting factor f, a row that is k rows old weighs ``f^k``; with f = 1 the estimate is the
batch least squares of all rows so far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats


@dataclass(frozen=True)
class RecursiveLeastSquares:
    """What is known after the rows so far; `update` returns what is known after more.

    Parameters
    ----------
    factor : ndarray, shape (p + 1, p + 1)
        Upper triangular: R beside z, and below them the root of the squared residual.
    forgetting : float
        Weight of a row against the next newer one, above 0, at most 1.
    weight : float
        Sum of the rows' weights: their number where nothing is forgotten.
    """

    factor: Floats
    forgetting: float = 1.0
    weight: float = 0.0

    @classmethod
    def start(cls, parameters: int, forgetting: float = 1.0) -> RecursiveLeastSquares:
        """Return the state that knows nothing: no prior, no start value.

        Raises
        ------
        ValueError
            No parameter, or a forgetting factor outside (0, 1].
        """
        if parameters < 1:
            raise ValueError(f"expected at least one parameter, got {parameters}")
        if not 0.0 < forgetting <= 1.0:
            raise ValueError(f"expected a forgetting factor above 0, at most 1, got {forgetting}")
        return cls(np.zeros((parameters + 1, parameters + 1)), forgetting)

    def update(self, columns: Floats, target: Floats) -> RecursiveLeastSquares:
        """Fold in rows, oldest first.

        Parameters
        ----------
        columns : ndarray, shape (m, p)
        target : ndarray, shape (m,)

        Raises
        ------
        ValueError
            Shapes that do not fit, or values that are not finite: one of them would never leave.
        """
        rows = target.shape[0]
        if columns.shape != (rows, self.factor.shape[0] - 1):
            raise ValueError(
                f"expected columns ({rows}, {self.factor.shape[0] - 1}), got {columns.shape}"
            )
        if not (np.all(np.isfinite(columns)) and np.all(np.isfinite(target))):
            raise ValueError("expected finite rows; leave masked samples out")
        age = self.forgetting ** np.arange(rows - 1, -1, -1)
        fresh = np.column_stack((columns, target)) * np.sqrt(age)[:, np.newaxis]
        kept = self.forgetting**rows
        # The old factor has p + 1 rows of its own, so that the new one is never short of any.
        _, factor = np.linalg.qr(np.vstack((np.sqrt(kept) * self.factor, fresh)))
        return RecursiveLeastSquares(
            factor, self.forgetting, float(kept * self.weight + np.sum(age))
        )

    @property
    def theta(self) -> Floats:
        """Return the estimate, shape (p,); NaN until the rows carry every parameter."""
        solved = self._inverse()
        if solved is None:
            return np.full(self.factor.shape[0] - 1, np.nan)
        return np.asarray(solved @ self.factor[:-1, -1], dtype=np.float64)

    @property
    def covariance(self) -> Floats:
        """Return ``s^2 (R' R)^-1``, shape (p, p), for white residuals; NaN until it is known."""
        width = self.factor.shape[0] - 1
        solved = self._inverse()
        if solved is None or self.weight <= width:
            return np.full((width, width), np.nan)
        variance = float(self.factor[-1, -1]) ** 2 / (self.weight - width)
        return np.asarray(variance * solved @ solved.T, dtype=np.float64)

    @property
    def condition_number(self) -> float:
        """Return the ratio of the regressor's extreme singular values, thesis (4.11)."""
        singular = np.linalg.svd(self.factor[:-1, :-1], compute_uv=False)
        return float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float("inf")

    def _inverse(self) -> Floats | None:
        """Return the inverse of R, or None while some combination of parameters is unseen.

        Columns are brought to unit length first: units must not decide what counts as unseen.
        """
        triangle = self.factor[:-1, :-1]
        length = np.sqrt(np.sum(triangle**2, axis=0))
        if np.any(length == 0.0):
            return None
        unit = triangle / length
        if np.abs(np.diag(unit)).min() < 1e-12:
            return None
        return np.asarray(np.linalg.inv(unit) / length[:, np.newaxis], dtype=np.float64)
