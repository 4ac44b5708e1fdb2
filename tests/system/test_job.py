"""A robot controller that runs the stair itself, behind real Modbus bytes, in simulated time.

Each fault ends with the joint at rest, measured on the fake, within a stated time.
"""

from __future__ import annotations

import contextlib
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from agent.cell.cell import Cell, parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cycle.ending import CycleResult
from agent.cycle.plan import stair_of
from agent.errors import InputError, RefusedError, StoppedError
from agent.record.reading import read
from agent.wire.devices import job_controller
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import SteppedClock
from drivers.errors import (
    ConfigurationError,
    DriverError,
    DriveStateError,
    HeartbeatLostError,
    NodeMissingError,
)
from fakes.modbus_controller import READY_TIMEOUT_S, SAMPLE_PERIOD_S, FakeController
from fakes.modbus_server import Misbehaviour, RtuServer, TcpServer
from fakes.specification import FakeSpecification
from tests.contract.modbus_rig import pty_pair, served, unhurried
from trajectories import triangle

ALIVE_TIMEOUT_S = 0.3
IN_THE_STAIR_S = 4.0
REST_RAD_S = 0.5


@dataclass
class Bench:
    """A controller, the cell that describes it, and the cell's clock."""

    folder: Path
    cell: Cell
    clock: SteppedClock
    fake: FakeController
    server: TcpServer | RtuServer
    stop_reason: str | None = None

    def run(self, *, reverse: bool = False) -> CycleResult:
        return drive_cycle(
            CycleRequest(self.cell, self.cell.axis[0], self.folder, reverse),
            self.clock,
            stop_requested=lambda: self.stop_reason,
        )

    def at(self, time_s: float, act: Callable[[], None]) -> None:
        """Do something when the cell's clock has come to `time_s`."""
        waiting = [act]

        def step_to(now_s: float) -> None:
            if waiting and now_s >= time_s:
                waiting.pop()()

        self.clock.attach(step_to)

    def rests(self) -> bool:
        return abs(self.fake.plant.motor_velocity_rad_s) < REST_RAD_S


@contextmanager
def bench(
    folder: Path,
    *,
    initial_arm_rad: float = 0.0,
    line: str = "tcp",
    alive_timeout_s: float = ALIVE_TIMEOUT_S,
    timeout_s: float = 0.1,
    rate_hz: float = 100.0,
) -> Iterator[Bench]:
    """Yield a controller on ``tcp`` or, over a pty pair, ``rtu``, and the cell that asks for it."""
    specification = FakeSpecification.from_mapping(
        {"joint": {"initial_arm_position_rad": initial_arm_rad}}
    )
    fake = FakeController(specification, seed=3)
    text = fake_cell_text(specification, interface="virtual", channel="none", short=True)
    description = tomllib.loads(text)
    del description["bus"]
    description["recording"]["sample_rate_hz"] = rate_hz
    axis = description["axis"][0]
    del axis["drive"]
    axis["stair"] |= {"duration_s": 6.0, "speeds": 3}
    axis["job"] = {
        "kind": "modbus",
        "alive_timeout_s": alive_timeout_s,
        "timeout_s": timeout_s,
        "gearbox_temperature": True,
    }
    clock = SteppedClock()
    clock.attach(fake.step_to)
    with contextlib.ExitStack() as stack:
        server: TcpServer | RtuServer
        if line == "tcp":
            server = TcpServer(fake.registers)
            axis["job"]["tcp"] = f"127.0.0.1:{server.port}"
        else:
            descriptor, path = stack.enter_context(pty_pair())
            server = RtuServer(fake.registers, descriptor)
            axis["job"] |= {"rtu": path, "baudrate": 115_200, "parity": "N"}
        stack.enter_context(served(server))
        stack.enter_context(unhurried(server))
        yield Bench(folder, parse_cell(tomli_w.dumps(description)), clock, fake, server)


