"""What is none of the joint's: what a recorded simulation did by itself.

A simulation that followed the command moved otherwise than the joint did, most of all around the
resonance of either loop; one that was computed from a smoothed velocity lacks what is fast. That is
in the mismatch then, and an arm that swings stands for it. But the torque that was recorded has no
such part by itself.

Right after starts and reversals friction that yields stands for it as well, or a place that rubs.
But either speed begins and ends with the same value, so that what the inertia asks for the way
between sums to nothing; friction that was not there does not.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.rows.in_step import least
from agent.explain.rows.table import Table
from agent.identify.result import Floats

SUMS_WITHIN_S = 0.15
"""Within which two motions of one command have the same speed again."""

_PERIODS = 5  # of the rows: no shorter
_SUMS_UP = 1.0 / 3.0  # of friction that yields: less of it in the sums is none
_SURELY = 2.0  # standard errors
_OF_THE_JOINT = 0.5  # of an arm: with less of it in its own torque, the joint has none


def is_the_simulations(library: Library, choice: Choice, index: int) -> bool:
    """Return whether an arm is in the torque of a recorded simulation, and not in the joint's.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    index : int
        Of the arm's term.
    """
    table, terms = library.scene.table, choice.candidates
    if not table.simulated:
        return False
    rest = basis_of(library.model([*terms[:index], *terms[index + 1 :]]))
    torques = np.stack((library.target, library.weighing.weighted(table.measured_nm)), axis=-1)
    arm = terms[index].columns
    torques, arm = (x - rest @ (rest.T @ x) for x in (torques, arm))
    found = basis_of(arm).T @ torques
    missing, own = found.T
    return float(own @ missing) < _OF_THE_JOINT * float(missing @ missing)


def is_another_motions(library: Library, choice: Choice, index: int) -> bool:
    """Return whether what stands for friction sums to nothing, as what an inertia asks for does.

    All that was recorded is asked, rests too: what is left out right after starts is a part of it.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    index : int
        Of a law of friction.
    """
    table, scene = library.scene.table, library.scene
    if not table.simulated:
        return False
    terms = [table.band(term.form.columns(scene, term.point)) for term in choice.candidates]
    own = np.nan_to_num(terms.pop(index))
    rest = np.nan_to_num(np.column_stack((table.base[:, table.carried], *terms)))
    target, rows = np.nan_to_num(table.target_nm), library.weighing.rows
    law = own @ least(np.column_stack((rest, own))[rows], target[rows])[-own.shape[1] :]
    sums, count = _summed(table, np.column_stack((rest, law, target)))
    basis = basis_of(sums[:, : rest.shape[1]])
    law, target = (sums[:, rest.shape[1] :] - basis @ (basis.T @ sums[:, rest.shape[1] :])).T
    energy = float(law @ law)
    if not energy > 0.0:
        return False
    share = float(law @ target) / energy
    left = target - share * law
    error = float(np.sqrt(left @ left / energy / max(count, 1.0)))
    return bool(share + _SURELY * error < _SUMS_UP)


def _summed(table: Table, columns: Floats) -> tuple[Floats, float]:
    """Return columns at the rows, shape (n, k), each row the mean of those about it.

    And how many such means there are that have no row in common.
    """
    from scipy.ndimage import uniform_filter1d

    out, count = np.empty_like(columns), 0.0
    for piece in table.pieces:
        many = max(round(SUMS_WITHIN_S / (piece.period_s * piece.stride)), _PERIODS)
        out[piece.rows] = uniform_filter1d(columns[piece.rows], many, axis=0, mode="nearest")
        count += (piece.rows.stop - piece.rows.start) / many
    return out, count
