"""A robot controller that is not there: it drives the stair by itself, and says so over Modbus.

Joint, servo loop and friction are the fakes' own; the stair is planned from the parameters that
were written, as a controller's job program would. The register numbers are those of the handshake
in docs/modbus.md, written down here a second time on purpose.
`python -m fakes.modbus_controller` is one on a free loopback port.
"""

from __future__ import annotations

import argparse
import enum
import random
import struct
import sys
import time
from collections.abc import Callable

from fakes.modbus_registers import Registers
from fakes.modbus_server import TcpServer
from fakes.plant import Plant
from fakes.process import LateClock
from fakes.specification import FakeSpecification
from trajectories import (
    Trajectory,
    TrajectoryError,
    point_to_point,
    spaced_speeds,
    stair_between,
    stair_paired,
)

HOLDING, INPUT = 3, 4
LET_GO, SELECT, START, ABORT = 0, 1, 2, 3
AGENT_GONE, AGENT_ASKED, BAD_PARAMETERS = 1, 2, 3
AUTOMATIC_EXTERNAL = 4
PHASES = {"approach": 1, "ramp": 2, "steady": 3, "rest": 4, "return": 5}
STILL_RAD_S = 0.2
STOP_RAD_S2 = 300.0
READY_TIMEOUT_S = 10.0
SAMPLE_PERIOD_S = 0.02
STEP_S = 0.001


class State(enum.IntEnum):
    """What the job program says of itself."""

    IDLE = 0
    READY = 1
    RUNNING = 2
    DONE = 3
    ABORTED = 4
    FAULT = 5


