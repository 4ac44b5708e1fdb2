"""Whether a drive's torque is in step with its position, or with a velocity that comes later."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.orders import orders_of
from agent.explain.rows.run import CORNERS
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass
from agent.physics.periodic import wave_rates

if TYPE_CHECKING:
    from agent.explain.rows.table import Table

_HALF = 0.5  # of the step between velocity and position, or its inverse: no longer that step
_SLOWLY = 0.2  # of the band: the driven corners are in it, noise and ripple of the velocity are not
_CORNERS_HZ = 5.0  # below it are corners: a band that is no wider holds little else
_ORDERS = 3
_TOLD = 0.02  # of the most that corners were put right by


def in_step(plain: Table, aligned: Table) -> bool:
    """Return whether the torque is in step with the position, and not with the velocity.

    How much of the step between the two the torque asks for, beside the plain structure: about all
    of it where it is with the position. Torque that asks for far more is late or early by itself,
    which is for the explanation to find, and tells nothing about this step. A fit to this one
    direction, because a large mismatch of another kind stays in both tables and would hide by its
    size what a fraction of a millisecond does at the corners. Friction that is free along the
    speed, the acceleration and the travel since a reversal, a free torque along the position and
    waves of the strongest orders stand beside it, so that what is missing of these does not decide:
    friction under load, and friction that yields, act at corners, too, and the loop turns a wave of
    the torque into one of the velocity. The step itself is jerk, mostly noise: its slow part is the
    instrument (Young, Automatica 17 (1981) 53), or noise would always say no. Where the torque has
    told on which side of a corner a sample is, it is in step with either.

    Parameters
    ----------
    plain, aligned : Table
        With the velocity as it was reported, and in step with the position.
    """
    rows = plain.sliding & aligned.sliding & ~_beside_corners(plain)
    if not rows.any():
        return False
    free, target = _free(plain, rows), plain.target_nm[rows]
    numbers = least(free, target)
    free = np.concatenate((free, _waves(plain, rows, target - free @ numbers)), axis=1)
    moved = least(free, target)[: plain.base.shape[1]]
    step = (aligned.given_nm - plain.given_nm) + (aligned.base - plain.base) @ moved
    slow = np.zeros_like(step)
    for piece in plain.pieces:
        own = np.where(np.isfinite(step[piece.rows]), step[piece.rows], 0.0)
        period_s = piece.period_s * piece.stride
        slowly_hz = min(max(_SLOWLY * piece.cutoff_hz, _CORNERS_HZ), piece.cutoff_hz)
        slow[piece.rows] = lowpass(own, period_s, slowly_hz)
    instrument = slow[rows] - free @ least(free, slow[rows])
    answers = float(instrument @ step[rows])
    asked = float(instrument @ (target - free @ least(free, target))) / answers if answers else 0.0
    return _HALF < asked < 1.0 / _HALF


def _beside_corners(table: Table) -> NDArray[np.bool_]:
    """Return the rows, shape (n,), of whose acceleration the torque has told the side."""
    share = table.band(np.abs(table.full[CORNERS])[:, np.newaxis])[:, 0]
    return np.asarray(share > _TOLD * float(np.max(share, initial=0.0)))


def _free(table: Table, rows: NDArray[np.bool_]) -> Floats:
    """Return the plain structure, friction free along three axes, and a free torque, (m, p)."""
    velocity = table.rows["velocity_rad_s"][rows]
    load = np.abs(table.base[rows, 0])
    along = (np.abs(velocity), load, table.rows["travel_rad"][rows])
    sign = np.sign(velocity)[:, np.newaxis]
    free = [table.base[rows], *(sign * hats(axis) for axis in along)]
    if table.has("position_rad"):
        free.append(hats(table.rows["position_rad"][rows]))
    return np.concatenate(free, axis=1)


def _waves(table: Table, rows: NDArray[np.bool_], left_nm: Floats) -> Floats:
    """Return waves of the orders that stand out in what is left of some rows, shape (m, k).

    Of the torque, and of the acceleration, in whose step with the torque they would meddle.
    """
    if not table.has("position_rad"):
        return np.zeros((left_nm.shape[0], 0))
    position, velocity = (table.rows[name][rows] for name in ("position_rad", "velocity_rad_s"))
    speed = np.abs(velocity)
    weight = (velocity / max(float(np.quantile(speed, 0.99)), 1e-12)) ** 2
    fastest = 0.5 * table.cutoff_hz * 2.0 * np.pi / max(float(np.quantile(speed, 0.01)), 1e-12)
    orders = orders_of(
        position, left_nm, weight, fastest, table.gear_ratio, _ORDERS, repeating=False
    )
    full = table.full
    out = []
    for order in orders:
        angle = order * full["position_rad"]
        waves = np.cos(angle), np.sin(angle)
        rates = wave_rates(order, *waves, full["velocity_rad_s"], full["acceleration_rad_s2"])
        for wave, rate in zip(waves, rates, strict=True):
            out += [wave, rate]
    return table.band(np.stack(out, axis=-1))[rows] if out else np.zeros((left_nm.shape[0], 0))


def least(columns: Floats, target: Floats) -> Floats:
    """Return the least-squares coefficients, shape (p,); 0 for a column that is nothing."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    there = size > 1e-12
    out = np.zeros(columns.shape[1])
    scaled = columns[:, there] / size[there]
    out[there] = np.linalg.lstsq(scaled, target, rcond=1e-9)[0] / size[there]
    return out


def hats(values: Floats, count: int = 8) -> Floats:
    """Return hat functions over an axis's quantiles, shape (n, k)."""
    if not values.size:
        return np.zeros((0, 0))
    return hats_at(values, np.unique(np.quantile(values, np.linspace(0.0, 1.0, count))))


def hats_at(values: Floats, knots: Floats) -> Floats:
    """Return hat functions over some knots, shape (n, k): beyond them the last ones go on."""
    return np.stack([np.interp(values, knots, row) for row in np.eye(knots.size)], axis=-1)