@pytest.mark.parametrize("line", ["tcp", "rtu"])
def test_the_controller_drives_the_cells_stair_and_every_sample_is_kept(
    line: str, tmp_path: Path
) -> None:
    # A thread serves the line: on a loaded machine that may take it more than a tenth of a second.
    with bench(tmp_path, line=line, alive_timeout_s=1.0, timeout_s=0.4) as made:
        result = made.run()
        assert made.rests()
        made.clock.sleep_until(made.clock.now() + 0.5)
        assert not made.fake.plant.powered
        assert made.fake.registers.get(4, 5) == (0,)  # let go of the axis
        stair = stair_of(made.cell.axis[0])
    assert result.account.lost == 0
    columns = read(result.recording).columns
    assert np.allclose(np.diff(columns["time_s"]), SAMPLE_PERIOD_S, atol=1.5e-3)
    steady = columns["phase"] == "steady"
    driven = sorted({round(w.velocity_rad_s, 3) for w in stair.steady_windows()})
    for speed in driven:
        near = np.abs(columns["velocity_rad_s"][steady] - speed) < 0.1 * abs(speed)
        assert near.sum() > 5, f"{speed} rad/s was not driven"
    assert np.isfinite(columns["gearbox_temperature_degc"]).all()
    metadata = read(result.recording).metadata
    assert isinstance(metadata.drive, dict)
    assert metadata.drive["settings"]["operating_mode"] == 4


def misbehave(kind: str) -> Callable[[Bench], None]:
    return lambda made: setattr(made.fake, "misbehaviour", kind)


def stop_asked(made: Bench) -> None:
    made.stop_reason = "the operator asked for it"


def silent(made: Bench) -> None:
    made.server.misbehaviour = Misbehaviour("silent")


def emergency(made: Bench) -> None:
    made.fake.stops = 1


def manual(made: Bench) -> None:
    made.fake.mode = 1


