"""What the findings are worth on data that neither their choice nor their fit has seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Holdout, fit_of
from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.choosing.shifts import shifted
from agent.explain.numbers.model import left_by, with_numbers
from agent.explain.rows.beginnings import begun, without_beginnings
from agent.explain.rows.creep import creep_beside
from agent.explain.rows.evidence import solve
from agent.explain.rows.forgetting import forgetting
from agent.explain.rows.left_out import left_out_as_in
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.table import BASE, Table, TooShortError, tabulate, without_edges
from agent.identify.result import Floats
from agent.physics.twin import Twin

_FOLDS = 3
_FEWEST = 20  # rows of a hold-out: some seconds of sliding
_MISSED = 1.5  # times the mean square that what was found leaves, fitted to the other folds
_AS_IT_IS = (
    "what was found in all of them was fitted to the rest instead, and a recording that is held "
    "out would prove more"
)
_BEGUN = 4.0  # times the mean square after it: so much an unknown beginning leaves
_DRAWS = 400
_LAGS = 20
_WHITE = 3.0


@dataclass(frozen=True)
class Compared:
    """Residuals of three predictions on one set of rows, all shape (m,), and the rows' blocks.

    `base` holds the plain twin's columns, shape (m, 5), of recordings that were held out.
    """

    measured: Floats
    given: Floats
    refitted: Floats
    extended: Floats
    block: NDArray[np.int64]
    base: Floats | None = None


def compare_runs(
    twin: Twin,
    refitted: Twin,
    extended: Twin,
    runs: Sequence[Run],
    like: Table,
    creep_rad_s: float = 0.0,
) -> tuple[Compared, Table]:
    """Return how three twins predict hold-out runs, in the band of the training table.

    Parameters
    ----------
    twin, refitted, extended : Twin
        As given, with its own numbers refitted, and with what was found.
    runs : sequence of Run
        Which nothing was learnt from.
    like : Table
        Of those learnt from.
    creep_rad_s : float
        Up to which speed these creep beside what was found: a larger mismatch may have hidden it.

    Raises
    ------
    TooShortError
        In that band the runs show next to nothing but rest and the edges of motion.
    """
    table = tabulate(like.twin, runs, like.cutoff_hz, align_velocity=like.aligned)
    if like.creep_rad_s or like.torque_late_s:
        table = without_edges(table, like.creep_rad_s, like.torque_late_s)
    table = left_out_as_in(table, like)
    left = [left_by(t, table) for t in (twin, refitted, extended)]
    # The joint may rest and creep here as in none of the recordings to learn from.
    creeps = max(creep_rad_s, creep_beside(table, left[-1]))
    if creeps > table.creep_rad_s:
        table = without_edges(table, creeps, like.torque_late_s)
    table = apart_from_unknown_beginnings(table, extended, left[-1])
    rows = np.flatnonzero(table.sliding)
    good = rows[np.all([np.isfinite(x[rows]) for x in left], axis=0)]
    if good.size < _FEWEST:
        raise TooShortError(
            f"in the band that is compared ({table.cutoff_hz:.2g} Hz) next to all of it is rest, "
            "or too close to a start or a reversal"
        )
    return (
        Compared(
            table.measured_nm[good],
            left[0][good],
            left[1][good],
            left[2][good],
            table.block[good],
            table.base[good],
        ),
        table,
    )


def apart_from_unknown_beginnings(table: Table, extended: Twin, left_nm: Floats) -> Table:
    """Return a table of held-out runs without what their arm's unknown beginnings reach.

    As it is where these are no worse than all else.

    Parameters
    ----------
    table : Table
    extended : Twin
    left_nm : ndarray, shape (n,)
        What that leaves at its rows.
    """
    arm = forgetting(extended)
    if arm is None or table.arm_forgets is not None:
        return table
    asked = table.sliding & np.isfinite(left_nm)
    late = asked & ~begun(table, arm)
    early = asked & ~late
    if not early.any() or np.count_nonzero(late) < np.count_nonzero(early):
        return table
    worse = float(np.mean(left_nm[early] ** 2)) > _BEGUN * float(np.mean(left_nm[late] ** 2))
    return without_beginnings(table, arm) if worse else table


def compare_folds(
    library: Library, told: Sequence[Candidate] = ()
) -> tuple[Compared, str, tuple[str, ...]]:
    """Return what the search finds without each fold predicts of that fold.

    Folds are whole recordings where there are three or more, else whole velocity steps, and blocks
    of time where there are too few of those. Where a search without a third of a short recording
    misses what the whole of it shows, that is no proof against a law: what was found is fitted to
    the other folds instead, and that a search of its own does not find it is said.

    Parameters
    ----------
    library : Library
    told : sequence of Candidate
        What was found in all folds.

    Returns
    -------
    compared : Compared
    source : str
        Which data these are.
    bear_in_mind : tuple of str
    """
    weighing = library.weighing
    lengths = np.diff(np.append(weighing.starts, weighing.rows.shape[0]))
    run = weighing.run[weighing.starts]
    several = np.unique(run).size >= _FOLDS
    table = library.scene.table
    steps = None if several else table.step_folds(weighing.rows[weighing.starts], _FOLDS)
    if several:
        fold, left_out = np.unique(run, return_inverse=True)[1] % _FOLDS, "recordings"
    elif steps is not None:
        fold, left_out = steps, "velocity steps"
    else:
        fold, left_out = np.arange(run.size) % _FOLDS, "blocks of time"
    scale = 1.0 / weighing.weight
    refitted, extended, fitted = (np.empty_like(library.target) for _ in range(3))
    for k in range(_FOLDS):
        train = fold != k
        test = np.repeat(~train, lengths)
        part = library.part(train)
        found = choose(part, rivals=False).candidates
        refitted[test] = _left(library, part, (), test)
        extended[test] = _left(library, part, found, test)
        own = [part.candidate(c.form, c.point) for c in told]
        fitted[test] = _left(library, part, own, test)
    missed = bool(told) and float(extended @ extended) > _MISSED * float(fitted @ fitted)
    compared = Compared(
        table.measured_nm[weighing.rows],
        library.target * scale,
        refitted * scale,
        (fitted if missed else extended) * scale,
        np.repeat(np.arange(lengths.size), lengths),
    )
    said = f"a search without a third of the {left_out} finds less, or something else; {_AS_IT_IS}"
    return compared, f"{left_out} left out in turn", (said,) if missed else ()


def _left(
    library: Library, part: Library, found: Sequence[Candidate], test: NDArray[np.bool_]
) -> Floats:
    """Return the weighted residual on test rows of a model fitted to a part's rows."""
    whole = [library.candidate(c.form, c.point) for c in found]
    columns = library.model(whole)
    own = part.model(found)
    theta = solve(own.T @ own, own.T @ part.target)
    return np.asarray(library.target[test] - columns[test] @ theta)


