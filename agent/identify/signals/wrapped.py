"""Positions that begin anew with every turn, as a resolver's do that nobody counts on."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from agent.identify.signals.arrays import Signals

_JUMPS = 0.8  # of the greatest step: the steps that begin anew, one as large as the other
_STANDS_OUT = 4.0  # times any other step
_ONE_TURN = 1.1  # of a jump: all of the range there is
_AS_A_TURN = 0.1  # of a turn: a jump is a turn less what the joint moved meanwhile


def counted_on(signals: Signals) -> tuple[Signals, int]:
    """Return a recording whose position goes on where it began anew, and how often it did.

    Of a motor's turn or of the arm's. As it is where nothing jumps so.

    Parameters
    ----------
    signals : Signals
    """
    position = signals.position_rad
    if position is None:
        return signals, 0
    known = np.flatnonzero(np.isfinite(position))
    steps = np.diff(position[known])
    greatest = float(np.abs(steps).max(initial=0.0))
    jumps = np.abs(steps) > _JUMPS * greatest
    if (jumps[1:] & jumps[:-1]).any():  # there and back at once: a row that stands alone
        return signals, 0
    count = int(np.count_nonzero(jumps))
    usual = float(np.abs(steps[~jumps]).max(initial=0.0))
    ranges = float(np.ptp(position[known])) if known.size else 0.0
    turn = _turn_rad(greatest, signals.gear_ratio)
    if count < 2 or not turn or greatest < _STANDS_OUT * usual or ranges > _ONE_TURN * greatest:
        return signals, 0
    turns = np.zeros_like(position)
    turns[known[1:]] = np.cumsum(np.where(jumps, -np.sign(steps), 0.0))
    return replace(signals, position_rad=position + turn * turns), count


def wrapped_of(count: int, gear_ratio: float) -> str:
    """Return what is said of it.

    Parameters
    ----------
    count : int
        How often positions began anew.
    gear_ratio : float
        Motor turns per arm turn.
    """
    where = (
        ""
        if gear_ratio == 1.0
        else (
            "; where the arm stands is known but for whole turns of the motor, so that weight and "
            "places along the arm may be off: record a position that counts its turns"
        )
    )
    return f"the position begins anew with every turn, {count} times: it was counted on{where}"


def _turn_rad(jump_rad: float, gear_ratio: float) -> float:
    """Return the turn that a jump is; 0 where it is none."""
    turns = (2.0 * math.pi, 2.0 * math.pi * gear_ratio)
    return next((t for t in turns if abs(jump_rad / t - 1.0) < _AS_A_TURN), 0.0)
