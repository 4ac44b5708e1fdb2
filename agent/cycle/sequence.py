"""The cycle, one tick at a time: enable, go to the start, drive the stair, return, disable.

Stepped, not threaded: `Sequence.cycle(now_s, samples)` takes what was measured since the last tick
and returns what to send in this one. It never waits and never touches a device, so a test steps
through it. From the moment that motion may begin, every set-point, standstill included, passes
`gate.refusals`; whatever refuses trips the interlock and ends the cycle with `StoppedError`.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence as Many
from typing import NamedTuple

from agent.cycle.gate import SetPoint, refusals
from agent.cycle.interlock import Event, Interlock
from agent.cycle.plan import CyclePlan
from agent.errors import StoppedError
from drivers.ports import Command, DriveState, Goal, Sample
from trajectories import Trajectory, point_to_point

AT_REST = Command(Goal.ON, 0.0)
OFF = Command(Goal.OFF, 0.0)


class Stage(enum.Enum):
    """What the cycle is doing; the value is the word that the recording's `phase` uses."""

    ENABLE = "enable"
    APPROACH = "approach"
    STAIR = "stair"
    RETURN = "return"
    DISABLE = "disable"
    DONE = "done"


class Step(NamedTuple):
    """What one tick sends, and how the recording labels it."""

    command: Command
    phase: str
    position_command_rad: float


class _Motion:
    """A trajectory on its way: it advances with the ticks, never by more than three at once.

    A late tick so stretches the trajectory instead of making the set-point jump.
    """

    def __init__(self, trajectory: Trajectory, from_rad: float, tick_s: float) -> None:
        self.trajectory = trajectory
        self.shift_rad = from_rad - trajectory.start_position_rad
        self.elapsed_s = 0.0
        self._longest_step_s = 3.0 * tick_s

    def advance(self, step_s: float) -> None:
        self.elapsed_s += min(step_s, self._longest_step_s)

    @property
    def remaining_s(self) -> float:
        return self.trajectory.duration_s - self.elapsed_s