def prove(
    compared: Compared, source: str, floor_nm: float, placebo_percent: float, cutoff_rows: float
) -> Holdout:
    """Return the proof in numbers.

    Parameters
    ----------
    compared : Compared
    source : str
        Which data these are, for a sentence.
    floor_nm : float
    placebo_percent : float
        What the same search improves on shifted residuals.
    cutoff_rows : float
        Rows per cutoff period: correlation that the filter itself makes lasts so long.
    """
    blocks = np.unique(compared.block, return_inverse=True)[1]
    count = int(blocks.max()) + 1
    squares = [
        np.bincount(blocks, x**2, minlength=count)
        for x in (compared.given, compared.refitted, compared.extended)
    ]
    rng = np.random.default_rng(0)
    draws = rng.integers(0, count, (_DRAWS, count))
    ratio = np.sqrt(squares[2][draws].sum(axis=1) / squares[0][draws].sum(axis=1))
    low, high = (100.0 * (1.0 - float(x)) for x in np.quantile(ratio, [0.975, 0.025]))
    fits = [
        fit_of(compared.measured, x) for x in (compared.given, compared.refitted, compared.extended)
    ]
    return Holdout(
        source=source,
        baseline=fits[0],
        refitted=fits[1],
        extended=fits[2],
        improvement_percent=100.0 * (1.0 - fits[2].rmse_nm / fits[0].rmse_nm),
        improvement_ci95_percent=(low, high) if count > 3 else None,
        floor_ratio=fits[2].rmse_nm / floor_nm if floor_nm > 0.0 else math.nan,
        wins=int(np.sum(squares[2] < squares[0])),
        blocks=count,
        placebo_percent=placebo_percent,
        white=_white(compared.extended, blocks, cutoff_rows),
    )


def _white(left: Floats, blocks: NDArray[np.int64], cutoff_rows: float) -> bool:
    """Return whether the residual is uncorrelated beyond the filter's own memory."""
    x = left - left.mean()
    energy = float(x @ x)
    if energy <= 0.0:
        return True
    first = math.ceil(2.0 * cutoff_rows)
    limit = _WHITE / math.sqrt(x.shape[0] / max(cutoff_rows, 1.0))
    for lag in range(first, first + _LAGS):
        same = blocks[lag:] == blocks[:-lag]
        if abs(float(np.sum(x[lag:][same] * x[:-lag][same]))) / energy > limit:
            return False
    return True


def placebo(library: Library) -> float:
    """Return by how many percent the same search improves a residual that was shifted.

    The residual is turned in a circle within each recording, its blocks change sign at random:
    nothing in it follows any axis any more, and whatever improves on unseen data is luck.
    """
    basis = basis_of(library.base)
    fitted = basis @ (basis.T @ library.target)
    drawn = shifted(library.weighing, library.target - fitted, seed=7, count=1)
    choice = choose(replace(library, target=fitted + drawn[:, 0].astype(np.float64)), rivals=False)
    return 100.0 * (1.0 - math.sqrt(float(choice.full.sum()) / float(choice.plain.sum())))


def refitted_twin(table: Table, twin: Twin) -> Twin:
    """Return the twin's own structure with the numbers that fit the table best."""
    delta, _ = refit(table)
    moved = {name: getattr(twin, name) + d for name, d in zip(BASE, delta, strict=True)}
    return with_numbers(twin, moved)
