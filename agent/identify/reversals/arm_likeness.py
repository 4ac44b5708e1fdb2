"""Whether what a simulated arm leaves at one reversal is like what it leaves at another.

Noise of the torque and the encoders' steps know nothing of each other at two reversals; a gear that
is not like the simulated one errs alike at all of them. Aligned at their turns, what is left of two
reversals of one direction is multiplied and summed. Without likeness every such sum is as often
below zero as above, whatever the noise's colour, so that their total has a variance that is known:
the sum of their squares (a test by exchange of signs; Fisher 1935).
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from agent.identify.result import Floats
from agent.identify.reversals.arm_elimination import ARM, TORQUE, Reduced
from agent.identify.reversals.arm_record import ArmRecord

_LEAST = 6  # pairs of reversals: fewer have no variance to speak of
_ABOUT = 50  # samples after a turn over which its direction is read


def likeness(records: list[ArmRecord], parts: list[Reduced]) -> float:
    """Return the likeness of what is left at different reversals, in standard errors.

    Parameters
    ----------
    records, parts : list of ArmRecord, list of Reduced
        What was fitted, and what is left of it.

    Returns
    -------
    float
        About 0 with standard deviation 1 where noise is left; infinite where too few reversals go
        the same way to tell.
    """
    products = np.concatenate([_products(r, p) for r, p in zip(records, parts, strict=True)])
    if products.size < _LEAST:
        return math.inf
    return float(products.sum() / max(float(np.linalg.norm(products)), 1e-300))


def _products(record: ArmRecord, part: Reduced) -> Floats:
    """Return the products of every two reversals of one direction, as long as the shortest."""
    length = min((b - a for a, b in itertools.pairwise(record.places)), default=0)
    left = np.stack((part.left(TORQUE), part.left(ARM)))
    turns = [a for a in record.places if length > 0 and a + length <= record.size]
    way = [float(np.sign(record.way[a : a + _ABOUT].sum())) for a in turns]
    rows = [left[:, a : a + length].ravel() for a in turns]
    pairs = itertools.combinations(range(len(turns)), 2)
    return np.array([rows[i] @ rows[j] for i, j in pairs if way[i] == way[j]], dtype=np.float64)
