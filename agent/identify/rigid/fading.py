"""Below which speed a joint's dry friction is not whole, and its rows tell no Coulomb friction.

A simulator smooths the sign of the velocity (``tanh(v / w)``, a regularised contact), and a joint
creeps before it slips. A rest in which it so creeps on has a direction and next to no friction: a
straight line through such rows has too little Coulomb friction and too much viscous, by a quarter
where a third of the time is rest.
"""

from __future__ import annotations

import numpy as np

from agent.identify.result import Floats
from agent.identify.rigid.rows import Rows
from agent.identify.signals.lowpass import lowpass
from agent.physics.rigid_body import PARAMETERS

_SCALES = tuple(float(x) for x in np.geomspace(1e-4, 3e-2, 4))  # of the fastest speed
_REFINED = (2.6, 1.6)  # factors: neighbours of the best scale, and theirs
_WHOLE = 4.0  # of tanh's scale: from there 0.07 % is missing
_WORTH = 0.03  # of what the line leaves: less bends nothing
_FADED = 0.3  # of the Coulomb level: less is a bend of friction that is there
_COULOMB, _VISCOUS = PARAMETERS.index("coulomb_nm"), PARAMETERS.index("viscous_nm_s_per_rad")


def whole_from_rad_s(rows: Rows, cutoff_hz: float) -> float:
    """Return from which speed on dry friction is whole, rad/s; 0 where it always is.

    One column takes from the Coulomb level what smoothing the sign over a speed w takes away,
    ``sign(v) (1 - tanh(|v| / w))``, filtered as all are. Where it leaves less of the torque than
    the straight line does, and takes away a good part of the level, friction is whole from 4 w on.

    Parameters
    ----------
    rows : Rows
        Of all recordings, no speed left out.
    cutoff_hz : float
        That of the low-pass which they passed.
    """
    columns = rows.columns
    fastest = float(np.max(np.abs(columns[:, _VISCOUS]), initial=0.0))
    size = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    size[size == 0.0] = 1.0
    inverse = np.linalg.pinv((columns.T @ columns) / np.outer(size, size), hermitian=True)

    def weights_of(signal: Floats) -> Floats:
        return np.asarray(inverse @ (columns.T @ signal / size) / size, dtype=np.float64)

    theta = weights_of(rows.torque_nm)
    left = rows.torque_nm - columns @ theta
    energy = float(left @ left)
    if not (fastest > 0.0 and energy > 0.0 and theta[_COULOMB] > 0.0):
        return 0.0
    found: dict[float, tuple[float, float]] = {}

    def fade(scale: float) -> tuple[float, float]:
        """Return shares: of what the line leaves that a fade explains, of the level that it is."""
        if scale not in found:
            faded = _faded(rows, cutoff_hz, scale * fastest)
            along = weights_of(faded)
            alone = faded - columns @ along
            strength = -float(alone @ left) / max(float(alone @ alone), 1e-300)
            level = float(theta[_COULOMB] + strength * along[_COULOMB])
            explained = -strength * float(alone @ left) / energy if strength > 0.0 < level else 0.0
            found[scale] = explained, strength / level if level > 0.0 else 0.0
        return found[scale]

    best = max(_SCALES, key=fade)
    if fade(best)[0] < _WORTH:
        return 0.0
    for factor in _REFINED:
        best = max((best / factor, best, best * factor), key=fade)
    return _WHOLE * best * fastest if fade(best)[1] > _FADED else 0.0


def missing_share(velocity_rad_s: Floats, speed_rad_s: float) -> Floats:
    """Return what smoothing the sign over a speed w takes of it, ``1 - tanh(|v| / w)``, (n,)."""
    return np.asarray(1.0 - np.tanh(np.minimum(np.abs(velocity_rad_s) / speed_rad_s, 20.0)))


def _faded(rows: Rows, cutoff_hz: float, speed_rad_s: float) -> Floats:
    """Return what smoothing the sign over a speed takes away of it, shape (N,), filtered."""
    out = []
    for s in rows.unfiltered:
        missing = s.direction * missing_share(s.velocity_rad_s, speed_rad_s)
        out.append(lowpass(missing, s.period_s, cutoff_hz)[s.usable])
    return np.concatenate(out)
