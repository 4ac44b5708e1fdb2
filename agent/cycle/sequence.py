"""The cycle, one tick at a time: enable, go to the start, drive the stair, return, disable.

Stepped, not threaded: `Sequence.cycle(now_s, samples)` takes what was measured since the last tick
and returns what to send in this one. It never waits and never touches a device, so a test steps
through it. From the moment that motion may begin, every set-point, standstill included, passes
`gate.refusals`; whatever refuses trips the interlock and ends the cycle with `StoppedError`.
"""

from __future__ import annotations

from collections.abc import Sequence as Many

from agent.cycle.answered import Asking
from agent.cycle.blocked import blocked
from agent.cycle.continuity import Course, jump
from agent.cycle.feed import Feed
from agent.cycle.gate import Asked, SetPoint, move_refusals, refusals
from agent.cycle.interlock import Event, Interlock
from agent.cycle.motion import Motion, MoveFailedError
from agent.cycle.plan import CyclePlan
from agent.cycle.stage import AT_REST, OFF, Stage, Step
from agent.errors import RefusedError, StoppedError
from drivers.ports import Command, DriveState, Goal, Move, Sample, SetPoints
from trajectories import TrajectoryError, point_to_point


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
    set_points : SetPoints
        What the drive is fed with.

    Raises
    ------
    agent.errors.RefusedError
        The drive makes its own moves, and the trajectory cannot be made of them.
    """

    def __init__(
        self,
        plan: CyclePlan,
        interlock: Interlock,
        newest: Sample,
        set_points: SetPoints = SetPoints.VELOCITY,
    ) -> None:
        self.plan = plan
        self._feed = Feed(plan, set_points)
        self._held_rad = newest.position_rad  # the last position asked for
        self.interlock = interlock.after(Event.ENABLE_ASKED)
        self.stage = Stage.ENABLE
        self._newest = newest
        self._motion: Motion | None = None
        self._home_rad = newest.position_rad
        self._attempts = 0
        self._settled_since_s: float | None = None
        self._stage_since_s: float | None = None
        self._sent_velocity_rad_s = 0.0
        self._last_tick_s: float | None = None
        self._asking = Asking()
        self._course = Course(plan.limits)
        try:
            self._feed.along(plan.trajectory, self._stand_rad)
        except TrajectoryError as error:
            reason = str(error)
            raise RefusedError(f"Refused, nothing has moved: {reason}.", (reason,)) from error

    @property
    def done(self) -> bool:
        """Return whether the cycle has ended by itself, the drive without torque."""
        return self.stage is Stage.DONE

    @property
    def progress(self) -> float:
        """Return how much of the stair is behind us, 0 to 1."""
        if self.stage is Stage.STAIR and self._motion is not None:
            return self._motion.share
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
            impossible = jump(self.plan.limits, (self._newest, *samples))
            self._newest = samples[-1]
            for sample in samples:
                self._course.take(sample)
            self._asking.forget_before(self._newest.time_s)
            impossible = impossible or self._course.contradiction()
            if impossible:
                raise self.trip(impossible)
        step_s = 0.0 if self._last_tick_s is None else self._feed.step_s(now_s - self._last_tick_s)
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
        step = handler(now_s, step_s)
        self._asking.ask(now_s, Asked(step.command.velocity_rad_s, step.position_command_rad))
        return step

    def trip(self, reason: str, look: str = "") -> StoppedError:
        """Trip the interlock and return the error to raise; `look` says where to look first."""
        return self._tripped(
            reason,
            f"{look}{' ' if look else ''}Find the cause at the joint, the drive, its bus or the "
            "cell, then start a new cycle.",
        )

    def trip_as_asked(self, reason: str) -> StoppedError:
        """Trip the interlock because somebody asked for it, and return the error to raise."""
        return self._tripped(reason, "Start a new cycle when it may run again.")

    def _tripped(self, reason: str, do: str) -> StoppedError:
        self.interlock = self.interlock.after(Event.TRIP, reason)
        return StoppedError(f"Stopped during '{self.stage.value}': {self.interlock.reason}.", do)

    # -- stages ------------------------------------------------------------------------------

    def _enable(self, now_s: float, _step_s: float) -> Step:
        newest = self._newest
        self._held_rad = newest.position_rad
        if newest.state is DriveState.ON:
            self.interlock = self.interlock.after(Event.DRIVE_ON)
            self._home_rad = newest.position_rad
            self._set_out(Stage.APPROACH, now_s, self.plan.trajectory.start_position_rad)
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
                self._motion = self._feed.along(self.plan.trajectory, self._stand_rad)
                self._next(Stage.STAIR, now_s)
            elif self._attempts >= self.plan.approach.attempts:
                raise self.trip(
                    f"after {self._attempts} approaches the joint is still "
                    f"{abs(position - target):.3f} rad from the start; the tolerance is "
                    f"{self.plan.approach.tolerance_rad:.3f} rad"
                )
            else:
                self._set_out(Stage.APPROACH, now_s, target)
        return self._rest(now_s, Stage.APPROACH.value)

    def _stair(self, now_s: float, step_s: float) -> Step:
        step = self._move(now_s, step_s, None)
        if step is not None:
            return step
        if self._settled(now_s):
            self._set_out(Stage.RETURN, now_s, self._home_rad)
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
        try:
            due = motion.advance(step_s, self._newest)
        except MoveFailedError as error:
            raise self.trip(str(error)) from error
        if due is None:
            self._motion = None
            self._settled_since_s = None
            return None
        wanted = SetPoint(
            velocity_rad_s=due.velocity_rad_s,
            position_rad=due.position_rad,
            previous_velocity_rad_s=self._sent_velocity_rad_s,
            step_s=step_s,
            previous_position_rad=None if self._feed.is_velocity else self._held_rad,
            answered=self._asking.answered(self._newest.time_s),
        )
        self._insist(wanted, now_s, due.move)
        self._sent_velocity_rad_s = due.velocity_rad_s
        self._held_rad = due.position_rad
        command = Command(Goal.ON, due.velocity_rad_s, due.position_rad, due.move)
        return Step(command, phase or due.phase, due.position_rad)

    def _insist(self, wanted: SetPoint, now_s: float, move: Move | None = None) -> None:
        """Trip unless interlock and gate both let the set-point pass."""
        against = refusals(self.plan.limits, wanted, self._newest, now_s)
        if move is not None:
            against = (*against, *move_refusals(self.plan.limits, move))
        if not self.interlock.may_move:
            against = (f"the interlock is {self.interlock.state.value}", *against)
        if against:
            asked = wanted.answered or wanted
            unlike = self._course.unlike_rad_s
            look = blocked(self.plan.limits, asked.velocity_rad_s, self._newest, unlike)
            raise self.trip("; ".join(against), look)

    def _set_out(self, stage: Stage, now_s: float, to_rad: float) -> None:
        """Plan a point-to-point move from where the joint stands."""
        approach = self.plan.approach
        self._attempts = self._attempts + 1 if stage is self.stage else 1
        move = point_to_point(
            from_rad=self._stand_rad,
            to_rad=to_rad,
            velocity_rad_s=approach.velocity_rad_s,
            acceleration_rad_s2=approach.acceleration_rad_s2,
            jerk_rad_s3=approach.jerk_rad_s3,
        )
        self._motion = self._feed.along(move, self._stand_rad)
        self._next(stage, now_s)

    @property
    def _stand_rad(self) -> float:
        """Return where a motion begins: where the joint is, or where its drive was told to be."""
        return self._newest.position_rad if self._feed.is_velocity else self._held_rad

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
            held = None if self._feed.is_velocity else self._held_rad
            asked = self._asking.answered(self._newest.time_s)
            if asked is not None and self._feed.is_velocity:  # it stands where it stands
                asked = asked._replace(position_rad=self._stand_rad)
            still = SetPoint(0.0, self._stand_rad, self._sent_velocity_rad_s, 0.0, held, asked)
            self._insist(still, now_s)
        return self._still(AT_REST._replace(position_rad=self._stand_rad), phase)

    def _off(self) -> Step:
        """Take torque away."""
        return self._still(OFF, Stage.DISABLE.value)

    def _still(self, command: Command, phase: str) -> Step:
        self._sent_velocity_rad_s = 0.0
        return Step(command, phase, self._stand_rad)
