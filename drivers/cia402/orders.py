"""What goes out in one tick: controlword and set-point, as the mode of operation wants them.

Nothing here judges: what may be sent has passed the gate. A set-point that is no number never
reaches `post`; while the drive does not follow, each kind says what leaves it where it is.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from typing import Protocol

from drivers.cia402.config import Cia402Config
from drivers.cia402.modes import Rung
from drivers.cia402.pdo import PdoMap
from drivers.cia402.words import Controlword, Mode, State
from drivers.ports import Command, Goal, Move, MoveProgress, MoveState, SetPoints

NEW_SET_POINT = 0x0010
"""Controlword bit 4 in pp: take the set-point over. Its rising edge counts."""

ACKNOWLEDGED = 0x1000
"""Statusword bit 12 in pp: the set-point has been taken over."""

TARGET_REACHED = 0x0400

Post = Callable[[int, bytes], None]


class Orders(Protocol):
    """The orders of one mode."""

    def check(self, command: Command) -> None:
        """Refuse a command whose set-point is no number, or beyond the drive's integers.

        Raises
        ------
        ValueError
            Saying which.
        """
        ...

    def post(self, post: Post, word: int, command: Command, state: State | None) -> None:
        """Post the frames of one tick; `word` is what the state machine wants to say."""
        ...

    def heard(self, statusword: int, counts: int) -> MoveProgress | None:
        """Take in what the drive said, and return how far it is with the last move."""
        ...


def orders_of(config: Cia402Config, rung: Rung, pdos: Sequence[PdoMap]) -> Orders:
    """Return the orders for a mode and the PDOs that carry them."""
    if rung.set_points is SetPoints.VELOCITY:
        return VelocityOrders(config, rung, pdos)
    if rung.set_points is SetPoints.POSITION:
        return PositionOrders(config, rung, pdos)
    return MoveOrders(config, pdos)


class VelocityOrders:
    """pv, csv, vl: controlword and velocity in one frame; zero unless the drive follows."""

    def __init__(self, config: Cia402Config, rung: Rung, pdos: Sequence[PdoMap]) -> None:
        (only,) = pdos
        scaling = config.scaling
        self._id = only.cob_id
        self._pack = only.codec().pack
        self._units = scaling.rpm if rung.mode is Mode.VELOCITY else scaling.velocity_units
        self._bits = rung.follow_bits

    def check(self, command: Command) -> None:
        """Refuse a velocity that cannot be sent."""
        self._units(command.velocity_rad_s)

    def post(self, post: Post, word: int, command: Command, state: State | None) -> None:
        """Post one frame."""
        if command.goal is Goal.ON and state is State.ENABLED:
            post(self._id, self._pack(word | self._bits, self._units(command.velocity_rad_s)))
        else:
            post(self._id, self._pack(word, 0))

    def heard(self, _statusword: int, _counts: int) -> None:
        """Return that there are no moves here."""


class PositionOrders:
    """csp and ip: the position first, to act with the SYNC that follows, then the controlword.

    Until the drive follows, the position is where the joint was measured to be, so that enabling
    moves nothing.
    """

    def __init__(self, config: Cia402Config, rung: Rung, pdos: Sequence[PdoMap]) -> None:
        control, target = pdos
        self._control_id, self._control = control.cob_id, control.codec().pack
        self._target_id, self._target = target.cob_id, target.codec().pack
        self._counts_of = config.scaling.position_counts
        self._bits = rung.follow_bits
        self._counts: int | None = None  # what the drive was told last, or where it stands
        self._follows = False

    def check(self, command: Command) -> None:
        """Refuse a position that cannot be sent."""
        _finite("position", command.position_rad)
        self._counts_of(command.position_rad)

    def post(self, post: Post, word: int, command: Command, state: State | None) -> None:
        """Post two frames; only one while nothing has been measured."""
        follows = command.goal is Goal.ON and state is State.ENABLED
        if follows and math.isfinite(command.position_rad):
            self._counts = self._counts_of(command.position_rad)
        if self._counts is not None:
            post(self._target_id, self._target(self._counts))
        post(self._control_id, self._control(word | self._bits if follows else word))
        self._follows = follows

    def heard(self, _statusword: int, counts: int) -> None:
        """Follow the joint while it is not led."""
        if not self._follows:
            self._counts = counts


class MoveOrders:
    """pp: target and speed in one frame, and CiA 402's handshake in the controlword.

    One tick with the new target, then bit 4 until the drive acknowledges by bit 12, then without
    bit 4 until bit 12 has gone too; bit 10 from then on says that the joint stands at its target.
    """

    def __init__(self, config: Cia402Config, pdos: Sequence[PdoMap]) -> None:
        control, target = pdos
        self._control_id, self._control = control.cob_id, control.codec().pack
        self._target_id, self._target = target.cob_id, target.codec().pack
        self._scaling = config.scaling
        self._move: Move | None = None
        self._data = b""
        self._shown = False  # the target has been sent; bit 4 may rise
        self._free = False  # and has gone again
        self._state = MoveState.OFFERED

    def check(self, command: Command) -> None:
        """Refuse a move that cannot be sent."""
        if command.move is not None:
            self._encoded(command.move)

    def post(self, post: Post, word: int, command: Command, state: State | None) -> None:
        """Post the controlword, and the target once where there is one to show."""
        if command.goal is not Goal.ON or state is not State.ENABLED:
            self._move = None
            post(self._control_id, self._control(word))
            return
        move = command.move
        if move is not None and (self._move is None or move.number != self._move.number):
            self._begin(move)
        offered = self._move is not None and self._state is MoveState.OFFERED
        post(
            self._control_id,
            self._control(word | NEW_SET_POINT if offered and self._shown else word),
        )
        if offered and not self._shown:
            post(self._target_id, self._data)
            self._shown = True

    def heard(self, statusword: int, _counts: int) -> MoveProgress | None:
        """Follow the handshake."""
        if self._move is None:
            return None
        acknowledged = bool(statusword & ACKNOWLEDGED)
        if self._state is MoveState.OFFERED and self._shown and acknowledged:
            self._state, self._free = MoveState.RUNNING, False
        elif self._state is MoveState.RUNNING and not acknowledged:
            self._free = True
        if self._state is MoveState.RUNNING and self._free and statusword & TARGET_REACHED:
            self._state = MoveState.DONE
        return MoveProgress(self._move.number, self._state)

    def _begin(self, move: Move) -> None:
        self._move, self._data = move, self._encoded(move)
        self._state, self._shown, self._free = MoveState.OFFERED, False, False

    def _encoded(self, move: Move) -> bytes:
        _finite("position", move.position_rad)
        speed = abs(self._scaling.velocity_units(move.velocity_rad_s))
        return self._target(self._scaling.position_counts(move.position_rad), max(speed, 1))


def disable_voltage(post: Post, pdos: Sequence[PdoMap]) -> None:
    """Take torque away by the frame that carries the controlword."""
    control = pdos[0]
    codec = control.codec()
    post(control.cob_id, struct.pack("<H", Controlword.DISABLE_VOLTAGE).ljust(codec.size, b"\0"))


def _finite(what: str, value: float) -> None:
    if not math.isfinite(value):
        raise ValueError(f"{what} must be finite, got {value} rad")