FAULTS: dict[str, tuple[Callable[[Bench], None], type[Exception], str]] = {
    "the operator stops it": (stop_asked, StoppedError, "the operator asked for it"),
    "its program dies": (misbehave("dies"), HeartbeatLostError, "alive count has stood still"),
    "it runs away": (misbehave("runaway"), StoppedError, "exceeds|outside"),
    "its position freezes": (misbehave("frozen-position"), StoppedError, "is not the joint's"),
    "it tells no velocity": (misbehave("no-velocity"), StoppedError, "is not the joint's|outside"),
    "it gives up": (misbehave("stops-short"), StoppedError, "was running and is now 'idle'"),
    "emergency stop": (emergency, DriveStateError, "EmergencyStop"),
    "switched to manual": (manual, DriveStateError, "MANUAL_REDUCED_SPEED"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_whatever_goes_wrong_in_motion_ends_at_rest(tmp_path: Path, name: str) -> None:
    act, error, says = FAULTS[name]
    with bench(tmp_path) as made:
        made.at(IN_THE_STAIR_S, lambda: act(made))
        with pytest.raises(error, match=says) as caught:
            made.run()
        assert made.rests()
        assert made.clock.now() < IN_THE_STAIR_S + ALIVE_TIMEOUT_S + 2.0 or "dies" in name
        assert made.fake.aborts > 0
    if name != "its program dies":  # which takes no new samples: nothing is measured then
        assert "The joint is at rest (measured)." in caught.value.__notes__
    (path,) = tmp_path.glob("*.parquet")
    assert read(path).columns["time_s"][-1] > 1.0


def test_a_job_that_is_not_the_stair_is_no_result(tmp_path: Path) -> None:
    with bench(tmp_path) as made:
        made.fake.misbehaviour = "other-units"
        with pytest.raises(
            StoppedError, match=r"fastest steady speed that was measured is \d+\.\d rad/s where"
        ):
            made.run()
        assert made.rests()
    assert len(list(tmp_path.glob("*.parquet"))) == 1


def test_an_agent_that_is_cut_off_is_missed_by_the_controller(tmp_path: Path) -> None:
    """The network ends in motion: our abort cannot arrive, the controller's watchdog must act."""
    with bench(tmp_path) as made:
        made.at(IN_THE_STAIR_S, lambda: setattr(made.server, "misbehaviour", Misbehaviour("deaf")))
        with pytest.raises((HeartbeatLostError, StoppedError)) as caught:
            made.run()
        assert made.rests()
        assert made.fake.aborts == 0
        assert made.fake.error == 1
    told = " ".join(caught.value.__notes__)
    assert "NOT seen to come to rest" in told
    assert "The controller may still hold the job" in told
    assert ".;" not in told


def test_an_agent_that_hangs_is_missed_by_the_controller(tmp_path: Path) -> None:
    with bench(tmp_path) as made:
        hung: list[float] = []

        def hang() -> str | None:
            if made.clock.now() > IN_THE_STAIR_S and not hung:
                hung.append(made.clock.now())
                made.clock.sleep_until(made.clock.now() + ALIVE_TIMEOUT_S + 0.5)
                assert made.rests(), "the controller did not notice"
            return None

        with pytest.raises((StoppedError, HeartbeatLostError)):
            drive_cycle(
                CycleRequest(made.cell, made.cell.axis[0], tmp_path),
                made.clock,
                stop_requested=hang,
            )
        assert hung


def test_one_lost_answer_is_forgiven(tmp_path: Path) -> None:
    def lose_one(made: Bench) -> None:
        made.server.misbehaviour = Misbehaviour("garbled", count=1)

    with bench(tmp_path) as made:
        made.at(IN_THE_STAIR_S, lambda: lose_one(made))
        result = made.run()
    assert result.account.received > 300


@pytest.mark.parametrize(
    ("act", "error", "says"),
    [
        (manual, DriveStateError, "automatic mode"),
        (emergency, DriveStateError, "EmergencyStop"),
        (misbehave("forgets-parameters"), ConfigurationError, "velocity_max|velocity_min|reads"),
        (misbehave("hangs"), ConfigurationError, "did not select axis 1"),
        (silent, NodeMissingError, "does not answer"),
        (misbehave("never-starts"), StoppedError, "did not begin within"),
    ],
)
def test_what_is_wrong_before_motion_is_refused_and_nothing_moves(
    tmp_path: Path, act: Callable[[Bench], None], error: type[DriverError], says: str
) -> None:
    with bench(tmp_path) as made:
        act(made)
        with pytest.raises(error, match=says):
            made.run()
        assert abs(made.fake.plant.motor_position_rad) < 0.01


def test_a_job_that_was_let_go_before_its_start_is_said_and_nothing_moves(tmp_path: Path) -> None:
    with bench(tmp_path) as made:

        def busy() -> None:
            made.clock.sleep_until(made.clock.now() + READY_TIMEOUT_S + 1.0)

        with pytest.raises(StoppedError, match=r"before anything moved: .* is now 'idle'"):
            drive_cycle(
                CycleRequest(made.cell, made.cell.axis[0], tmp_path),
                made.clock,
                stop_requested=busy,
            )
        assert abs(made.fake.plant.motor_position_rad) < 0.01


def test_a_controller_that_has_been_on_for_long_can_be_selected(tmp_path: Path) -> None:
    with bench(tmp_path) as made:
        made.fake._seen_at_ms = -60_000  # a minute ago, as far as it has ever heard of an agent
        with contextlib.closing(
            job_controller(made.cell.axis[0], made.clock, reverse=False)
        ) as job:
            job.open()
            assert made.fake.registers.get(4, 5) == (1,)


def test_an_arm_outside_its_window_is_refused(tmp_path: Path) -> None:
    with bench(tmp_path, initial_arm_rad=1.5) as made:
        with pytest.raises(RefusedError, match="outside its window"):
            made.run()
        assert made.fake.registers.get(4, 5) == (0,)


def test_what_a_killed_agent_left_is_let_go_by_the_next_run(tmp_path: Path) -> None:
    with bench(tmp_path) as made:
        killed = job_controller(made.cell.axis[0], made.clock, reverse=False)
        killed.open()
        killed.start()
        until_s = made.clock.now() + 1.0
        while made.clock.now() < until_s:
            killed.exchange()
            made.clock.sleep_until(made.clock.now() + 0.02)
        assert not made.rests()
        killed._device.connection.close()
        made.clock.sleep_until(made.clock.now() + ALIVE_TIMEOUT_S + 1.0)
        assert made.rests()
        assert made.fake.registers.get(4, 5) == (1,)
        other = job_controller(made.cell.axis[0], made.clock, reverse=False)
        other.open()  # selects it again; nothing runs
        assert other.close().lost == 0
        assert made.fake.registers.get(4, 5) == (0,)


def test_a_trajectory_of_ones_own_is_not_a_job(tmp_path: Path) -> None:
    with bench(tmp_path) as made:
        own = triangle(
            0.0,
            peak_velocity_rad_s=10.0,
            acceleration_rad_s2=100.0,
            jerk_rad_s3=1000.0,
            periods=1,
        )
        request = CycleRequest(made.cell, made.cell.axis[0], tmp_path, trajectory=own)
        with pytest.raises(InputError, match="the cell's own stair only"):
            drive_cycle(request, made.clock)
