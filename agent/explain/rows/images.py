"""Where samples show the image of a wave: it passes about as often as torque was recorded.

A search takes such a wave for none (`agent.physics.periodic.followed`), as the motor's torque holds
next to nothing of what is that fast. A loop nearly as fast as the recording holds a part of it, and
that part's samples are a slow wave in the band. No law describes it from samples: such rows are
left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.table import Table
from agent.physics.twin import Twin

_REACH = 1.5  # of the band's edge: what the filter passes, and what the speed changes meanwhile


def orders_in(twin: Twin) -> tuple[float, ...]:
    """Return the orders per motor turn of the waves in a twin."""
    per_turn = {"order_per_motor_rev": 1.0, "order_per_arm_rev": twin.gear_ratio}
    orders = (
        effect.parameters[name] / turns
        for effect in twin.effects
        for name, turns in per_turn.items()
        if name in effect.parameters
    )
    return tuple(sorted(set(orders)))


def imaged(table: Table, orders: Sequence[float]) -> NDArray[np.bool_]:
    """Return which rows show the image of a wave in the band, shape (n,).

    Parameters
    ----------
    table : Table
    orders : sequence of float
        Per motor turn.
    """
    out = np.zeros(table.used.shape[0], dtype=np.bool_)
    for piece in table.pieces:
        speed = np.abs(table.rows["velocity_rad_s"][piece.rows])
        for order in orders:
            passes = order * speed / (2.0 * math.pi) * piece.period_s  # a sample
            off_hz = np.abs(passes - np.round(passes)) / piece.period_s
            out[piece.rows] |= (passes >= 0.5) & (off_hz < _REACH * piece.cutoff_hz)
    return out


def without_images(table: Table, orders: Sequence[float]) -> Table:
    """Return a table that leaves out where samples show the image of a wave.

    Parameters
    ----------
    table : Table
    orders : sequence of float
        Per motor turn.
    """
    if not orders:
        return table
    used = table.used & ~imaged(table, orders)
    return replace(table, used=used, imaged_orders=tuple(orders))
