"""A torque whose zero is another one in every recording.

A drive may measure its current sensor's zero anew whenever it is switched on. What all recordings
share of it is in their zeros as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from agent.explain.forms.form import Form, Point, stack
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

OWN_ZEROS = "another zero in each recording"
_FEWEST, _MOST = 3, 50  # recordings: of two, drift tells as much


@lru_cache(maxsize=_MOST)
def zeros_of(count: int) -> tuple[Form, ...]:
    """Return the form for so many recordings, one number each; none for too few or too many."""
    if not _FEWEST <= count <= _MOST:
        return ()
    return (
        Form(
            "torque-offset",
            OWN_ZEROS,
            ("scale_of_zeros",),
            _recording_by_recording,
            tuple(f"zero_{place}_nm" for place in range(1, count + 1)),
            _as_left,
            refine=False,
            to_twin=_nothing_of_the_axis,
            from_residual=True,
            catch_all=True,
            rivals_none=True,
        ),
    )


def _recording_by_recording(scene: Scene, point: Point) -> Floats:
    zeros = np.array((*point, 0.0))  # nobody knows that of a recording that is only planned
    return stack(zeros[np.minimum(scene.runs(), len(point))])


def _as_left(scene: Scene) -> Sequence[Point]:
    """Return the zeros that are left beside the twin's own numbers.

    None where a recording slides one way alone: there a zero and dry friction are the same.
    """
    table = scene.table
    rows, count = table.sliding, len(table.runs)
    own = table.run[rows, np.newaxis] == np.arange(count)
    forward = table.rows["velocity_rad_s"][rows] > 0.0
    if not (own[forward].any(axis=0) & own[~forward].any(axis=0)).all():
        return ()
    columns = np.column_stack((own.astype(np.float64), table.base[rows][:, table.carried]))
    found = solve(columns.T @ columns, columns.T @ scene.residual_nm[rows])
    return (tuple(found[:count].tolist()),)


def _nothing_of_the_axis(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene, values
    return ()
