"""A trajectory on its way: what it asks of each tick, by what the drive is fed with.

`agent.cycle.streamed` advances with the ticks and gives a set-point for each; `Moves` lets the
drive's own profile make each pass from rest to rest, and goes on when the drive says that it
stands there.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

from drivers.ports import Move, MoveState, Sample
from trajectories import Segment, Trajectory, TrajectoryError, point_to_point

TAKE_UP_S = 0.5
"""How long a drive may take to acknowledge a move; it is a matter of a few SYNCs."""

ARRIVE_S = 2.0
"""How much later than planned a drive may say that it stands at its target."""


class Due(NamedTuple):
    """What one tick asks for, motor side."""

    velocity_rad_s: float
    position_rad: float
    phase: str
    move: Move | None = None


class MoveFailedError(Exception):
    """The drive did not begin, or did not end, one of its moves in time."""


class Motion(Protocol):
    """A motion that has begun."""

    @property
    def share(self) -> float:
        """Return how much of it is behind us, 0 to 1."""
        ...

    def advance(self, step_s: float, newest: Sample) -> Due | None:
        """Go on by `step_s` and return what this tick asks for; None when it has ended.

        Raises
        ------
        MoveFailedError
            The drive is late with a move.
        """
        ...


class _Leg(NamedTuple):
    """A rest, or one move with the path that the drive's profile will take."""

    duration_s: float
    path: Trajectory | None
    speed_rad_s: float
    is_steady: bool


class Moves:
    """A trajectory as the drive's own moves, one after the other.

    The drive's profile is a trapezoid; what it should do by now is a trapezoid too, rounded within
    one tick, from the moment at which the drive has acknowledged the move.

    Parameters
    ----------
    trajectory : Trajectory
        From rest to rest, with one speed between two rests.
    from_rad : float
        Where the joint stands.
    acceleration_rad_s2 : float
        The drive's ramps.
    tick_s : float
        Control period.
    numbers : iterator of int
        Gives each move a number that no other has.

    Raises
    ------
    trajectories.TrajectoryError
        Its speed changes within a pass: no single move can do that.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        from_rad: float,
        acceleration_rad_s2: float,
        tick_s: float,
        numbers: Iterator[int],
    ) -> None:
        self._legs = legs(trajectory, from_rad, acceleration_rad_s2, tick_s)
        self._total_s = sum(leg.duration_s for leg in self._legs)
        self._behind_s = 0.0
        self._numbers = numbers
        self._index = -1
        self._place_rad = from_rad
        self._elapsed_s = self._waited_s = 0.0
        self._move: Move | None = None
        self._next_leg()

    @property
    def share(self) -> float:
        """Return how much of it is behind us, 0 to 1."""
        return min(1.0, (self._behind_s + self._elapsed_s) / max(self._total_s, 1e-9))

    def advance(self, step_s: float, newest: Sample) -> Due | None:
        """Go on by `step_s`, or wait for the drive.

        Raises
        ------
        MoveFailedError
            The drive does not take a move up, or does not arrive.
        """
        if self._index >= len(self._legs):
            return None
        leg = self._legs[self._index]
        if leg.path is None:
            self._elapsed_s += step_s
            if self._elapsed_s >= leg.duration_s:
                self._next_leg()
            return Due(0.0, self._place_rad, "rest", self._move)
        return self._moving(leg, leg.path, step_s, newest)

    def _moving(self, leg: _Leg, path: Trajectory, step_s: float, newest: Sample) -> Due:
        """Follow one move of the drive."""
        move, said = self._move, newest.move
        assert move is not None  # `_next_leg` has made it
        begun = said is not None and said.number == move.number
        if not begun or said is None or said.state is MoveState.OFFERED:
            self._wait(step_s, TAKE_UP_S, f"the drive did not take up move {move.number}")
            return Due(0.0, path.start_position_rad, "rest", move)
        self._elapsed_s = min(self._elapsed_s + step_s, leg.duration_s)
        if self._elapsed_s >= leg.duration_s:
            self._place_rad = path.end_position_rad
            if said.state is MoveState.DONE:
                self._next_leg()
            else:
                self._wait(step_s, ARRIVE_S, f"the drive did not end move {move.number}")
            return Due(0.0, path.end_position_rad, "rest", move)
        at = path.at(self._elapsed_s)
        phase = at.phase if leg.is_steady or at.phase != "steady" else "ramp"
        return Due(at.velocity_rad_s, at.position_rad, phase, move)

    def _next_leg(self) -> None:
        if self._index >= 0:
            self._behind_s += self._legs[self._index].duration_s
        self._index += 1
        self._elapsed_s = self._waited_s = 0.0
        if self._index < len(self._legs):
            leg = self._legs[self._index]
            if leg.path is not None:
                end_rad = leg.path.end_position_rad
                self._move = Move(next(self._numbers), end_rad, leg.speed_rad_s)

    def _wait(self, step_s: float, longest_s: float, what: str) -> None:
        self._waited_s += step_s
        if self._waited_s > longest_s:
            raise MoveFailedError(f"{what} within {longest_s:g} s")


def legs(
    trajectory: Trajectory, from_rad: float, acceleration_rad_s2: float, tick_s: float
) -> tuple[_Leg, ...]:
    """Return the rests and the moves of a trajectory that begins at `from_rad`.

    Raises
    ------
    trajectories.TrajectoryError
        Its speed changes within a pass.
    """
    found: list[_Leg] = []
    place_rad = from_rad
    stroke: list[Segment] = []
    for segment in trajectory.segments:
        if segment.velocity_start_rad_s == 0.0 == segment.velocity_end_rad_s:
            found.append(_Leg(segment.duration_s, None, 0.0, False))
            continue
        stroke.append(segment)
        if segment.velocity_end_rad_s == 0.0:
            leg = _leg(stroke, place_rad, acceleration_rad_s2, tick_s)
            found.append(leg)
            place_rad = leg.path.end_position_rad if leg.path is not None else place_rad
            stroke = []
    return tuple(found)


def _leg(stroke: list[Segment], from_rad: float, acceleration_rad_s2: float, tick_s: float) -> _Leg:
    """Return one stroke as a move of the drive."""
    speeds = {s.velocity_start_rad_s for s in stroke} | {s.velocity_end_rad_s for s in stroke}
    speeds.discard(0.0)
    if len(speeds) != 1:
        raise TrajectoryError(
            f"this drive makes its own moves (pp), each with one speed, and a stroke of this "
            f"trajectory has {len(speeds)}: use a stair of kind 'paired'"
        )
    speed = abs(speeds.pop())
    path = point_to_point(
        from_rad,
        from_rad + sum(s.displacement_rad for s in stroke),
        velocity_rad_s=speed,
        acceleration_rad_s2=acceleration_rad_s2,
        jerk_rad_s3=acceleration_rad_s2 / tick_s,
    )
    return _Leg(path.duration_s, path, speed, any(s.phase == "steady" for s in stroke))
