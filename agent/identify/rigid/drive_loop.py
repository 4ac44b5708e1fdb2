"""A drive's own controller, read from recordings that hold its set-point.

In a loop the torque is no free input: the drive makes it from set-point and measured motion.
Where a linear law of those reproduces the recorded torque, its gains are the drive's answer to a
deviation d,

    tau = k0 d + k1 dd/dt + k2 integral d,

which a simulation needs to hold a joint where the drive would have held it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.sampling import Stretch

_REPRODUCED = 0.05  # of the torque's size: a law that misses more is not the drive's
_FEWEST = 200

_Rows = tuple[Floats, Floats, tuple[int, int, int]]


@dataclass(frozen=True)
class Loop:
    """The drive's linear answer to a deviation, and how well it reproduces the recorded torque.

    Parameters
    ----------
    stiffness_nm_per_rad, damping_nm_s_per_rad, integral_nm_per_rad_s : float
        k0, k1, k2 of the module's equation.
    torque_error_percent : float
        ``100 ||y - yhat|| / ||y||`` on the recordings that it was read from.
    """

    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float
    integral_nm_per_rad_s: float
    torque_error_percent: float


def find_loop(motions: Sequence[Motion]) -> Loop | str:
    """Read the drive's controller from recordings that hold a set-point; or say why it cannot be.

    Three laws are tried, simplest first: position and velocity fed back (set-point of position);
    velocity fed back with an integral (set-point of velocity); position, velocity, feed-forward
    and an integral. The first that reproduces the torque within 5 % of its size, and opposes a
    deviation, is taken.
    """
    held = [m.signals.position_command_rad is not None for m in motions]
    asked = [m.signals.velocity_command_rad_s is not None for m in motions]
    located = all(m.signals.position_rad is not None for m in motions)
    laws = []
    if located and motions and all(held):
        laws += [_position_law, _cascade_law]
    if motions and all(asked):
        laws.insert(1 if laws else 0, _velocity_law)
    if not laws:
        return (
            "how the drive's loop answers a deviation is not known: the recordings hold no "
            "set-point; record position_command_rad or velocity_command_rad_s too"
        )
    least = math.inf
    for law in laws:
        rows = [law(m, s, v) for m in motions for s, v in pieces_of(m)]
        loop = _solve([columns for columns, _, _ in rows], [y for _, y, _ in rows], rows[0][2])
        if loop is not None and loop.torque_error_percent <= 100.0 * _REPRODUCED:
            return loop
        least = min(least, math.inf if loop is None else loop.torque_error_percent)
    missed = "" if math.isinf(least) else f" (the nearest misses {least:.0f} % of it)"
    return (
        "how the drive's loop answers a deviation is not known: no linear law of the recorded "
        f"set-point reproduces the torque{missed}"
    )


def pieces_of(motion: Motion) -> list[tuple[Stretch, Floats]]:
    """Return every stretch of a recording with its velocity on its grid."""
    return list(zip(motion.timing.stretches, motion.velocity_rad_s, strict=True))


def on_grid(motion: Motion, stretch: Stretch, values: Floats | None) -> Floats:
    """Return a column that is known to be there on a stretch's grid, shape (n,)."""
    assert values is not None  # each law is tried only where its channels are there
    return stretch.on_grid(motion.signals, values)


def _position_law(motion: Motion, stretch: Stretch, velocity: Floats) -> _Rows:
    """Return columns, torque and where k0, k1, k2 stand (-1: not at all): e, -v."""
    signals = motion.signals
    lag = on_grid(motion, stretch, signals.position_command_rad) - on_grid(
        motion, stretch, signals.position_rad
    )
    columns = np.column_stack((lag, -velocity))
    return columns, on_grid(motion, stretch, signals.torque_nm), (0, 1, -1)


def _cascade_law(motion: Motion, stretch: Stretch, velocity: Floats) -> _Rows:
    """Return the same with the set-point's velocity and the integral of the lag."""
    columns, torque, _ = _position_law(motion, stretch, velocity)
    command = on_grid(motion, stretch, motion.signals.position_command_rad)
    forward = np.gradient(command, stretch.period_s)
    summed = np.cumsum(columns[:, 0]) * stretch.period_s
    return np.column_stack((columns, forward, summed)), torque, (0, 1, 3)


def _velocity_law(motion: Motion, stretch: Stretch, velocity: Floats) -> _Rows:
    """Return the velocity's lag and its integral, which is what k0 acts on."""
    lag = on_grid(motion, stretch, motion.signals.velocity_command_rad_s) - velocity
    summed = np.cumsum(lag) * stretch.period_s
    columns = np.column_stack((lag, summed))
    return columns, on_grid(motion, stretch, motion.signals.torque_nm), (1, 0, -1)


def _solve(
    columns: Sequence[Floats], torques: Sequence[Floats], places: tuple[int, int, int]
) -> Loop | None:
    """Fit a law by least squares; None where its answer would not bring a joint back.

    Every stretch has a constant of its own: where an integral stood when it began is not known.
    """
    size_nm = float(np.linalg.norm(np.concatenate(torques)))
    rows = np.concatenate([c - c.mean(axis=0) for c in columns])
    torque = np.concatenate([y - y.mean() for y in torques])
    size = np.linalg.norm(rows, axis=0)
    if torque.size < _FEWEST or size_nm == 0.0 or np.any(size == 0.0):
        return None
    theta = np.linalg.lstsq(rows / size, torque, rcond=1e-10)[0] / size
    k0, k1, k2 = (0.0 if at < 0 else float(theta[at]) for at in places)
    if not (k0 > 0.0 and k1 > 0.0 and k2 >= 0.0):
        return None
    error_nm = float(np.linalg.norm(torque - rows @ theta))
    return Loop(k0, k1, k2, 100.0 * error_nm / size_nm)
