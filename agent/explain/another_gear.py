"""Whether the weight of a simulation's arm goes as it does behind another gear.

A gear ratio that is wrong in a cell's file is wrong in its recordings and in the twin alike: arm
angles are off by it, and gravity's sine is another one. The simulation's own weight, at the angles
of the right gear, leaves what laws leave that follow the arm's angle otherwise; and it needs no
number for that but the ratio. A payload is commoner than a wrong ratio: where a weight of another
size or phase does nearly as well, nothing is said of the gear.
"""

from __future__ import annotations

import numpy as np

from agent.explain.rows.refit import carried_by
from agent.explain.rows.table import BASE, Table
from agent.explain.study import Study
from agent.identify.result import Floats
from agent.numbers import significant
from agent.physics.rigid_body import GRAVITY, gravity_columns

_FARTHEST, _STEPS = 2.5, 61  # of the ratio, either way
_ANOTHER = 0.03  # of the ratio: so close it is the same gear
_AS_WELL = 1.1  # of the mean square that all findings leave
_LITTLE = 0.2  # of what any payload leaves above the noise


def behind_another_gear(found: Study) -> str:
    """Return that the arm's weight goes by another gear ratio, and by which; nothing where not.

    Parameters
    ----------
    found : Study
        What is told.
    """
    table, twin = found.table, found.twin
    weighs = bool(twin.gravity_sin_nm or twin.gravity_cos_nm)
    named = found.choice.terms or any(n.effect == "gravity-imbalance" for n in found.numbers)
    if table.simulated or not (weighs and named and table.has("position_rad")):
        return ""
    ratio, left_nm2, loaded_nm2 = _best_ratio(table)
    extended_nm2 = float(np.mean(found.model.residual_nm**2))
    noise_nm2 = min(max(found.floor.value_nm, 0.0) ** 2, left_nm2, extended_nm2)
    little = left_nm2 - noise_nm2 < _LITTLE * (loaded_nm2 - noise_nm2)
    if abs(ratio - 1.0) < _ANOTHER or left_nm2 > _AS_WELL * extended_nm2 or not little:
        return ""
    told, given = (significant(n, 3) for n in (table.gear_ratio / ratio, table.gear_ratio))
    return (
        f"The arm's weight, as the simulation has it, goes as behind a gear of {told} to one, and "
        f"not of {given}: with that alone no more is left than with all that is named here. Before "
        "anything else make sure of the gear ratio, in the recordings and in the twin."
    )


def _best_ratio(table: Table) -> tuple[float, float, float]:
    """Return how many times as far the arm turns as recorded, and two mean squares, N m2.

    What is left so, and what the weight of any load leaves where it turns as recorded.
    """
    from scipy.optimize import minimize_scalar

    weight = [BASE.index(name) for name in GRAVITY]
    numbers = np.array([getattr(table.twin, name) for name in BASE])
    others = np.flatnonzero(table.carried & ~np.isin(np.arange(len(BASE)), weight))
    rows = table.used
    own = table.base[np.ix_(rows, others)]
    # All but the weight: what the twin's own effects add is known.
    known = table.given_nm - table.base @ numbers
    target = (table.measured_nm - known)[rows]
    position = table.full["position_rad"]

    def left_nm2(times: float) -> float:
        turned = gravity_columns(times * position, table.gear_ratio) @ numbers[weight]
        rest: Floats = target - table.band(turned)[rows]
        return _left_nm2(own, rest)

    loaded = table.base[np.ix_(rows, np.concatenate((others, weight)))]
    tried = np.geomspace(1.0 / _FARTHEST, _FARTHEST, _STEPS)
    best = int(np.argmin([left_nm2(float(times)) for times in tried]))
    near = tried[max(best - 1, 0)], tried[min(best + 1, _STEPS - 1)]
    found = minimize_scalar(left_nm2, bounds=near, method="bounded", options={"xatol": 1e-4})
    return float(found.x), float(found.fun), _left_nm2(loaded, target)


def _left_nm2(columns: Floats, target: Floats) -> float:
    """Return the mean square that columns, shape (m, k), leave of a torque."""
    return float(np.mean((target - carried_by(columns, target)) ** 2))
