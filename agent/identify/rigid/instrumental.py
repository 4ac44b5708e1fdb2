"""Instrumental variables for a joint in its closed loop.

The drive's controller turns every error of the measured velocity into torque. Regressor and
regressand of thesis (4.5) then share their noise, and plain least squares is biased however long
the recording: with a velocity gain K and in-band velocity noise of variance s^2, the viscous
parameter comes out low by about ``(K + fv) s^2 / mean(v^2)`` and more where the signal is small.
The commanded trajectory moved the joint, but knows nothing of that noise: its regressor, filtered
alike, is the instrument (Gautier, Janot and Vandanjon, IEEE Trans. Control Systems Technology 21
(2013) 428, with the set-point instead of a simulation).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.rigid.body import fit_rigid_body
from agent.identify.rigid.linear import solve_blocks, time_blocks
from agent.identify.rigid.rows import Rows, collect_rows
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import Motion, filter_motion, read_motion
from agent.physics.rigid_body import PARAMETERS

_BLOCKS = 40
_WEAKEST = 0.1  # smallest canonical correlation of instruments and columns that carries a fit


@dataclass(frozen=True)
class InstrumentalFit:
    """The rigid body with the commanded trajectory as instrument, beside plain least squares.

    Parameters
    ----------
    parameters, least_squares : mapping of str to Parameter
        By the names of `physics.rigid_body.PARAMETERS`.
    strength : float
        Smallest canonical correlation between the commanded and the measured regressor, 0 to 1.
    moved : tuple of str
        Parameters whose two values differ beyond both 95 % intervals: there the loop's noise has
        biased plain least squares.
    """

    parameters: Mapping[str, Parameter]
    least_squares: Mapping[str, Parameter]
    strength: float
    moved: tuple[str, ...]


def instrument_strength(columns: Floats, instruments: Floats) -> float:
    """Return the smallest canonical correlation of two regressors of shape (n, p), 0 to 1.

    1 where the instruments span the columns; near 0 where some combination of columns is not
    moved by any instrument, and instrumental variables would divide by next to nothing.
    """
    bases = [
        np.linalg.qr(m / np.maximum(np.abs(m).max(axis=0), 1e-300))[0]
        for m in (columns, instruments)
    ]
    return float(np.linalg.svd(bases[1].T @ bases[0], compute_uv=False)[-1])


def has_command(signals: Signals) -> bool:
    """Whether a recording holds the commanded trajectory."""
    return signals.velocity_command_rad_s is not None or signals.position_command_rad is not None


def fit_instrumental(motions: Sequence[Motion], cutoff_hz: float) -> InstrumentalFit | None:
    """Identify the rigid body with the commanded trajectory as instrument.

    Parameters
    ----------
    motions : sequence of Motion
        Recordings with `velocity_command_rad_s` or `position_command_rad`.
    cutoff_hz : float
        Of the low-pass that all columns and instruments pass alike.

    Returns
    -------
    InstrumentalFit or None
        Over the columns that the measured motion carries; None with too few rows. Where the
        command does not move some combination of columns, nothing is identified, with the reason.

    Raises
    ------
    ValueError
        A recording has no commanded trajectory.
    """
    measured, commanded = _paired_rows(motions, cutoff_hz)
    body, rigid = fit_rigid_body(measured), fit_rigid_body(measured, spring=False)
    if body is None or rigid is None:
        return None
    kept = [i for i, name in enumerate(PARAMETERS) if body.parameters[name].identified]
    columns, instruments = measured.columns[:, kept], commanded.columns[:, kept]
    if [p.value for p in rigid.parameters.values()] != [p.value for p in body.parameters.values()]:
        # The arm's spring took part in the fit, and so it does here.
        columns = np.column_stack((columns, -measured.snap_rad_s4))
        instruments = np.column_stack((instruments, -commanded.snap_rad_s4))
    strength = instrument_strength(columns, instruments)
    values = dict(body.parameters)
    if strength < _WEAKEST:
        reason = "the command does not move the joint in a way that the measured motion follows"
        for i in kept:
            values[PARAMETERS[i]] = Parameter.not_identified(reason)
        return InstrumentalFit(values, body.parameters, strength, ())
    blocks = time_blocks(measured.time_s, _BLOCKS)
    fit = solve_blocks(columns, instruments, measured.torque_nm, blocks)
    for k, i in enumerate(kept):
        low, high = fit.ci95[k].tolist()
        values[PARAMETERS[i]] = Parameter(float(fit.theta[k]), (low, high))
    moved = tuple(
        PARAMETERS[i] for i in kept if _apart(values[PARAMETERS[i]], body.parameters[PARAMETERS[i]])
    )
    return InstrumentalFit(values, body.parameters, strength, moved)


def _paired_rows(motions: Sequence[Motion], cutoff_hz: float) -> tuple[Rows, Rows]:
    """Return the measured and the commanded regressor over the rows that both can use."""
    measured, commanded, ends = [], [], []
    for motion in motions:
        own, command = _with_command(motion.signals)
        pairs = zip(
            filter_motion(read_motion(own), cutoff_hz),
            filter_motion(read_motion(command), cutoff_hz),
            strict=True,
        )
        for a, b in pairs:
            usable = a.usable & b.usable
            measured.append(replace(a, usable=usable))
            commanded.append(replace(b, usable=usable))
        position = own.position_rad
        angle = np.array([np.nan]) if position is None else position[own.valid] / own.gear_ratio
        ends.append((float(angle.min()), float(angle.max())))
    stroke_rad = max(e[1] for e in ends) - min(e[0] for e in ends)
    return collect_rows(measured, stroke_rad), collect_rows(commanded, stroke_rad)


def _with_command(signals: Signals) -> tuple[Signals, Signals]:
    """Return the recording, and the same with the commanded motion in the measured one's place."""
    velocity, position = signals.velocity_command_rad_s, signals.position_command_rad
    if velocity is None and position is None:
        raise ValueError(
            f"{signals.name}: expected velocity_command_rad_s or position_command_rad, "
            "found neither"
        )
    valid = signals.valid.copy()
    for command in (velocity, position):
        if command is not None:
            valid &= np.isfinite(command)
    if position is None and velocity is not None and signals.position_rad is not None:
        step = np.diff(signals.time_s, prepend=signals.time_s[0])
        way = np.cumsum(np.where(np.isfinite(velocity), velocity, 0.0) * step)
        # The drive may lose or gain a little way: the command's drift is not the arm's.
        first = int(np.argmax(valid))
        position = way - way[first] + signals.position_rad[first]
    if signals.position_rad is None:
        position = None if velocity is not None else position
    own = replace(signals, valid=valid)
    return own, replace(own, velocity_rad_s=velocity, position_rad=position)


def _apart(one: Parameter, other: Parameter) -> bool:
    """Whether two intervals do not touch."""
    if one.ci95 is None or other.ci95 is None:
        return False
    return one.ci95[0] > other.ci95[1] or one.ci95[1] < other.ci95[0]
