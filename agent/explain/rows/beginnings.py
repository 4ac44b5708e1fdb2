"""Where an arm behind the gear is not known yet: after a recording begins, and after long gaps.

An arm on a soft gear, or in a gap, is somewhere as a recording begins: its own friction holds it
twisted one way or the other, and nothing that was recorded says which. As the joint sets off it
swings from there, and only when that has died away does its motion follow from the motor's. The
same is true where so many samples were lost that it may have swung meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.forgetting import Forgetting
from agent.explain.rows.pieces import Piece
from agent.explain.rows.table import Table


def begun(table: Table, arm: Forgetting) -> NDArray[np.bool_]:
    """Return which rows an arm's unknown beginning reaches, shape (n,).

    From where the joint begins to slide: what is held by friction is not forgotten.
    """
    out = np.zeros(table.used.shape[0], dtype=np.bool_)
    time_s = table.rows["time_s"]
    for piece in _anew(table, arm):
        own = np.arange(piece.rows.start, table.used.shape[0])
        own = own[table.run[own] == piece.run]
        slides = own[table.sliding[own]]
        if slides.size:
            since = time_s[own] - time_s[slides[0]]
            out[own[since < arm.seconds]] = True
    return out


def without_beginnings(table: Table, arm: Forgetting | None) -> Table:
    """Return a table that leaves out where it is not known how an arm behind the gear swings."""
    if arm is None:
        return table
    return replace(table, used=table.used & ~begun(table, arm), arm_forgets=arm)


def _anew(table: Table, arm: Forgetting) -> Iterator[Piece]:
    """Yield the stretches before which nothing is known of the arm."""
    before: Piece | None = None
    for piece in table.pieces:
        same = before is not None and before.run == piece.run
        gap_s = piece.stretch.time_s[0] - before.stretch.time_s[-1] if before is not None else 0.0
        if not same or gap_s > arm.gap_s:
            yield piece
        before = piece
