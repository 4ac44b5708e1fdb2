"""All of the torque that grows with the gearbox's warmth: what warm magnets do, unseen.

Where the motor's temperature was not recorded, a torque constant that falls with it cannot be
judged. But motor and gearbox are warm together as a rule, and the gearbox's temperature may show
what the motor's would tell.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.materiality import CLOSE
from agent.explain.study import Study
from agent.numbers import significant

_MOTOR, _GEARBOX = "motor_temperature_degc", "gearbox_temperature_degc"
_CARRIES = 0.5  # of what is left above the noise
_LEAST, _MOST = 2e-4, 4e-3  # per kelvin: magnets lose 0.03 to 0.2 %


def warm_magnets_said(found: Study) -> str:
    """Return that all of the torque grows with the gearbox's warmth; nothing where it does not.

    Parameters
    ----------
    found : Study
    """
    scene, table, rows = found.library.scene, found.table, found.library.weighing.rows
    floor_nm = found.floor.value_nm
    if scene.has(_MOTOR) or not scene.has(_GEARBOX) or not floor_nm > 0.0:
        return ""
    if found.left.ratio <= CLOSE:
        return ""
    left_nm, warmth = found.model.residual_nm, table.rows[_GEARBOX][rows]
    column = (table.measured_nm[rows] - left_nm) * (warmth - float(np.mean(warmth)))
    basis = basis_of(table.base[rows][:, table.carried])
    own, target = (x - basis @ (basis.T @ x) for x in (column, left_nm))
    energy = float(own @ own)
    above = float(target @ target) - rows.shape[0] * floor_nm**2
    if not (energy > 0.0 and above > 0.0):
        return ""
    per_k = float(own @ target) / energy
    if per_k**2 * energy < _CARRIES * above or not _LEAST < per_k < _MOST:
        return ""
    return (
        f"all of the torque grows by {significant(100.0 * per_k, 2)} % for every kelvin of the "
        f"gearbox, which would carry {round(100.0 * min(per_k**2 * energy / above, 1.0))} % of "
        "what is left: a torque constant that falls as the magnets warm does that, and the motor's "
        "temperature, which would tell, was not recorded"
    )
