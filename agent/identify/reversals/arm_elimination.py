"""A motor's true motion, which nobody knows, eliminated from the equations of a dragged arm.

The motor's encoder errs by its steps, and what errs in the angle errs in the acceleration by the
square of frequency: it is noise in the torque, in the arm's drive and in the regressor alike, and
least squares with the measured motion take too small an inertia. So every sample's angle is an
unknown of its own, held by the encoder to its error, beside the small change of the arm's path
that follows from it. At a steady speed an encoder passes its steps at a steady rate, and its error
is a line, at any frequency: there is no acceleration to weigh it against, and none is asked for.
Angles and arm reach over neighbours only: their equations are banded, and eliminating them costs
about as much as a filter. What is left weighs every sample by the noise as it is, in all
frequencies (Golub and Van Loan 1980; Rauch, Tung and Striebel 1965 for the same as a smoother).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from agent.identify.result import Floats
from agent.identify.reversals.arm_record import ArmRecord
from agent.identify.reversals.arm_simulation import (
    MOTOR,
    SHAPE,
    TWICE,
    Numbers,
    Path,
    drag,
    reading,
    slopes,
)

_ONCE = np.array([1 / 12, -2 / 3, 0.0, 2 / 3, -1 / 12])
_TIED = 300.0  # times as close as the torque's noise: the arm obeys its equation
_SLIPS = 1e-3  # of the motor's fastest velocity
_RIDGE = 1e-9
_PAIRS = 8  # of opposite noise: what they say of the average scatters by 0.05 of an error
_BLOCKS = 5  # of equations a sample: motor's angle, torque, steady speed, arm's angle, arm's motion
TORQUE, ARM = 1, 3
"""Which of a record's blocks of equations are the torque's and the arm's encoder's."""


@dataclass(frozen=True)
class Reduced:
    """One record's equations without its motion; `_BLOCKS` n rows in units of their noise.

    Parameters
    ----------
    columns : ndarray, shape (m, k)
        Slopes by the free numbers.
    rest : ndarray, shape (m,)
        What is left at these numbers.
    turn : ndarray of int, shape (m,)
        Reversal of every row.
    counted : float
        How many readings they are, less the motion's own unknowns.
    motion : ndarray, shape (n, k + 1)
        How the motor's angle follows the free numbers; last, its own change.
    """

    columns: Floats
    rest: Floats
    turn: Any
    counted: float
    motion: Floats

    def left(self, block: int) -> Floats:
        """Return what is left of one block of equations, shape (n,)."""
        return np.asarray(self.rest.reshape(_BLOCKS, -1)[block])


def reduced(
    record: ArmRecord, number: int, motor_rad: Floats, at: Numbers, free: tuple[int, ...]
) -> Reduced:
    """Return the equations of one record, linear about these numbers and this motion."""
    n, slides = record.size, record.slides
    once, twice = _operator(n, _ONCE) / record.period_s, _operator(n, TWICE) / record.period_s**2
    speed, acceleration = once @ motor_rad, twice @ motor_rad
    torque_columns = np.column_stack((acceleration * record.swings, record.way, speed))
    drawn = _drawn(record, number, motor_rad, at)
    path, read = drawn.path, drawn.read
    predicted = path.felt_nm + torque_columns @ at.w[: len(MOTOR)] + at.w[len(MOTOR) + number]
    rest = np.concatenate(
        (
            (record.motor_rad - motor_rad) / record.motor_error_rad,
            drawn.weigh_torque * (record.torque_nm - predicted),
            -acceleration * ~slides / record.hardest_rad_s2,
            drawn.weigh_arm * (record.arm_rad - path.seen_rad),
            np.zeros(n),
        )
    )
    own = [i for i in free if i < at.x.size]
    columns = np.zeros((_BLOCKS * n, len(free)))
    by_torque, by_arm = (columns[b * n : (b + 1) * n] for b in (TORQUE, ARM))
    seen, tooth = slopes(record, number, motor_rad, at, own)
    by_torque[:, : len(own)] = drawn.weigh_torque[:, np.newaxis] * tooth
    by_arm[:, : len(own)] = drawn.weigh_arm[:, np.newaxis] * seen
    for place, i in enumerate(free[len(own) :], start=len(own)):
        straight = i - at.x.size
        if straight < len(MOTOR):
            by_torque[:, place] = drawn.weigh_torque * torque_columns[:, straight]
        elif straight == len(MOTOR) + number:
            by_torque[:, place] = drawn.weigh_torque
    every = np.column_stack((columns, rest))
    solved = _solved(drawn.motion, every)
    left = every - drawn.motion @ solved
    return Reduced(
        left[:, :-1],
        left[:, -1],
        np.tile(record.turn, _BLOCKS),
        float(n + read.sum()),
        solved[0::2],
    )


def bent(record: ArmRecord, number: int, motor_rad: Floats, at: Numbers) -> Floats:
    """Return what the motion's own noise adds to torque and arm on average, shape (5 n,).

    In units of the noise and without the motion, as `Reduced.rest`. An arm that is dragged goes as
    far as the peaks of what is left of the noise, wherever it turns or hardly touches: an average
    of paths is not the path of the average. Pairs of opposite noise leave that alone.
    """
    n, drawn = record.size, _drawn(record, number, motor_rad, at)
    noise = np.random.default_rng(n).standard_normal((_BLOCKS * n, _PAIRS))
    heard = [np.ones(n), drawn.weigh_torque > 0.0, np.zeros(n), drawn.weigh_arm > 0.0, np.zeros(n)]
    shaken = _solved(drawn.motion, noise * np.concatenate(heard)[:, np.newaxis])[0::2]
    felt, seen = np.zeros((2, n))
    for own in (*shaken.T, *-shaken.T):
        other = drag(record, number, motor_rad + own, at)
        felt += (other.felt_nm - drawn.path.felt_nm) / (2.0 * _PAIRS)
        seen += (other.seen_rad - drawn.path.seen_rad) / (2.0 * _PAIRS)
    none = np.zeros(n)
    bend = np.concatenate((none, drawn.weigh_torque * felt, none, drawn.weigh_arm * seen, none))
    solved = _solved(drawn.motion, bend[:, np.newaxis])
    return np.asarray(bend - (drawn.motion @ solved)[:, 0])


@dataclass(frozen=True)
class _Drawn:
    """An arm drawn along by a motion, what counts of it, and how all rows follow both angles."""

    path: Path
    read: NDArray[np.bool_]
    weigh_torque: Floats
    weigh_arm: Floats
    motion: Any


def _drawn(record: ArmRecord, number: int, motor_rad: Floats, at: Numbers) -> _Drawn:
    path = drag(record, number, motor_rad, at)
    read = reading(record, path)
    weigh_torque = record.slides / record.torque_error_nm
    weigh_arm = read / record.arm_error_rad
    motion = _motion(record, at, path.tooth_nm, path.rate_rad_s, weigh_torque, weigh_arm)
    return _Drawn(path, read, weigh_torque, weigh_arm, motion)


def _motion(
    record: ArmRecord,
    at: Numbers,
    tooth_nm: Floats,
    rate_rad_s: Floats,
    weigh_torque: Floats,
    weigh_arm: Floats,
) -> Any:
    """Return how all rows follow the motor's and the arm's angles, by turns: (5 n, 2 n), sparse."""
    n, once = record.size, _operator(record.size, _ONCE) / record.period_s
    twice, whole = _operator(n, TWICE) / record.period_s**2, sparse.identity(n, format="csr")
    _, stiffness, damping, inertia, *_ = at.gear().tolist()
    touching = sparse.diags((tooth_nm != 0.0).astype(np.float64))
    tooth = touching @ (stiffness * whole + damping * once)
    slips = np.abs(rate_rad_s) > _SLIPS * float(np.abs(rate_rad_s).max())
    late = float(at.x[SHAPE.index("skew_s")]) / record.period_s
    before = int(np.floor(late))
    seen = (before + 1 - late) * _shift(n, before) + (late - before) * _shift(n, before + 1)
    tied = _TIED / record.torque_error_nm
    moving, standing = sparse.diags(tied * slips), sparse.diags(tied * ~slips)
    torque = sparse.diags(weigh_torque)
    swung = sparse.diags(record.swings.astype(np.float64)) @ twice
    free = inertia * twice + tooth
    blocks = [
        [whole / record.motor_error_rad, None],
        [torque @ (at.w[0] * swung + at.w[2] * once + tooth), -torque @ tooth],
        [sparse.diags(~record.slides / record.hardest_rad_s2) @ twice, None],
        [None, sparse.diags(weigh_arm) @ seen],
        [-moving @ tooth, moving @ free + inertia / record.period_s * standing @ once],
    ]
    turns = np.arange(2 * n).reshape(2, n).T.ravel()
    together: Any = sparse.bmat(blocks, format="csc")
    return together[:, turns]


def _operator(n: int, stencil: Floats) -> Any:
    reach = stencil.size // 2
    offsets = range(-reach, reach + 1)
    diagonals = [np.full(n - abs(k), c) for k, c in zip(offsets, stencil, strict=True)]
    inside = np.ones(n)
    inside[:reach] = inside[-reach:] = 0.0  # at the ends it would take what is outside for zero
    whole: Any = sparse.diags(diagonals, list(offsets), format="csr")
    return whole.multiply(inside[:, np.newaxis]).tocsr()


def _shift(n: int, samples: int) -> Any:
    return sparse.diags([np.ones(n - abs(samples))], [-samples], shape=(n, n), format="csr")


def _solved(motion: Any, every: Floats) -> Floats:
    """Return least squares' weights of the motion for every column, by a banded Cholesky factor."""
    normal = (motion.T @ motion).tocoo()
    band = int(np.max(normal.row - normal.col))
    below = normal.row >= normal.col
    banded = np.zeros((band + 1, motion.shape[1]))
    np.add.at(banded, ((normal.row - normal.col)[below], normal.col[below]), normal.data[below])
    banded[0] += _RIDGE * float(np.mean(banded[0]))
    factor = cholesky_banded(banded, lower=True)
    return np.asarray(cho_solve_banded((factor, True), np.asarray(motion.T @ every)))
