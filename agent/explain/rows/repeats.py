"""Recordings without rows that repeat the row before; see `identify.signals.repeats`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.run import Run
from agent.identify.signals import repeats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.wrapped import counted_on


def without_repeats(runs: Sequence[Run]) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return recordings without what was told twice, rows or motion, and what is to be said of it.

    Parameters
    ----------
    runs : sequence of Run
    """
    told = [repeats.repeats(run.signals) for run in runs]
    kept = [_less(run, rows) for run, rows in zip(runs, told, strict=True)]
    moved = [repeats.with_motion_between(run.signals) for run in kept]
    kept = [
        _moving(run, signals) if held else run
        for run, (signals, held) in zip(kept, moved, strict=True)
    ]
    rows = sum(each.shape[0] for each in told)
    twice, held = sum(int(np.count_nonzero(each)) for each in told), sum(n for _, n in moved)
    said = (repeats.said_of(twice, rows) if twice else "", repeats.held_of(held, rows))
    return tuple(kept), tuple(sentence for sentence in said if sentence)


def with_turns_counted(runs: Sequence[Run]) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return recordings whose positions do not begin anew with every turn, and what is said of it.

    Parameters
    ----------
    runs : sequence of Run
    """
    told = [counted_on(run.signals) for run in runs]
    found = [each for each in told if each.times]
    if not found:
        return tuple(runs), ()
    every = found[0]._replace(
        times=sum(each.times for each in found),
        loses_the_arm=any(each.loses_the_arm for each in found),
    )
    kept = (replace(run, signals=each.signals) for run, each in zip(runs, told, strict=True))
    return tuple(kept), (every.said,)


def _moving(run: Run, signals: Signals) -> Run:
    arm = signals.position_arm_rad
    columns = run.columns if arm is None else {**run.columns, "position_arm_rad": arm}
    return replace(run, signals=signals, columns=columns)


def _less(run: Run, rows: NDArray[np.bool_]) -> Run:
    if not rows.any():
        return run
    columns = {name: values[~rows] for name, values in run.columns.items()}
    return replace(run, signals=repeats.without(run.signals, rows), columns=columns)
