"""Rows that say nothing new: the row before once more, or its motion beside a torque of their own.

A controller that answers 250 times a second, asked 500 times, is told twice each time. As motion
that is a standstill and a jump in every second row. Where the whole row is told twice it is left
out; where torque comes faster than the motion does, the motion is taken from its neighbours.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.sampling import through_neighbours

_REACH = 8  # rows to either side over which it is asked whether the joint moves
_COUNTS = 2.0  # of the position from row to row: then an angle that stays is no slow joint's
_BY_CHANCE = 0.02  # of new answers bring the torque of the one before: less is a fine torque
_NEARLY_ALL = 0.9
_WORTH_A_WORD = 1e-3  # of all rows: a joint that sticks on its way is told the same for a moment
_OFTEN = 0.1  # of the rows in motion: from there on it is the log's habit, at rest as well


def repeats(signals: Signals) -> NDArray[np.bool_]:
    """Return which rows are the row before once more, shape (n,).

    Of a joint that moves by more than two counts of its position from row to row no row has torque,
    position and velocity of the one before. Without a position nothing is said.

    Parameters
    ----------
    signals : Signals
    """
    position = signals.position_rad
    out = np.zeros(signals.time_s.shape, np.bool_)
    if position is None or position.shape[0] <= 2 * _REACH:
        return out
    told = (signals.torque_nm, position, signals.velocity_rad_s)
    same = np.logical_and.reduce([c[1:] == c[:-1] for c in told if c is not None])
    same = np.concatenate(([False], same))
    moves = _moves(position)
    out = same & moves
    share = int(np.count_nonzero(out)) / max(int(np.count_nonzero(moves)), 1)
    if share > _OFTEN:
        out |= same & _beyond_chance(signals, moves & ~same, share)
    return np.asarray(out)


def with_motion_between(signals: Signals) -> tuple[Signals, int]:
    """Return a recording without held positions, and how many of its rows held one.

    A joint that moves by more than two counts from row to row is nowhere where it was: what is told
    so is between its neighbours. With the position velocity and arm are, where they are held, too.

    Parameters
    ----------
    signals : Signals
        Where rows were left out it stays as it is.
    """
    position = signals.position_rad
    if position is None or position.shape[0] <= 2 * _REACH or not signals.valid.all():
        return signals, 0
    held = np.concatenate(([False], position[1:] == position[:-1])) & ~_stands(signals, position)
    moves = _moves(position)
    count = int(np.count_nonzero(held & moves))
    if not count:
        return signals, 0
    if count > _OFTEN * np.count_nonzero(moves):
        # As a joint stops and starts it moves by less, and is told so as late.
        moves = np.convolve(moves, np.ones(2 * _REACH + 1), mode="same") > 0.5
    stale = held & moves

    def between(values: Floats | None) -> Floats | None:
        if values is None or not _are_held(values, stale):
            return values
        out, fresh = values.copy(), ~stale
        out[stale] = through_neighbours(signals.time_s[stale], signals.time_s[fresh], values[fresh])
        return out

    filled = replace(
        signals,
        position_rad=between(position),
        velocity_rad_s=between(signals.velocity_rad_s),
        position_arm_rad=between(signals.position_arm_rad),
    )
    return filled, count


def _stands(signals: Signals, position_rad: Floats) -> NDArray[np.bool_]:
    """Return where a joint stands by its own velocity, shape (n,): nowhere where it has none.

    As it comes to rest between two moves of one direction, for a few rows.
    """
    velocity = signals.velocity_rad_s
    if velocity is None:
        return np.zeros(position_rad.shape, np.bool_)
    row_s = float(np.median(np.diff(signals.time_s)))
    return np.asarray(np.abs(velocity) * row_s < _count_of(position_rad))


def _count_of(position_rad: Floats) -> float:
    """Return the least step of a position; infinite where it never moves."""
    steps = np.abs(np.diff(position_rad))
    return float(steps[steps > 0.0].min(initial=np.inf))


def _are_held(values: Floats, rows: NDArray[np.bool_]) -> bool:
    """Return whether a channel, shape (n,), is held in nearly all of these rows."""
    as_before = np.concatenate(([False], values[1:] == values[:-1]))
    return float(np.mean(as_before[rows])) > _NEARLY_ALL


def _beyond_chance(signals: Signals, answers: NDArray[np.bool_], share: float) -> NDArray[np.bool_]:
    """Return where a row that is the one before is told twice, and not by chance, shape (n,).

    Everywhere, where new answers in motion hardly ever bring the torque of the one before. A coarse
    torque may be the same all day at rest: there as many rows stay as answers came in motion.
    """
    torque = signals.torque_nm
    as_before = np.concatenate(([False], torque[1:] == torque[:-1]))
    if float(np.mean(as_before[answers])) < _BY_CHANCE:
        return np.ones(answers.shape, np.bool_)
    every, at = round(1.0 / (1.0 - share)), np.arange(answers.shape[0])
    first = np.maximum.accumulate(np.where(as_before, 0, at))
    return np.asarray((at - first) % every != 0)


def without(signals: Signals, rows: NDArray[np.bool_]) -> Signals:
    """Return a recording without these rows, shape (n,)."""
    arrays: dict[str, Any] = {
        field.name: values[~rows]
        for field in fields(signals)
        if isinstance(values := getattr(signals, field.name), np.ndarray)
    }
    return replace(signals, **arrays)


def said_of(count: int, of: int) -> str:
    """Return what is to be said of so many rows of all; nothing of a few."""
    if count < _WORTH_A_WORD * of:
        return ""
    rows = "1 row repeats" if count == 1 else f"{count} rows repeat"
    return (
        f"{rows} the row before ({100.0 * count / of:.2g} %), as a log that asks faster than the "
        f"drive answers: {'it was' if count == 1 else 'they were'} left out"
    )


def held_of(count: int, of: int) -> str:
    """Return what is to be said of so many rows of all that held a motion; nothing of a few."""
    if count < _WORTH_A_WORD * of:
        return ""
    rows = "1 row holds" if count == 1 else f"{count} rows hold"
    return (
        f"{rows} the motion of the row before ({100.0 * count / of:.2g} %), as a torque that is "
        "told more often than the motion: it was taken from the rows beside"
    )


def _moves(position_rad: Floats) -> NDArray[np.bool_]:
    """Return where the joint moves on by more than some counts from row to row, shape (n,).

    Before and behind, and the same way: where it comes to rest an angle that stays is no repeat,
    nor is one that comes again as it turns round.
    """
    count = _count_of(position_rad)
    out = np.zeros(position_rad.shape, np.bool_)
    way = position_rad[_REACH:] - position_rad[:-_REACH]
    far = np.where(np.abs(way) > _COUNTS * count * _REACH, np.sign(way), 0.0)
    out[_REACH:-_REACH] = far[_REACH:] * far[:-_REACH] > 0.0
    return out
