"""Positions that begin anew with every turn, as a resolver's do that nobody counts on."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from agent.identify.signals.arrays import Signals

_JUMPS = 0.8  # of the greatest step: the steps that begin anew, one as large as the other
_STANDS_OUT = 4.0  # times any other step
_ONE_TURN = 1.1  # of a jump: all of the range there is
_AS_A_TURN = 0.1  # of a turn: a jump is a turn less what the joint moved meanwhile


class Counted(NamedTuple):
    """A recording whose position goes on where it began anew.

    Parameters
    ----------
    signals : Signals
    times : int
        How often it had begun anew; 0 where nothing jumps so, and all is as it was.
    loses_the_arm : bool
        Whether it was the motor's turn that it began anew with, behind a gear: then the arm may
        stand whole turns of the motor elsewhere.
    """

    signals: Signals
    times: int
    loses_the_arm: bool

    @property
    def said(self) -> str:
        """Return what is to be said of it; nothing where nothing jumped."""
        if not self.times:
            return ""
        where = (
            "; where the arm stands is known but for whole turns of the motor, so that weight and "
            "places along the arm may be off: record a position that counts its turns"
        )
        return (
            f"the position begins anew with every turn, {self.times} times: it was counted on"
            f"{where if self.loses_the_arm else ''}"
        )


def counted_on(signals: Signals) -> Counted:
    """Return a recording whose position goes on where it began anew, of either's turn.

    Parameters
    ----------
    signals : Signals
    """
    as_it_is = Counted(signals, 0, loses_the_arm=False)
    position = signals.position_rad
    if position is None:
        return as_it_is
    known = np.flatnonzero(np.isfinite(position))
    steps = np.diff(position[known])
    greatest = float(np.abs(steps).max(initial=0.0))
    jumps = np.abs(steps) > _JUMPS * greatest
    if (jumps[1:] & jumps[:-1]).any():  # there and back at once: a row that stands alone
        return as_it_is
    count = int(np.count_nonzero(jumps))
    usual = float(np.abs(steps[~jumps]).max(initial=0.0))
    ranges = float(np.ptp(position[known])) if known.size else 0.0
    turn = _turn_rad(greatest, signals.gear_ratio)
    if count < 2 or not turn or greatest < _STANDS_OUT * usual or ranges > _ONE_TURN * greatest:
        return as_it_is
    turns = np.zeros_like(position)
    turns[known[1:]] = np.cumsum(np.where(jumps, -np.sign(steps), 0.0))
    whole = replace(signals, position_rad=position + turn * turns)
    return Counted(whole, count, loses_the_arm=turn < _turn_of_arm_rad(signals.gear_ratio))


def _turn_of_arm_rad(gear_ratio: float) -> float:
    return 2.0 * math.pi * gear_ratio


def _turn_rad(jump_rad: float, gear_ratio: float) -> float:
    """Return the turn that a jump is; 0 where it is none."""
    turns = (2.0 * math.pi, _turn_of_arm_rad(gear_ratio))
    return next((t for t in turns if abs(jump_rad / t - 1.0) < _AS_A_TURN), 0.0)
