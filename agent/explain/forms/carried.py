"""What some recordings carry and others do not, though none of them says so.

Gravity's torque, and most often the inertia, are then others in these. Which recordings they are is
read off what is left: ordered by how much of gravity each has of its own, they are cut in two.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.explain.forms.form import Columns, Form, Point
from agent.explain.rows.evidence import solve
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import GRAVITY_AT
from agent.identify.result import Floats
from agent.physics.rigid_body import GRAVITY, gravity_columns

RECORDINGS = "recordings"
_GRAVITY_ALONE = "some recordings carry something else"
_WITH_INERTIA = "some recordings carry something else, which is accelerated"
CARRIED_BY_SOME = frozenset({_GRAVITY_ALONE, _WITH_INERTIA})
"""Names of its forms."""


_FEWEST, _MOST = 3, 50  # recordings: of two nobody knows which one is loaded; a point is a double
_CUTS = 3


def in_set(point: Point, count: int) -> tuple[int, ...]:
    """Return the recordings that a point stands for, by their place: its number's bits."""
    return tuple(run for run in range(count) if int(point[0]) >> run & 1)


def _there(scene: Scene, point: Point) -> Floats:
    return np.isin(scene.runs(), in_set(point, len(scene.table.runs))).astype(np.float64)


def _loaded(scene: Scene, point: Point) -> Floats:
    """Return gravity's columns in the recordings of a set, zero in all others, shape (N, 2)."""
    position, ratio = scene.full("position_rad"), scene.table.gear_ratio
    return np.asarray(_there(scene, point)[:, np.newaxis] * gravity_columns(position, ratio))


def _accelerated(scene: Scene, point: Point) -> Floats:
    """Return the same, and the acceleration as recorded, shape (N, 3)."""
    faster = scene.table.where_speed_changes(scene.stiff_rad_s2) * _there(scene, point)
    return np.column_stack((_loaded(scene, point), faster))


def _sets(scene: Scene) -> Sequence[Point]:
    """Return the sets of recordings that gravity's torque of their own sets apart best.

    Of both sides of a cut, the one whose gravity is the further from that of the twin as given.
    """
    table = scene.table
    count = len(table.runs)
    if not _FEWEST <= count <= _MOST or not table.sliding.any():
        return ()
    grams, moments = np.zeros((count, 2, 2)), np.zeros((count, 2))
    for run in range(count):
        rows = table.sliding & (table.run == run)
        columns = table.base[rows][:, GRAVITY_AT]
        grams[run] = columns.T @ columns
        moments[run] = columns.T @ scene.residual_nm[rows]
    total, moment = grams.sum(axis=0), moments.sum(axis=0)
    own = np.stack([solve(g, m) for g, m in zip(grams, moments, strict=True)])
    apart = own - solve(total, moment)
    spread = np.einsum("ri,rij,rk->ik", apart, grams, apart)
    along = np.linalg.eigh(0.5 * (spread + spread.T))[1][:, -1]
    order = np.argsort(apart @ along, kind="stable")

    def gain(cut: int) -> float:
        """Return the squared residual that gravity of either part's own removes."""
        parts = order[:cut], order[cut:]
        both = ((grams[p].sum(axis=0), moments[p].sum(axis=0)) for p in parts)
        return sum(float(m @ solve(g, m)) for g, m in both)

    cuts = sorted(range(1, count), key=gain, reverse=True)[:_CUTS]
    moved = (scene.theta - scene.as_given)[GRAVITY_AT]

    def unknown(runs: NDArray[np.int64]) -> float:
        """Return how far gravity in some recordings is from what the twin as given has of it."""
        own = solve(grams[runs].sum(axis=0), moments[runs].sum(axis=0)) + moved
        return float(own @ total @ own)

    sets = (max(order[:cut], order[cut:], key=unknown) for cut in cuts)
    return tuple((float(sum(1 << int(run) for run in runs)),) for runs in sets)


def _nothing_of_the_axis(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    del scene, values
    return ()  # what some recordings carry is no property of the axis: nothing for its twin


def _form(name: str, linear: tuple[str, ...], columns: Columns, refines: tuple[str, ...]) -> Form:
    return Form(
        "gravity-imbalance",
        name,
        linear,
        columns,
        (RECORDINGS,),
        _sets,
        needs=("position_rad",),
        refine=False,
        to_twin=_nothing_of_the_axis,
        from_residual=True,
        catch_all=True,
        refines=refines,
    )


FORMS: tuple[Form, ...] = (
    _form(_GRAVITY_ALONE, GRAVITY, _loaded, ()),
    _form(_WITH_INERTIA, (*GRAVITY, "inertia_kg_m2"), _accelerated, (_GRAVITY_ALONE,)),
)
