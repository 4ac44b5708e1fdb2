"""Recordings without rows that repeat the row before; see `identify.signals.repeats`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.run import Run
from agent.identify.signals import repeats


def without_repeats(runs: Sequence[Run]) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return recordings without rows that were told twice, and what is to be said of them.

    Parameters
    ----------
    runs : sequence of Run
    """
    told = [repeats.repeats(run.signals) for run in runs]
    count = sum(int(np.count_nonzero(rows)) for rows in told)
    if not count:
        return tuple(runs), ()
    kept = tuple(_less(run, rows) for run, rows in zip(runs, told, strict=True))
    return kept, (repeats.said_of(count, sum(rows.shape[0] for rows in told)),)


def _less(run: Run, rows: NDArray[np.bool_]) -> Run:
    if not rows.any():
        return run
    columns = {name: values[~rows] for name, values in run.columns.items()}
    return replace(run, signals=repeats.without(run.signals, rows), columns=columns)
