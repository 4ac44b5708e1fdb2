"""A trajectory as a stream: a set-point each tick, rounded where a position loop follows it."""

from __future__ import annotations

from agent.cycle.motion import Due
from drivers.ports import Sample
from trajectories import SetPoint, Trajectory

ROUNDING_S = 0.1
"""Over so long a stream of positions is averaged.

A position loop holds the motor to its path, and an arm behind a soft gear swings against a motor
that does not give way: with up to twice the torque of the ramp. A velocity loop gives way. Averaged
over 0.1 s, ramps excite an arm that swings with 7 to 43 Hz by less than a quarter of what they
would (input shaping, with equal impulses: Singer and Seering, J. Dyn. Syst. Meas. Control 112 (1),
76-82, 1990).
"""

_TAPS = 6
_SAME_PLACE_RAD = 1e-9


class Streamed:
    """A set-point each tick; never more than three ticks at once.

    A late tick so stretches the trajectory instead of making the set-point jump.

    Parameters
    ----------
    trajectory : Trajectory
        From rest to rest.
    from_rad : float
        Where the joint stands.
    tick_s : float
        Control period.
    rounding_s : float
        Over how long the set-points are averaged; the motion ends so much later. A mean exceeds no
        limit that all of its parts keep.
    """

    def __init__(
        self, trajectory: Trajectory, from_rad: float, tick_s: float, rounding_s: float = 0.0
    ) -> None:
        self._trajectory = trajectory
        self._duration_s = trajectory.duration_s + rounding_s
        taps = _TAPS if rounding_s else 1
        self._behind_s = [rounding_s * tap / (_TAPS - 1) for tap in range(taps)]
        self._shift_rad = from_rad - trajectory.start_position_rad
        self._end_rad = trajectory.end_position_rad + self._shift_rad
        self._elapsed_s = 0.0
        self._longest_step_s = 3.0 * tick_s
        self._last = Due(0.0, from_rad, "rest")

    @property
    def share(self) -> float:
        """Return how much of it is behind us, 0 to 1."""
        return min(1.0, self._elapsed_s / max(self._duration_s, 1e-9))

    def advance(self, step_s: float, newest: Sample) -> Due | None:  # noqa: ARG002 - a Motion's
        """Go on by `step_s`; it has ended once its end has been asked for."""
        self._elapsed_s += min(step_s, self._longest_step_s)
        arrived = abs(self._last.position_rad - self._end_rad) <= _SAME_PLACE_RAD
        over = self._elapsed_s >= self._duration_s
        if over and arrived and self._last.velocity_rad_s == 0.0:
            return None
        taps = [self._trajectory.at(self._elapsed_s - behind_s) for behind_s in self._behind_s]
        self._last = Due(
            sum(tap.velocity_rad_s for tap in taps) / len(taps),
            sum(tap.position_rad for tap in taps) / len(taps) + self._shift_rad,
            _common_phase(taps),
        )
        return self._last


def _common_phase(taps: list[SetPoint]) -> str:
    """Return the phase that all parts of a mean are in; between two phases it is a ramp."""
    first = taps[0]
    for tap in taps:
        another_speed = tap.phase == "steady" and tap.velocity_rad_s != first.velocity_rad_s
        if tap.phase != first.phase or another_speed:
            return "ramp"
    return first.phase
