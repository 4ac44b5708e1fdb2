"""How a drive answers the error of its velocity with torque, learnt from the recordings.

A cascaded drive makes its torque of the velocity's error, of that error's integrals, and of what it
feeds forward. Its gains are recorded nowhere, but least squares over the changes of the recorded
signals give them: what a drive asks its motor for is known from then on, up to a constant, also
where less than that came.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.physics import rigid_body

SMOOTHED_S = 0.01
"""Of the moving average that torque and velocity pass before they are compared, s."""

_CLEAR = 0.9  # quantile of the law's own errors: larger ones are rare
_STARTS = 4  # windows begun within the time of one


@dataclass(frozen=True)
class DriveAnswer:
    """What a drive asks for.

    Parameters
    ----------
    asked_nm : ndarray, shape (N,)
        The torque, up to a constant in each piece where `up_to_a_constant`; NaN where a signal is
        not known.
    error_nm : float
        By how much it, or its change over `window_s`, and the measured torque differ, seldom more.
    window_s : float
    up_to_a_constant : bool
        Whether only its changes are known.
    """

    asked_nm: Floats
    error_nm: float
    window_s: float
    up_to_a_constant: bool = True


def drive_answer(table: Table, apart: NDArray[np.bool_], window_s: float) -> DriveAnswer | None:
    """Return how a drive answers, or nothing where too little of its work was recorded.

    Least squares of the torque's changes over windows, on those of the velocity's error, its
    integral, the integral of the position's error, and the commanded velocity, its integral and its
    slope. The last three are fed forward, or make up for a channel that is late against the
    command.

    Parameters
    ----------
    table : Table
        With a command, see `has_command`.
    apart : ndarray of bool, shape (N,)
        What may be learnt from: where the torque is not at its limit.
    window_s : float
        Over which changes are compared, s.
    """
    signals = _signals(table)
    torque = boxed(table, table.full["torque_nm"])
    rows, changes = [], []
    for piece in table.pieces:
        length = max(2, round(window_s / piece.period_s))
        margin = max(1, round(SMOOTHED_S / piece.period_s))  # of an average that is cut off
        at = np.arange(
            piece.full.start + margin,
            piece.full.stop - margin - length,
            max(1, length // _STARTS),
        )
        away = np.concatenate(([0], np.cumsum(~apart[piece.full])))
        at = at[away[at - piece.full.start + length + 1] == away[at - piece.full.start]]
        rows.append(signals[at + length] - signals[at])
        changes.append(torque[at + length] - torque[at])
    moved, answered = np.concatenate(rows), np.concatenate(changes)
    known = np.isfinite(moved).all(axis=1) & np.isfinite(answered)
    moved, answered = moved[known], answered[known]
    if answered.shape[0] < 10 * moved.shape[1]:
        return None
    gains = np.linalg.lstsq(moved, answered, rcond=None)[0]
    error = float(np.quantile(np.abs(answered - moved @ gains), _CLEAR))
    return DriveAnswer(signals @ gains, error, window_s)


def simulated_answer(table: Table, apart: NDArray[np.bool_], window_s: float) -> DriveAnswer | None:
    """Return what a recorded simulation's drive asks for, or nothing where none was recorded.

    It knows no limit: at one it goes on where the recorded torque stays.

    Parameters
    ----------
    table, apart, window_s
        As for `drive_answer`.
    """
    if not table.simulated:
        return None
    asked = boxed(table, table.full["torque_simulated_nm"])
    missed = np.abs(boxed(table, table.full["torque_nm"]) - asked)[apart]
    missed = missed[np.isfinite(missed)]
    if not missed.size:
        return None
    return DriveAnswer(asked, float(np.quantile(missed, _CLEAR)), window_s, up_to_a_constant=False)


def moved_answer(table: Table, apart: NDArray[np.bool_], window_s: float) -> DriveAnswer | None:
    """Return what the motion takes of a joint as the twin has it, its numbers refitted.

    Where a reading ends and the motion goes on, it goes on, too.

    Parameters
    ----------
    table, apart, window_s
        As for `drive_answer`; no command is asked for.
    """
    if table.simulated or table.twin.effects:
        return None
    full, located = table.full, table.has("position_rad")
    every = rigid_body.regressor(
        full["position_rad"] if located else None,
        full["velocity_rad_s"],
        full["acceleration_rad_s2"],
        full["direction"],
        table.gear_ratio,
    )
    base = np.stack([boxed(table, own) for own in every[:, :5].T[table.carried]], axis=1)
    torque = boxed(table, full["torque_nm"])
    known = np.isfinite(base).all(axis=1) & np.isfinite(torque)
    learnt = np.flatnonzero(apart & known & (full["direction"] != 0.0))
    if learnt.shape[0] < 100 * base.shape[1]:
        return None
    numbers = np.linalg.lstsq(base[learnt], torque[learnt], rcond=None)[0]
    asked = base @ numbers
    error = float(np.quantile(np.abs(torque - asked)[learnt], _CLEAR))
    return DriveAnswer(asked, error, window_s, up_to_a_constant=False)


def velocity_error(table: Table) -> Floats:
    """Return commanded less measured velocity, averaged, rad/s, shape (N,)."""
    return boxed(table, _wanted(table) - table.full["velocity_rad_s"])


def has_command(table: Table) -> bool:
    """Return whether it was recorded what the motion was asked to be."""
    return any(table.has(name) for name in ("velocity_command_rad_s", "position_command_rad"))


def boxed(table: Table, values: Floats) -> Floats:
    """Return the moving average over a hundredth of a second, shape (N,)."""
    out = np.empty_like(values)
    for piece in table.pieces:
        width = min(max(1, round(SMOOTHED_S / piece.period_s)), piece.full.stop - piece.full.start)
        out[piece.full] = np.convolve(values[piece.full], np.full(width, 1.0 / width), mode="same")
    return out


def _signals(table: Table) -> Floats:
    """Return what a drive may make its torque of, shape (N, 6)."""
    wanted, error = _wanted(table), velocity_error(table)
    slope = np.empty_like(wanted)
    for piece in table.pieces:
        slope[piece.full] = np.gradient(wanted[piece.full], piece.period_s)
    travel = _integral(table, wanted)
    columns = (
        error,
        _integral(table, error),
        _integral(table, _behind(table, travel)),
        boxed(table, wanted),
        travel,
        boxed(table, slope),
    )
    return np.stack(columns, axis=1)


def _behind(table: Table, travel_rad: Floats) -> Floats:
    """Return the position's error, of each piece less its median, rad, shape (N,).

    From the commanded velocity's travel where no position was commanded; nobody knows from where.
    """
    full = table.full
    wanted = full["position_command_rad"] if table.has("position_command_rad") else travel_rad
    found = table.has("position_rad")
    behind = wanted - (full["position_rad"] if found else _integral(table, full["velocity_rad_s"]))
    for piece in table.pieces:
        behind[piece.full] -= np.median(behind[piece.full])
    return behind


def _wanted(table: Table) -> Floats:
    """Return the velocity as commanded, rad/s, shape (N,)."""
    full = table.full
    if table.has("velocity_command_rad_s"):
        return full["velocity_command_rad_s"]
    wanted = np.empty_like(full["torque_nm"])
    for piece in table.pieces:
        wanted[piece.full] = np.gradient(full["position_command_rad"][piece.full], piece.period_s)
    return wanted


def _integral(table: Table, values: Floats) -> Floats:
    """Return the integral over time from each piece's beginning, shape (N,)."""
    out = np.empty_like(values)
    for piece in table.pieces:
        out[piece.full] = np.cumsum(values[piece.full]) * piece.period_s
    return out
