"""Recordings held out of another kind than those that were learnt from: another load, another day.

What was learnt may be right and yet predict them badly. Which of the twin's own numbers they ask
for otherwise is then worth more than the error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from agent.explain.answer.amounts import percent, torque
from agent.explain.proof import Compared
from agent.explain.rows.refit import carried_by
from agent.explain.rows.run import Run
from agent.explain.rows.table import BASE
from agent.identify.rigid.alike import mixed_units
from agent.identify.signals.preprocess import read_motion

_FAR = 3.0  # times the noise, and what the recordings to learn from leave
_MORE = 1.25  # times that: noise is as loud in all of them
_OWN = 0.75  # of the energy is what other numbers account for
_KINDS = (
    (
        ("inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm"),
        "another inertia and gravity",
        "the arm carries something else: state payload_kg, or hold out one with the same load",
    ),
    (
        ("coulomb_nm", "viscous_nm_s_per_rad"),
        "another friction",
        "the joint is warmer, colder or worn: hold out one of the same state",
    ),
)


def held_out_apart(
    compared: Compared,
    learnt_rmse_nm: float,
    floor_nm: float,
    runs: Sequence[Run],
    holdout: Sequence[Run],
) -> str:
    """Return that what was held out leaves more, and which of the twin's numbers it asks for.

    Nothing where it leaves as much as what was learnt from.

    Parameters
    ----------
    compared : Compared
        With the hold-out's columns of the plain twin.
    learnt_rmse_nm : float
        What the extended twin leaves of the recordings to learn from.
    floor_nm : float
        Their noise; NaN or 0 where it is not known.
    runs, holdout : sequence of Run
        To learn from, and held out.
    """
    left, columns = compared.extended, compared.base
    energy = float(left @ left)
    usual = max(learnt_rmse_nm, floor_nm if floor_nm > 0.0 else 0.0)
    times = math.sqrt(energy / left.shape[0]) / usual if usual > 0.0 else 0.0
    if times <= _MORE:
        return ""
    more = (
        f"what was held out leaves {times:.1f} times as much as the recordings to learn from: it "
        "shows something that they hardly do; explain it among them"
    )
    if columns is None or times <= _FAR:
        return more
    units = mixed_units([read_motion(run.signals) for run in (*runs, *holdout)])
    if units:
        return units
    for names, other, where in _KINDS:
        moved = carried_by(columns[:, [BASE.index(name) for name in names]], left)
        share = 1.0 - float((left - moved) @ (left - moved)) / energy
        if share > _OWN:
            rms = torque(math.sqrt(float(moved @ moved) / moved.shape[0]))
            return (
                f"what was held out asks for {other} than the recordings to learn from ({rms} rms, "
                f"{percent(share)} of what is left of it), as where {where}"
            )
    return more
