"""What screening takes short cuts for is what the long way would say."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.explain.choosing.candidate import Candidate, basis_of, gain_of
from agent.explain.choosing.shifts import energies_in
from agent.explain.forms.form import Form, stack
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

ROWS = 60


def _no_columns(scene: Scene, point: tuple[float, ...]) -> Floats:
    del point
    return stack(scene.direction)


FORM = Form("torque-offset", "any", ("a", "b"), _no_columns)


@settings(deadline=None)  # the machine may be busy
@given(st.integers(0, 10_000))
def test_a_gain_is_what_a_fit_beside_the_model_removes_whatever_the_model_left(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, columns = rng.normal(size=(ROWS, 3)), rng.normal(size=(ROWS, 2))
    # Not orthogonal to the model: slopes of numbers beside it are in no least-squares fit.
    left = rng.normal(size=ROWS) + model @ rng.normal(size=3)
    basis = basis_of(model)
    alone = left - basis @ (basis.T @ left)
    both = basis_of(np.concatenate((model, columns), axis=1))
    after = left - both @ (both.T @ left)
    expected = float(alone @ alone) - float(after @ after)
    found = gain_of(Candidate.of(FORM, (), columns), basis, left)
    assert abs(found - expected) < 1e-6 * float(alone @ alone)


@settings(deadline=None)  # the machine may be busy
@given(st.lists(st.integers(1, 4), max_size=150))
def test_energies_of_many_spaces_are_those_of_each(widths: list[int]) -> None:
    rng = np.random.default_rng(len(widths))
    bases = [basis_of(rng.normal(size=(ROWS, width))) for width in widths]
    drawn = rng.normal(size=(ROWS, 7)).astype(np.float32)
    found = energies_in(bases, drawn)
    assert len(found) == len(bases)
    for basis, energies in zip(bases, found, strict=True):
        exact = np.sum((basis.T @ drawn) ** 2, axis=0)
        # Single precision is exact to a share of what was projected, however little of it is left.
        least = 1e-6 * float(np.sum(drawn[:, 0] ** 2))
        np.testing.assert_allclose(energies, exact, rtol=1e-4, atol=least)