class FakeController:
    """The controller; nothing runs by itself, `step_to` moves time.

    Parameters
    ----------
    specification : FakeSpecification, optional
        Joint, servo and gearbox.
    axis : int
        The only axis that it has.
    seed : int
        Of the noise on the reported torque.

    Attributes
    ----------
    misbehaviour : str
        What it does wrong from now on: ``hangs`` (the program stands still, the axis goes on),
        ``dies`` (the axis is stopped, its count too), ``ignores-abort``, ``runaway``,
        ``forgets-parameters``, ``never-starts``, ``stops-short`` (idle in the middle of the job),
        ``frozen-position``, ``no-velocity`` (it reports zero), ``other-units`` (tenths of both).
    """

    def __init__(
        self, specification: FakeSpecification | None = None, *, axis: int = 1, seed: int = 0
    ) -> None:
        given = specification or FakeSpecification()
        self.plant = Plant(given.joint, given.servo, given.thermal)
        self.registers = Registers()
        self.axis = axis
        self.state = State.IDLE
        self.error = 0
        self.mode = AUTOMATIC_EXTERNAL
        self.stops = 0
        self.misbehaviour = ""
        self.aborts = 0
        self._noise = random.Random(seed)
        self._noise_nm = given.servo.torque_noise_nm
        self._steps_per_ms = max(1, round(STEP_S / given.servo.step_s))
        self._ms = 0
        self._origin_s: float | None = None
        self._alive = 0
        self._seen_at_ms = 0
        self._seen_count = -1
        self._number = 0
        self._reported_rad = 0.0
        self._parts: list[tuple[str, Trajectory]] = []
        self._part_ms = 0
        self._stair_s = 1.0
        self._progress = 0.0
        self._phase = 0
        self.registers.put(HOLDING, 0, *([0] * 26))
        self.registers.put(INPUT, 0, *([0] * 20))
        self.registers.on_write = self._written
        self.registers.before_read = self._publish
        self._sample()

    # ---- time -----------------------------------------------------------------------------

    def step_to(self, now_s: float) -> None:
        """Move the joint and the job program to `now_s`, a millisecond at a time."""
        if self._origin_s is None:
            self._origin_s = now_s
        until_ms = int((now_s - self._origin_s) * 1e3 + 1e-6)
        while self._ms < until_ms:
            self._ms += 1
            if self.misbehaviour != "hangs":
                self._cycle()
            self.plant.advance(self._steps_per_ms)
            if self._ms % round(SAMPLE_PERIOD_S * 1e3) == 0 and self.misbehaviour != "hangs":
                self._sample()

    def _cycle(self) -> None:
        """One millisecond of the job program."""
        if self.misbehaviour == "dies":
            self._brake()
            return
        self._alive = self._alive + 1 & 0xFFFF
        if self.state is State.RUNNING:
            if self.misbehaviour == "stops-short":
                self._end(State.IDLE, 0)
                return
            if self._ms - self._seen_at_ms > self._number_in(3):
                self._end(State.ABORTED, AGENT_GONE)
                return
            self._drive()
            return
        if self.state is State.READY and self._ms - self._seen_at_ms > READY_TIMEOUT_S * 1e3:
            self.state = State.IDLE
        if self.state is not State.IDLE or self.plant.powered:
            self._brake()

    def _drive(self) -> None:
        """Follow the planned velocity; a part ends when its time is over and the joint stands."""
        name, trajectory = self._parts[0]
        self._part_ms += 1
        at = trajectory.at(self._part_ms * STEP_S)
        plant = self.plant
        plant.rise_rad_s2 = plant.fall_rad_s2 = 5e3  # the plan's own ramps are followed
        plant.target_rad_s = at.velocity_rad_s
        if self.misbehaviour == "runaway":
            plant.target_rad_s = 3.0 * abs(at.velocity_rad_s) + 150.0
        self._phase = PHASES.get(name, PHASES.get(at.phase, 0))
        if name == "stair":
            self._progress = min(1.0, self._part_ms * STEP_S / self._stair_s)
        over = self._part_ms * STEP_S >= trajectory.duration_s + 0.2
        if over and abs(plant.motor_velocity_rad_s) < STILL_RAD_S:
            self._parts.pop(0)
            self._part_ms = 0
            if not self._parts:
                self._end(State.DONE, 0)

    def _end(self, state: State, error: int) -> None:
        self.state, self.error = state, error
        self._brake()

    def _brake(self) -> None:
        """Bring the joint to rest on the controller's own ramp, then take torque away."""
        plant = self.plant
        plant.target_rad_s = 0.0
        plant.fall_rad_s2 = STOP_RAD_S2
        if plant.powered and abs(plant.motor_velocity_rad_s) < 0.01:
            plant.power_off()

    # ---- the handshake --------------------------------------------------------------------

    def _written(self, _function: int, address: int, value: int) -> None:
        if address == 2 and value != self._seen_count:
            self._seen_count, self._seen_at_ms = value, self._ms
        elif address == 0 and self.misbehaviour != "hangs":
            self._command(value)
        elif self.misbehaviour == "forgets-parameters" and address == 16:
            self.registers.put(HOLDING, address, 0)

    def _command(self, value: int) -> None:
        if value == LET_GO and self.state is not State.RUNNING:
            self.state, self.error = State.IDLE, 0
            self._progress, self._phase = 0.0, 0
        elif value == SELECT and self.state is State.IDLE:
            self._select()
        elif value == START and self.state is State.READY and self.misbehaviour != "never-starts":
            self.plant.power_on()
            self._seen_at_ms = self._ms
            self.state = State.RUNNING
        elif value == ABORT:
            self.aborts += 1
            if self.state is State.RUNNING and self.misbehaviour != "ignores-abort":
                self._end(State.ABORTED, AGENT_ASKED)

    def _select(self) -> None:
        if self._number_in(1) != self.axis:
            return
        try:
            self._plan()
        except (TrajectoryError, ValueError):
            self.error = BAD_PARAMETERS
            return
        self.state, self.error, self._seen_at_ms = State.READY, 0, self._ms

    def _plan(self) -> None:
        """Plan approach, stair and return from the parameters that were written."""
        low, high, slow, fast, acceleration, jerk, duration, approach = (
            self._float_in(10 + 2 * k) for k in range(8)
        )
        build = stair_between if self._number_in(4) else stair_paired
        speeds = spaced_speeds(slow, fast, self._number_in(6))
        stair = build(
            low,
            high,
            speeds_rad_s=speeds,
            duration_s=duration,
            acceleration_rad_s2=acceleration,
            jerk_rad_s3=jerk,
        )
        if self._number_in(5):
            stair = stair.reversed()
        here = self.plant.motor_position_rad

        def to(from_rad: float, to_rad: float) -> Trajectory:
            return point_to_point(
                from_rad=from_rad,
                to_rad=to_rad,
                velocity_rad_s=approach,
                acceleration_rad_s2=acceleration,
                jerk_rad_s3=jerk,
            )

        end = stair.at(stair.duration_s).position_rad
        self._parts = [
            ("approach", to(here, stair.start_position_rad)),
            ("stair", stair),
            ("return", to(end, here)),
        ]
        self._stair_s, self._part_ms = stair.duration_s, 0

    def _number_in(self, address: int) -> int:
        return self.registers.get(HOLDING, address)[0]

    def _float_in(self, address: int) -> float:
        packed = struct.pack(">HH", *self.registers.get(HOLDING, address, 2))
        value: float = struct.unpack(">f", packed)[0]
        return value

    # ---- what it says ---------------------------------------------------------------------

    def _sample(self) -> None:
        """Take a sample, as a controller does in its own time; reading does not take one."""
        plant = self.plant
        self._number = self._number + 1 & 0xFFFF
        torque = (plant.torque_nm if plant.powered else 0.0) + self._noise.gauss(0, self._noise_nm)
        degc = plant.gearbox.sensor_degc
        position, velocity = plant.motor_position_rad, plant.velocity_measured_rad_s
        if self.misbehaviour == "frozen-position":
            position = self._reported_rad
        elif self.misbehaviour == "no-velocity":
            velocity = 0.0
        elif self.misbehaviour == "other-units":
            position, velocity = 0.1 * position, 0.1 * velocity
        self._reported_rad = position
        values = (position, velocity, torque, degc)
        self.registers.put(
            INPUT,
            8,
            self._number,
            round(SAMPLE_PERIOD_S * 1e3),
            self._ms >> 16,
            self._ms & 0xFFFF,
            *struct.unpack(">8H", struct.pack(">4f", *values)),
        )
        self._publish()

    def _publish(self) -> None:
        selected = 0 if self.state is State.IDLE else self.axis
        self.registers.put(
            INPUT,
            0,
            self._alive,
            self.state,
            self.error,
            self.mode,
            self.stops,
            selected,
            round(1e3 * self._progress),
            self._phase,
        )


def main() -> None:
    """Be a controller in real time until ended; the first line on stdout says where."""
    parser = argparse.ArgumentParser(description=FakeController.__doc__)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    run(FakeController(seed=chosen.seed), chosen.port)


def run(controller: FakeController, port: int, ended: Callable[[], bool] = lambda: False) -> None:
    """Serve `controller` in real time on a loopback port."""
    server, clock = TcpServer(controller.registers, port), LateClock()
    sys.stdout.write(f"ready: 127.0.0.1:{server.port}\n")
    sys.stdout.flush()
    try:
        while not ended():
            server.step(0.002)
            controller.step_to(clock.now(time.perf_counter()))
    except KeyboardInterrupt:
        pass
    finally:
        server.close()


if __name__ == "__main__":
    main()
