"""One piece of a velocity profile: an S-shaped ramp, a steady dwell, or rest.

A ramp changes velocity by ``dv`` in a time ``T`` with an acceleration that rises for ``tj``, holds
its peak ``A = dv / (T - tj)`` and falls for ``tj``; the jerk is ``+-A / tj``. Because the velocity
curve is point-symmetric about its middle, the distance covered is exactly ``(v0 + v1) / 2 * T``.
Each segment is at most three pieces of constant jerk, and everything else - set-points, sampling,
the check against limits - is evaluated on those cubic pieces, in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

from trajectories.checks import TrajectoryError, finite, not_negative, positive

Phase = Literal["rest", "ramp", "steady"]
PHASES: tuple[Phase, ...] = get_args(Phase)


class Piece(NamedTuple):
    """Motion of constant jerk over ``[start_s, start_s + duration_s]``.

    With ``d = t - start_s``: ``x = position + velocity d + acceleration d^2/2 + jerk d^3/6``.
    """

    start_s: float
    duration_s: float
    position_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float


def ramp_times_s(
    velocity_change_rad_s: float, acceleration_rad_s2: float, jerk_rad_s3: float
) -> tuple[float, float]:
    """Return the least time for a change of velocity, and how long its jerk lasts at either end.

    Parameters
    ----------
    velocity_change_rad_s : float
        Either sign; zero takes no time.
    acceleration_rad_s2, jerk_rad_s3 : float
        Bounds on the magnitudes, above zero.

    Returns
    -------
    duration_s, jerk_time_s : float
        ``|dv|/A + A/J`` and ``A/J`` where the acceleration bound is reached, else
        ``2 sqrt(|dv|/J)`` and half of it.
    """
    change = abs(velocity_change_rad_s)
    full_jerk_time_s = acceleration_rad_s2 / jerk_rad_s3
    if change <= acceleration_rad_s2 * full_jerk_time_s:
        jerk_time_s = math.sqrt(change / jerk_rad_s3)
        return 2.0 * jerk_time_s, jerk_time_s
    duration_s = change / acceleration_rad_s2 + full_jerk_time_s
    return max(duration_s, 2.0 * full_jerk_time_s), full_jerk_time_s


@dataclass(frozen=True, slots=True)
class Segment:
    """A piece of a velocity profile; time runs from zero to `duration_s` within it.

    Parameters
    ----------
    phase : {"rest", "ramp", "steady"}
        What the piece is for. A "ramp" may hold its velocity (a transfer at constant speed that is
        not meant to be evaluated); a "steady" one always does.
    duration_s : float
        Above zero.
    velocity_start_rad_s, velocity_end_rad_s : float
        Equal unless the phase is "ramp".
    jerk_time_s : float
        How long the jerk lasts at either end of a change of velocity: above zero and at most half
        the duration; zero where the velocity does not change.

    Raises
    ------
    TrajectoryError
        A value is not finite or contradicts the others.
    """

    phase: Phase
    duration_s: float
    velocity_start_rad_s: float
    velocity_end_rad_s: float
    jerk_time_s: float = 0.0

    def __post_init__(self) -> None:
        if self.phase not in PHASES:
            raise TrajectoryError(f"phase must be one of {', '.join(PHASES)}, got {self.phase!r}")
        set_ = object.__setattr__
        set_(self, "duration_s", positive("duration_s", self.duration_s))
        set_(self, "jerk_time_s", not_negative("jerk_time_s", self.jerk_time_s))
        for name in ("velocity_start_rad_s", "velocity_end_rad_s"):
            set_(self, name, finite(name, getattr(self, name)))
        if self.velocity_start_rad_s == self.velocity_end_rad_s:
            self._check_constant()
        else:
            self._check_change()

    def _check_constant(self) -> None:
        if self.jerk_time_s != 0.0:
            raise TrajectoryError(
                f"jerk_time_s must be zero where the velocity is constant, got {self.jerk_time_s:g}"
            )
        if self.phase == "rest" and self.velocity_start_rad_s != 0.0:
            raise TrajectoryError(
                f"a rest must have velocity zero, got {self.velocity_start_rad_s:g} rad/s"
            )
        if self.phase == "steady" and self.velocity_start_rad_s == 0.0:
            raise TrajectoryError("a steady segment must move, got velocity zero")

    def _check_change(self) -> None:
        if self.phase != "ramp":
            raise TrajectoryError(
                f"only a ramp changes velocity; this {self.phase} segment goes from "
                f"{self.velocity_start_rad_s:g} to {self.velocity_end_rad_s:g} rad/s"
            )
        if not 0.0 < self.jerk_time_s <= 0.5 * self.duration_s:
            raise TrajectoryError(
                f"jerk_time_s must be above zero and at most half the duration "
                f"({0.5 * self.duration_s:g} s), got {self.jerk_time_s:g}"
            )
        if not math.isfinite(self.jerk_rad_s3):
            raise TrajectoryError(
                f"a change of {self.velocity_end_rad_s - self.velocity_start_rad_s:g} rad/s in "
                f"{self.duration_s:g} s has no finite jerk"
            )

    @classmethod
    def ramp(
        cls,
        velocity_start_rad_s: float,
        velocity_end_rad_s: float,
        acceleration_rad_s2: float,
        jerk_rad_s3: float,
    ) -> Segment:
        """Return the fastest smooth change of velocity within the two bounds."""
        start = finite("velocity_start_rad_s", velocity_start_rad_s)
        end = finite("velocity_end_rad_s", velocity_end_rad_s)
        acceleration = positive("acceleration_rad_s2", acceleration_rad_s2)
        jerk = positive("jerk_rad_s3", jerk_rad_s3)
        if start == end:
            raise TrajectoryError(f"a ramp must change the velocity, got {start:g} rad/s twice")
        duration_s, jerk_time_s = ramp_times_s(end - start, acceleration, jerk)
        return cls("ramp", duration_s, start, end, jerk_time_s)

    @classmethod
    def steady(cls, velocity_rad_s: float, duration_s: float) -> Segment:
        """Return a dwell at constant velocity, meant to be evaluated."""
        return cls("steady", duration_s, velocity_rad_s, velocity_rad_s)

    @classmethod
    def transfer(cls, velocity_rad_s: float, duration_s: float) -> Segment:
        """Return constant velocity that only leads somewhere; its phase is "ramp"."""
        return cls("ramp", duration_s, velocity_rad_s, velocity_rad_s)

    @classmethod
    def rest(cls, duration_s: float) -> Segment:
        """Return standstill."""
        return cls("rest", duration_s, 0.0, 0.0)

    @property
    def displacement_rad(self) -> float:
        """How far the segment leads: ``(v0 + v1) / 2 * T``, exact for every phase."""
        return 0.5 * (self.velocity_start_rad_s + self.velocity_end_rad_s) * self.duration_s

    @property
    def peak_acceleration_rad_s2(self) -> float:
        """Signed acceleration of largest magnitude, ``dv / (T - tj)``."""
        change = self.velocity_end_rad_s - self.velocity_start_rad_s
        return change / (self.duration_s - self.jerk_time_s)

    @property
    def jerk_rad_s3(self) -> float:
        """Signed jerk with which the segment begins; it ends with the opposite one."""
        if self.jerk_time_s == 0.0:
            return 0.0
        return self.peak_acceleration_rad_s2 / self.jerk_time_s

    def reversed(self) -> Segment:
        """Return the same path run backward in time: velocities swap and change sign."""
        return Segment(
            self.phase,
            self.duration_s,
            0.0 - self.velocity_end_rad_s,  # 0.0 - x, so that no minus zero appears
            0.0 - self.velocity_start_rad_s,
            self.jerk_time_s,
        )

    def pieces(self) -> tuple[Piece, ...]:
        """Return one to three pieces of constant jerk; position runs from zero."""
        v0, v1, tj, total = (
            self.velocity_start_rad_s,
            self.velocity_end_rad_s,
            self.jerk_time_s,
            self.duration_s,
        )
        if tj == 0.0:
            return (Piece(0.0, total, 0.0, v0, 0.0, 0.0),)
        peak, jerk = self.peak_acceleration_rad_s2, self.jerk_rad_s3
        gained = 0.5 * peak * tj
        first = Piece(0.0, tj, 0.0, v0, 0.0, jerk)
        # The last piece mirrors the first: its start is reckoned back from the segment's end.
        x_last = self.displacement_rad - v1 * tj + peak * tj * tj / 6.0
        last = Piece(total - tj, tj, x_last, v1 - gained, peak, -jerk)
        hold_s = total - 2.0 * tj
        if hold_s <= 0.0:
            return first, last
        x_hold = v0 * tj + peak * tj * tj / 6.0
        return first, Piece(tj, hold_s, x_hold, v0 + gained, peak, 0.0), last

    def _piece_at(self, time_s: float) -> tuple[Piece, float]:
        """Return the piece that holds `time_s` (clipped into the segment) and the time in it."""
        time_s = min(max(time_s, 0.0), self.duration_s)
        pieces = self.pieces()
        piece = next((p for p in reversed(pieces) if time_s >= p.start_s), pieces[0])
        return piece, time_s - piece.start_s

    def position_rad(self, time_s: float) -> float:
        """Return the distance covered since the segment's start; time is clipped into it."""
        p, d = self._piece_at(time_s)
        return p.position_rad + d * (
            p.velocity_rad_s + d * (0.5 * p.acceleration_rad_s2 + d * p.jerk_rad_s3 / 6.0)
        )

    def velocity_rad_s(self, time_s: float) -> float:
        """Return the velocity; time is clipped into the segment."""
        p, d = self._piece_at(time_s)
        return p.velocity_rad_s + d * (p.acceleration_rad_s2 + 0.5 * d * p.jerk_rad_s3)

    def acceleration_rad_s2(self, time_s: float) -> float:
        """Return the acceleration; time is clipped into the segment."""
        p, d = self._piece_at(time_s)
        return p.acceleration_rad_s2 + d * p.jerk_rad_s3
