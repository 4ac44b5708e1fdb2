"""On a short stroke gravity is nearly a constant or a line: what else its torque may be."""

from __future__ import annotations

import numpy as np

from agent.explain.model import Model
from agent.explain.search import Library, basis_of
from agent.explain.table import BASE
from agent.physics.twin import Twin

_ALIKE = 0.98  # of the energy beside the other numbers: on a stroke of radians a cosine is none
_OTHERS = ("torque-offset", "direction-asymmetry", "cable-force")


def gravity_look_alikes(library: Library, twin: Twin, model: Model) -> tuple[str, ...]:
    """Return the effects whose columns copy the gravity that the twin does not know.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.
    model : Model
        With gravity as the recordings ask for it.
    """
    carried = library.scene.table.carried
    names = [name for name, there in zip(BASE, carried, strict=True) if there]
    gravity = [i for i, name in enumerate(names) if name.startswith("gravity")]
    if not gravity:
        return ()
    moved = np.array([model.base[names[i]].value - getattr(twin, names[i]) for i in gravity])
    rest = np.delete(library.base, gravity, axis=1)
    basis = basis_of(rest)
    torque = library.base[:, gravity] @ moved
    torque = torque - basis @ (basis.T @ torque)
    energy = float(torque @ torque)
    out: list[str] = []
    for candidate in library.candidates:
        effect = candidate.form.effect
        # One column each: a form with more would copy more, and not for its own sake.
        if effect not in _OTHERS or effect in out or len(candidate.form.linear) > 1:
            continue
        own = candidate.columns - basis @ (basis.T @ candidate.columns)
        own = basis_of(own, like=candidate.columns)
        if energy > 0.0 and float(np.sum((own.T @ torque) ** 2)) > _ALIKE * energy:
            out.append(effect)
    return tuple(out)