class Sequence:
    """One cycle over one plan. `interlock` must have passed its preflight.

    Parameters
    ----------
    plan : CyclePlan
        What to do.
    interlock : Interlock
        In state READY.
    newest : Sample
        The last one that the preflight saw.
    """

    def __init__(self, plan: CyclePlan, interlock: Interlock, newest: Sample) -> None:
        self.plan = plan
        self.interlock = interlock.after(Event.ENABLE_ASKED)
        self.stage = Stage.ENABLE
        self._newest = newest
        self._motion: _Motion | None = None
        self._home_rad = newest.position_rad
        self._attempts = 0
        self._settled_since_s: float | None = None
        self._stage_since_s: float | None = None
        self._sent_velocity_rad_s = 0.0
        self._last_tick_s: float | None = None

    @property
    def done(self) -> bool:
        """Return whether the cycle has ended by itself, the drive without torque."""
        return self.stage is Stage.DONE

    @property
    def progress(self) -> float:
        """Return how much of the stair is behind us, 0 to 1."""
        if self.stage is Stage.STAIR and self._motion is not None:
            return min(1.0, self._motion.elapsed_s / self._motion.trajectory.duration_s)
        return 1.0 if self.stage in (Stage.RETURN, Stage.DISABLE, Stage.DONE) else 0.0

    def cycle(self, now_s: float, samples: Many[Sample]) -> Step:
        """Take this tick's samples and return what to send.

        Parameters
        ----------
        now_s : float
            The injected clock's time; rises from call to call.
        samples : sequence of Sample
            What has arrived since the last call, oldest first; may be empty.

        Raises
        ------
        agent.errors.StoppedError
            With every reason why motion may not go on; the interlock has tripped.
        """
        if samples:
            self._newest = samples[-1]
        step_s = 0.0 if self._last_tick_s is None else now_s - self._last_tick_s
        self._last_tick_s = now_s
        if self._stage_since_s is None:
            self._stage_since_s = now_s
        handler = {
            Stage.ENABLE: self._enable,
            Stage.APPROACH: self._approach,
            Stage.STAIR: self._stair,
            Stage.RETURN: self._return,
            Stage.DISABLE: self._disable,
            Stage.DONE: self._after_the_end,
        }[self.stage]
        return handler(now_s, step_s)

    def trip(self, reason: str) -> StoppedError:
        """Trip the interlock and return the error to raise."""
        self.interlock = self.interlock.after(Event.TRIP, reason)
        return StoppedError(f"Stopped during '{self.stage.value}': {self.interlock.reason}.")

    # -- stages ------------------------------------------------------------------------------

    def _enable(self, now_s: float, _step_s: float) -> Step:
        newest = self._newest
        if newest.state is DriveState.ON:
            self.interlock = self.interlock.after(Event.DRIVE_ON)
            self._home_rad = newest.position_rad
            self._set_out(
                Stage.APPROACH, now_s, self.plan.trajectory.start_position_rad, newest.position_rad
            )
            return self._rest(now_s, Stage.APPROACH.value)
        self._within_time(now_s, "the drive was not enabled")
        return self._rest(now_s, Stage.ENABLE.value)

    def _approach(self, now_s: float, step_s: float) -> Step:
        step = self._move(now_s, step_s, Stage.APPROACH.value)
        if step is not None:
            return step
        target = self.plan.trajectory.start_position_rad
        if self._settled(now_s):
            position = self._newest.position_rad
            if abs(position - target) <= self.plan.approach.tolerance_rad:
                self._motion = _Motion(self.plan.trajectory, position, self.plan.tick_s)
                self._next(Stage.STAIR, now_s)
            elif self._attempts >= self.plan.approach.attempts:
                raise self.trip(
                    f"after {self._attempts} approaches the joint is still "
                    f"{abs(position - target):.3f} rad from the start; the tolerance is "
                    f"{self.plan.approach.tolerance_rad:.3f} rad"
                )
            else:
                self._set_out(Stage.APPROACH, now_s, target, position)
        return self._rest(now_s, Stage.APPROACH.value)

    def _stair(self, now_s: float, step_s: float) -> Step:
        step = self._move(now_s, step_s, None)
        if step is not None:
            return step
        if self._settled(now_s):
            self._set_out(Stage.RETURN, now_s, self._home_rad, self._newest.position_rad)
        return self._rest(now_s, "rest")

    def _return(self, now_s: float, step_s: float) -> Step:
        step = self._move(now_s, step_s, Stage.RETURN.value)
        if step is not None:
            return step
        if self._settled(now_s):
            self.interlock = self.interlock.after(Event.MOTION_DONE)
            self._next(Stage.DISABLE, now_s)
            return self._off()
        return self._rest(now_s, Stage.RETURN.value)

    def _disable(self, now_s: float, _step_s: float) -> Step:
        newest = self._newest
        if newest.state is DriveState.OFF:
            self.interlock = self.interlock.after(Event.DRIVE_OFF)
            self._next(Stage.DONE, now_s)
        else:
            self._within_time(now_s, "the drive did not take torque away")
        return self._off()

    def _after_the_end(self, _now_s: float, _step_s: float) -> Step:
        return self._off()

    # -- what the stages share ---------------------------------------------------------------

    def _move(self, now_s: float, step_s: float, phase: str | None) -> Step | None:
        """Send the motion's next set-point through the gate; None when it has ended."""
        motion = self._motion
        if motion is None:
            return None
        motion.advance(step_s)
        if motion.remaining_s <= 0.0 and self._sent_velocity_rad_s == 0.0:
            self._motion = None
            self._settled_since_s = None
            return None
        at = motion.trajectory.at(motion.elapsed_s)
        position = at.position_rad + motion.shift_rad
        wanted = SetPoint(
            velocity_rad_s=at.velocity_rad_s,
            position_rad=position,
            previous_velocity_rad_s=self._sent_velocity_rad_s,
            step_s=step_s,
        )
        self._insist(wanted, now_s)
        self._sent_velocity_rad_s = at.velocity_rad_s
        return Step(Command(Goal.ON, at.velocity_rad_s), phase or at.phase, position)

    def _insist(self, wanted: SetPoint, now_s: float) -> None:
        """Trip unless interlock and gate both let the set-point pass."""
        against = refusals(self.plan.limits, wanted, self._newest, now_s)
        if not self.interlock.may_move:
            against = (f"the interlock is {self.interlock.state.value}", *against)
        if against:
            raise self.trip("; ".join(against))

    def _set_out(self, stage: Stage, now_s: float, to_rad: float, from_rad: float) -> None:
        """Plan a point-to-point move from where the joint stands."""
        approach = self.plan.approach
        self._attempts = self._attempts + 1 if stage is self.stage else 1
        move = point_to_point(
            from_rad=from_rad,
            to_rad=to_rad,
            velocity_rad_s=approach.velocity_rad_s,
            acceleration_rad_s2=approach.acceleration_rad_s2,
            jerk_rad_s3=approach.jerk_rad_s3,
        )
        self._motion = _Motion(move, from_rad, self.plan.tick_s)
        self._next(stage, now_s)

    def _next(self, stage: Stage, now_s: float) -> None:
        self.stage = stage
        self._stage_since_s = now_s
        self._settled_since_s = None

    def _settled(self, now_s: float) -> bool:
        """Return whether the joint has been commanded to rest for the settling time."""
        if self._settled_since_s is None:
            self._settled_since_s = now_s
        return now_s - self._settled_since_s >= self.plan.approach.settle_s

    def _within_time(self, now_s: float, what: str) -> None:
        since = self._stage_since_s if self._stage_since_s is not None else now_s
        if now_s - since > self.plan.transition_timeout_s:
            raise self.trip(f"{what} within {self.plan.transition_timeout_s:.1f} s")

    def _rest(self, now_s: float, phase: str) -> Step:
        """Hold at standstill; what is measured must allow even that, once motion may begin."""
        if self.interlock.may_move:
            still = SetPoint(0.0, self._newest.position_rad, self._sent_velocity_rad_s, 0.0)
            self._insist(still, now_s)
        return self._still(AT_REST, phase)

    def _off(self) -> Step:
        """Take torque away."""
        return self._still(OFF, Stage.DISABLE.value)

    def _still(self, command: Command, phase: str) -> Step:
        self._sent_velocity_rad_s = 0.0
        return Step(command, phase, self._newest.position_rad)
