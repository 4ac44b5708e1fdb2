"""How much the joint had been used: what an odometer shows that counts what was recorded."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from agent.explain.rows.pieces import Piece
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.physics.effects.motion import Recorded, path_rad

OPERATING, TURNED = "operating_s", "turned_rad"
"""Full-rate columns: seconds of recording, and the motor's path, since the first of them began."""


def recorded_use(
    runs: Sequence[Run], pieces: Sequence[Piece], full: Mapping[str, Floats]
) -> tuple[Recorded, ...]:
    """Return when each run began, how long it lasted and how far the motor went.

    Parameters
    ----------
    runs : sequence of Run
    pieces : sequence of Piece
    full : mapping of str to ndarray, shape (N,)
        With ``time_s`` and ``velocity_rad_s``. What is missing between two stretches counts as
        time, and adds nothing to the path.
    """
    path = [0.0] * len(runs)
    for piece in pieces:
        own = path_rad(full["time_s"][piece.full], full["velocity_rad_s"][piece.full])
        path[piece.run] += float(own[-1])
    return tuple(
        Recorded(run.started_s, float(run.signals.time_s[-1]), turned)
        for run, turned in zip(runs, path, strict=True)
    )


def used_elsewhere(others: Sequence[Run], runs: Sequence[Run]) -> tuple[Recorded, ...]:
    """Return what recordings that nothing is learnt from add to the use that runs began with.

    When they began, how long they lasted and how far the motor went; what is undated, or began as
    another one did, adds nothing.
    """
    began = Counter(run.started_s for run in (*runs, *others))
    return tuple(
        Recorded(each.started_s, float(each.signals.time_s[-1]), _turned_rad(each))
        for each in others
        if math.isfinite(each.started_s) and began[each.started_s] == 1
    )


def _turned_rad(run: Run) -> float:
    time, velocity = run.signals.time_s, run.signals.velocity_rad_s
    if velocity is None:
        position = run.signals.position_rad
        if position is None or time.shape[0] < 2:
            return 0.0
        velocity = np.gradient(position, time)
    return float(path_rad(time, velocity)[-1])


def use_columns(
    runs: Sequence[Run],
    pieces: Sequence[Piece],
    full: Mapping[str, Floats],
    elsewhere: Sequence[Recorded] = (),
) -> dict[str, Floats]:
    """Return `OPERATING` and `TURNED`, each shape (N,), `elsewhere` counted in.

    NaN where several runs do not all say when they began, or two began at once. In a single
    recording the time of operation is the clock's, and NaN.
    """
    use = (*recorded_use(runs, pieces, full), *elsewhere)
    operating = np.full(pieces[-1].full.stop, np.nan)
    turned = operating.copy()
    several = len(runs) > 1
    if several and not in_order(use):
        return {OPERATING: operating, TURNED: turned}
    within = [0.0] * len(runs)
    for piece in pieces:
        at, run = piece.full, piece.run
        before = before_each(use)[run] if several else Recorded(math.nan, 0.0, 0.0)
        path = path_rad(full["time_s"][at], full["velocity_rad_s"][at])
        turned[at] = before.turned_rad + within[run] + path
        within[run] += float(path[-1])
        if several:
            operating[at] = before.seconds + full["time_s"][at]
    return {OPERATING: operating, TURNED: turned}


def in_order(use: Sequence[Recorded]) -> bool:
    """Return whether it is known which of some recordings began before which."""
    began = [each.started_at_unix_s for each in use]
    return all(math.isfinite(x) for x in began) and len(set(began)) == len(began)


def before_each(use: Sequence[Recorded]) -> tuple[Recorded, ...]:
    """Return for every recording how much had been recorded when it began."""
    return tuple(
        Recorded(
            own.started_at_unix_s,
            math.fsum(x.seconds for x in use if x.started_at_unix_s < own.started_at_unix_s),
            math.fsum(x.turned_rad for x in use if x.started_at_unix_s < own.started_at_unix_s),
        )
        for own in use
    )
