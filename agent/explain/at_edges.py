"""What happens right after a start or a reversal, where nothing is compared, is said to be so."""

from __future__ import annotations

import math

import numpy as np

from agent.explain.answer.amounts import percent, torque
from agent.explain.answer.fits import Edges
from agent.explain.numbers.model import left_by
from agent.explain.rows.strata import EDGE, EDGE_ARM_RAD
from agent.explain.study import Study

_YIELDS = "presliding-hysteresis"
_MUCH = 0.5  # of Coulomb friction: a sign that turns round within the filter's memory leaves less
_LEAST_SHARE = 0.015  # of the motion


def edges_of(found: Study) -> Edges | None:
    """Return how far off the simulation is where friction is not there at once; None where not.

    Contacts that yield within less than an edge are over before anything is compared: no law of
    them can be told, nor that there is none.

    Parameters
    ----------
    found : Study
    """
    table, coulomb_nm = found.table, found.extended.coulomb_nm
    if any(term.scored.form.effect == _YIELDS for term in found.choice.terms):
        return None
    left = left_by(found.extended, table)
    edges = (table.stratum == EDGE) & (table.rows["direction"] != 0.0) & np.isfinite(left)
    share = float(np.mean(edges[edges | table.used])) if edges.any() else 0.0
    if share < _LEAST_SHARE:
        return None
    rms_nm = math.sqrt(float(np.mean(left[edges] ** 2)))
    if coulomb_nm <= 0.0 or rms_nm < _MUCH * coulomb_nm:
        return None
    return Edges(share, rms_nm)


def edges_said(edges: Edges | None) -> str:
    """Return that what happens in the edges is not compared; nothing where nothing is off there."""
    if edges is None:
        return ""
    return (
        f"right after starts and reversals, for the first {1e3 * EDGE_ARM_RAD:.1f} mrad of the arm "
        f"({percent(edges.share)} of the motion), nothing is compared: friction is not all there "
        f"at once (off by {torque(edges.rms_nm)} rms), and contacts that yield no further are not "
        "judged"
    )
