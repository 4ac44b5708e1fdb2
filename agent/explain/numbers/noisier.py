"""A library behind a motion that is noisier than the measured one by as much noise as it has."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from agent.explain.choosing.search import Library
from agent.explain.rows.motion_noise import drawn_noise_rad_s
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE
from agent.identify.result import Floats

_INERTIA = BASE.index("inertia_kg_m2")


@dataclass(frozen=True)
class Noisier:
    """A noisier motion's library, and what the noise adds to the inertia's column, shape (m,)."""

    library: Library
    inertia_noise: Floats


def noisier(library: Library) -> tuple[Noisier, ...]:
    """Return two of them, of the same noise with either sign.

    Parameters
    ----------
    library : Library
    """
    noise = drawn_noise_rad_s(library.scene.table, np.random.default_rng(0))
    return tuple(_behind(library, sign * noise) for sign in (1.0, -1.0))


def inertia_at(library: Library) -> int:
    """Return where the inertia's column stands in a model; -1 where it is not excited."""
    carried = library.scene.table.carried
    return int(np.count_nonzero(carried[:_INERTIA])) if carried[_INERTIA] else -1


def _behind(library: Library, noise_rad_s: Floats) -> Noisier:
    scene = library.scene
    other = _moved_by(scene, noise_rad_s)
    added = scene.as_late(other.stiff_rad_s2 - scene.stiff_rad_s2)
    of_inertia = library.weighing.weighted(scene.table.band(added))
    return Noisier(replace(library, scene=other, known={}), of_inertia)


def _moved_by(scene: Scene, noise_rad_s: Floats) -> Scene:
    full = dict(scene.table.full)
    full["velocity_raw_rad_s"] = full["velocity_raw_rad_s"] + noise_rad_s
    return replace(scene, table=replace(scene.table, full=full))
