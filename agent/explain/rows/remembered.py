"""A state with a memory along every recording, through its gaps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby, pairwise

import numpy as np

from agent.explain.rows.pieces import Piece
from agent.identify.result import Floats
from agent.physics.beginnings import drawn_at_first
from agent.physics.presliding import across_gaps

State = Callable[[Floats, Floats, Floats, float], Floats]


def remembered(
    full: Mapping[str, Floats],
    pieces: Sequence[Piece],
    state: State,
    level: Floats | None = None,
) -> Floats:
    """Return a state along the motion of every recording, shape (N,).

    Parameters
    ----------
    full : mapping of str to ndarray, shape (N,)
        As the table has it; a position that is not known is NaN.
    pieces : sequence of Piece
    state : callable
        Time, velocity and level, each shape (n,), and how far the springs are drawn out at first to
        the state, (n,).
    level : ndarray, shape (N,), optional
        What the state tends to; 1 where it is not given.
    """
    level = np.ones(full["direction"].shape[0]) if level is None else level
    out = np.zeros(full["direction"].shape[0])
    located = bool(np.isfinite(full["position_rad"]).all())
    for _, run in groupby(pieces, key=lambda piece: piece.run):
        places = [piece.full for piece in run]
        time, velocity, where = across_gaps(
            [
                (
                    full["time_s"][at],
                    full["velocity_rad_s"][at],
                    full["position_rad"][at] if located else None,
                )
                for at in places
            ]
        )
        first = places[0]
        start = drawn_at_first(full["velocity_raw_rad_s"][first], full["direction"][first])
        tends_to = np.concatenate(_halfway([level[at] for at in places]))
        found = state(time, velocity, tends_to, start)
        for at, own in zip(places, where, strict=True):
            out[at] = found[own]
    return out


def _halfway(stretches: Sequence[Floats]) -> list[Floats]:
    """Return values of stretches with one in the middle of every gap, as `across_gaps` has them."""
    out = [stretches[0]]
    for before, after in pairwise(stretches):
        out += [np.array([0.5 * (before[-1] + after[0])]), after]
    return out
