"""Arms that are none of the joint's: what a recorded simulation did by itself.

A simulation that followed the command moved otherwise than the joint did, most of all around the
resonance of either loop; one that was computed from a smoothed velocity lacks what is fast. That is
in the mismatch then, and an arm that swings stands for it. But the torque that was recorded has no
such part by itself.
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library

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
