"""Every recording before and after, for pictures."""

from __future__ import annotations

import numpy as np

from agent.explain.answer.result import Trace
from agent.explain.numbers.model import left_by
from agent.explain.rows.table import Table
from agent.explain.study import Study
from agent.physics.twin import Twin

_TRACE_POINTS = 1500


def traces_of(study: Study, refitted: Twin, table: Table, *, held_out: bool) -> tuple[Trace, ...]:
    """Return every run of a table before and after, thinned for a picture.

    Parameters
    ----------
    study : Study
    refitted : Twin
        The twin's own structure with the numbers that fit the study's table best.
    table : Table
        The study's own, or that of its hold-out.
    held_out : bool
    """
    left = [
        np.where(table.sliding, left_by(t, table), np.nan)
        for t in (study.twin, refitted, study.extended)
    ]
    out = []
    for index, run in enumerate(table.runs):
        at = np.flatnonzero(table.run == index)
        at = at[:: max(1, at.shape[0] // _TRACE_POINTS)]
        out.append(
            Trace(
                run.name,
                held_out,
                table.rows["time_s"][at],
                table.rows["velocity_rad_s"][at],
                table.measured_nm[at],
                left[0][at],
                left[1][at],
                left[2][at],
            )
        )
    return tuple(out)
