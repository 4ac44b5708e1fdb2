"""What a twin's own effects explain: what stays beside them is measured against that.

A law found is never the joint's to the last digit. What it left was too little to be named beside
it, and must not become a mismatch when the twin that was written is explained again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.choosing.materiality import FAR, MATERIAL
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import predicted
from agent.explain.rows.floor import noise_floor
from agent.explain.rows.refit import refit
from agent.physics.twin import Twin


def least_beside_effects(library: Library, twin: Twin) -> float:
    """Return the least weighted squared error that a law must remove beside a twin's effects.

    As beside them in the explanation that found them; 0 where a twin has none, or leaves far more
    than noise: that nobody has left on purpose.

    Parameters
    ----------
    library : Library
    twin : Twin
        As given.
    """
    table, weighing = library.scene.table, library.weighing
    if not twin.effects or table.simulated:
        return 0.0
    left = np.zeros(table.used.shape[0])
    left[weighing.rows] = library.residual([]) / weighing.weight
    floor_nm = noise_floor(table, left).value_nm
    if not float(np.mean(left[weighing.rows] ** 2)) <= (FAR * floor_nm) ** 2:
        return 0.0
    effects_nm = table.given_nm - predicted(table, replace(twin, effects=()))
    bare = refit(table, -effects_nm)[1][weighing.rows] * weighing.weight
    return MATERIAL * float(bare @ bare)
