"""By how much an effect and the simulation as given differ, where the effect is at work."""

from __future__ import annotations

import numpy as np

from agent.explain.answer.names import FOLLOWS_DIRECTION, FOLLOWS_TORQUE
from agent.explain.answer.result import Region
from agent.explain.choosing.candidate import basis_of
from agent.explain.location.regions import AXIS, axis_values
from agent.explain.study import Study
from agent.identify.result import Floats


def reach_of(
    study: Study, effect: str, added: Floats, where: tuple[Region, ...]
) -> tuple[float, float]:
    """Return by how much an effect and the twin as given differ, least and greatest.

    In the effect's first region, along the motion where it brakes, and along the torque where that
    is misread. What the twin's own numbers had
    taken over of the effect, when they were fitted without it, is no difference to the simulation.
    """
    library = study.library
    rows, weight = library.weighing.rows, library.weighing.weight
    basis = basis_of(library.base)
    weighted = added * weight
    copied = basis @ (basis.T @ weighted)
    net = (weighted - _taken_over(study, basis) * copied) / weight
    if effect in FOLLOWS_DIRECTION:
        net = net * np.sign(study.table.rows["velocity_rad_s"][rows])
    if effect in FOLLOWS_TORQUE:
        net = net * np.sign(study.table.measured_nm[rows])
    if where and where[0].variable == AXIS[effect] and not AXIS[effect].startswith("order_"):
        values = axis_values(library.scene, AXIS[effect])[rows]
        inside = (values >= where[0].lower) & (values <= where[0].upper)
        net = net[inside] if inside.any() else net
    low, high = np.quantile(net, [0.005, 0.995])
    return float(low), float(high)


def _taken_over(study: Study, basis: Floats) -> float:
    """Return how far the twin's numbers are on the way from the extended to the refitted ones.

    One for a twin that was fitted without the missing physics, zero for one whose own numbers are
    right.
    """
    library, width = study.library, study.library.base.shape[1]
    extended = library.base @ study.model.coefficients[:width]
    way = extended - basis @ (basis.T @ library.target)
    length = float(way @ way)
    return min(max(float(extended @ way) / length, 0.0), 1.0) if length > 0.0 else 0.0
