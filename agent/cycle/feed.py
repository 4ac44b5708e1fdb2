"""How a drive is fed: what motion is made of a trajectory for it, and how far a tick takes that."""

from __future__ import annotations

import itertools

from agent.cycle.motion import Motion, Moves
from agent.cycle.plan import CyclePlan
from agent.cycle.streamed import ROUNDING_S, Streamed
from drivers.ports import SetPoints
from trajectories import Trajectory


class Feed:
    """The set-points of one drive over one plan.

    Parameters
    ----------
    plan : CyclePlan
        What to do.
    set_points : SetPoints
        What the drive is fed with.
    """

    def __init__(self, plan: CyclePlan, set_points: SetPoints) -> None:
        self._plan = plan
        self._set_points = set_points
        self._numbers = itertools.count(1)  # of the drive's own moves

    @property
    def is_velocity(self) -> bool:
        """Return whether the drive is told speeds, and never where it shall be."""
        return self._set_points is SetPoints.VELOCITY

    def step_s(self, passed_s: float) -> float:
        """Return how far the motion goes on in this tick.

        A drive that is fed with positions makes one period of each, whenever it comes: a tick that
        is late by a quarter would else ask for a quarter more speed, and the next for less.
        """
        streams_positions = self._set_points is SetPoints.POSITION and passed_s > 0.0
        return self._plan.tick_s if streams_positions else passed_s

    def along(self, trajectory: Trajectory, from_rad: float) -> Motion:
        """Return a motion along `trajectory` from where the joint stands.

        Raises
        ------
        trajectories.TrajectoryError
            The drive makes its own moves, and the trajectory cannot be made of them.
        """
        tick_s = self._plan.tick_s
        if self._set_points is SetPoints.MOVE:
            ramp = self._plan.approach.acceleration_rad_s2
            return Moves(trajectory, from_rad, ramp, tick_s, self._numbers)
        if self.is_velocity or not self._may_be_rounded(trajectory):
            return Streamed(trajectory, from_rad, tick_s)
        return Streamed(trajectory, from_rad, tick_s, ROUNDING_S)

    def _may_be_rounded(self, trajectory: Trajectory) -> bool:
        """Tell a stair, or a move to it, from what has corners in order to excite the spring."""
        return trajectory is not self._plan.trajectory or bool(trajectory.steady_windows())
