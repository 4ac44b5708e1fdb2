"""A law's torque on a scene, as the weighted rows that models are fitted to."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import ReferenceType, ref

from agent.explain.forms.form import Columns, Form, Point
from agent.explain.forms.mixed import Mixed, Part
from agent.explain.rows.evidence import Weighing
from agent.explain.rows.kept import Kept
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

DELAY = "measurement-delay"
"""The one effect that every other passes: its column is the twin's own torque, later or earlier."""

_PARTS_KEPT = 32  # of mixed columns: a search moves along one number at a time


def weighted_columns(scene: Scene, weighing: Weighing, form: Form, point: Point) -> Floats:
    """Return a form's weighted columns at one point, shape (m, k)."""
    if not isinstance(form.columns, Mixed):
        return weighing.weighted(_banded(scene, form.columns, point, form))
    parts = [_part(scene, weighing, form, part) for part in form.columns.parts(point)]
    return form.columns.of(parts, scene, point)


def _part(scene: Scene, weighing: Weighing, form: Form, part: Part) -> Floats:
    """Return a part of mixed columns as weighted rows, shape (m, q), or take it as it was."""
    columns, point = part
    key = columns, point, form.at_edges
    found = scene.parts.get(key)
    if found is None or found[0] is not weighing:
        while len(scene.parts) >= _PARTS_KEPT:
            del scene.parts[next(iter(scene.parts))]
        found = scene.parts[key] = weighing, Kept(_Made(ref(scene), weighing, form, part))
    return found[1].columns


@dataclass(frozen=True)
class _Made:
    """Makes a part's weighted rows for the scene that keeps them."""

    scene: ReferenceType[Scene]
    weighing: Weighing
    form: Form
    part: Part

    def __call__(self) -> Floats:
        scene = self.scene()
        if scene is None:
            raise ValueError("a scene's parts are made for that scene, and it is gone")
        return self.weighing.weighted(_banded(scene, *self.part, self.form))


def _banded(scene: Scene, columns: Columns, point: Point, form: Form) -> Floats:
    """Return columns in the band of the comparison, shape (n, k)."""
    raw = columns(scene, point)
    raw = raw if form.effect == DELAY else scene.as_late(raw)
    return scene.table.band(scene.table.where_speed_changes(raw) if form.at_edges else raw)
